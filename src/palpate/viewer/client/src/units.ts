// Numbers as a person reads them, the page's elements, and the theme's colours.

export function element<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

export function input(id: string): HTMLInputElement {
  return element<HTMLInputElement>(id);
}

/** An element that says something. */
export function worded(tag: string, words: string): HTMLElement {
  const made = document.createElement(tag);
  made.textContent = words;
  return made;
}

/** The value of a custom property of the page's style sheet. */
export function css(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** 1, 2 or 5 times a power of ten, at least `x`. */
export function round125(x: number): number {
  const power = 10 ** Math.floor(Math.log10(x));
  const step = [1, 2, 5, 10].find((m) => m * power >= x * (1 - 1e-9)) ?? 10;
  return step * power;
}

const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/** Three significant digits without trailing zeros, a proper minus sign, and powers as 2.5 × 10⁻⁸. */
export function tidy(x: number): string {
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e-3 && size < 1e5) return minus(String(Number(x.toPrecision(3))));
  const [mantissa, power] = x.toExponential(2).split("e") as [string, string];
  const raised = power.replace("+", "").replace("-", "⁻").replace(/\d/g, (d) => RAISED[Number(d)]!);
  return minus(`${Number(mantissa)}\u00a0×\u00a010${raised}`);
}

/** A ratio in per cent; ratios too small for that as they are. */
export function share(x: number): string {
  return Math.abs(x) >= 1e-5 ? `${tidy(Number((100 * x).toPrecision(2)))}\u00a0%` : tidy(x);
}

/** A name as it is printed: what follows its underscore stands lower. */
export function printed(name: string): Node[] {
  const [stem, ...rest] = name.split("_");
  if (stem === undefined || stem.length > 2 || rest.length !== 1) return [document.createTextNode(name)];
  const below = document.createElement("sub");
  below.textContent = rest[0]!.replace(/([\d.]+)m$/, "$1\u00a0m");
  return [document.createTextNode(stem), below];
}

function minus(words: string): string {
  return words.replaceAll("-", "−");
}

/** Fixed decimals with a proper minus sign; what rounds to zero carries none. */
export function fixed(x: number, decimals: number): string {
  const words = x.toFixed(decimals);
  return Number(words) === 0 ? words.replace("-", "") : words.replace("-", "−");
}

/** A length in m or mm, whichever reads better beside `full`. */
export function metres(x: number, full: number): string {
  return full >= 0.1 ? `${tidy(x)} m` : `${tidy(1000 * x)} mm`;
}

const MULTIPLES: Record<string, readonly (readonly [size: number, unit: string])[]> = {
  m: [
    [1, "m"],
    [1e-3, "mm"],
    [1e-6, "µm"],
  ],
  Pa: [
    [1e9, "GPa"],
    [1e6, "MPa"],
    [1e3, "kPa"],
    [1, "Pa"],
  ],
};

/** The multiple of a unit for values up to `full`: the largest of which `full` is at least a tenth. */
export function multiple(full: number, unit: string): { size: number; unit: string } {
  const all = MULTIPLES[unit] ?? [[1, unit] as const];
  const [size, name] = all.find(([size]) => Math.abs(full) >= 0.1 * size) ?? all.at(-1)!;
  return { size, unit: name };
}

/** A value with the unit that reads well. */
export function measured(x: number, unit: string): string {
  const { size, unit: name } = multiple(x, unit);
  return `${tidy(x / size)} ${name}`;
}
