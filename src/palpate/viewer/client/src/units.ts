// Numbers as a person reads them, by the rules of palpate/format.py, so that terminal and page say the same figure alike; the
// page's elements; the theme's colours.

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

/** `palpate.format.plain`: so many significant digits without trailing zeros, and powers as 2.50 × 10⁻⁸. */
export function tidy(x: number, digits = 3): string {
  if (!Number.isFinite(x)) return Number.isNaN(x) ? "not a number" : "infinite";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size < 1e-3 || size >= 1e6) return scientific(x, digits);
  const words = x.toFixed(Math.max(0, digits - 1 - Math.floor(Math.log10(size))));
  return minus(words.includes(".") ? words.replace(/\.?0+$/, "") : words);
}

function scientific(x: number, digits: number): string {
  const [mantissa, power] = x.toExponential(digits - 1).split("e") as [string, string];
  const raised = power.replace("+", "").replace("-", "⁻").replace(/\d/g, (d) => RAISED[Number(d)]!);
  return minus(`${mantissa}\u00a0×\u00a010${raised}`);
}

/** An area as a person reads it. */
export function square(area: number): string {
  return area >= 1e-4 ? `${tidy(1e4 * area)} cm²` : `${tidy(1e6 * area)} mm²`;
}

/** `palpate.format.share`: a ratio in per cent. */
export function share(x: number): string {
  return `${tidy(100 * x, 2)}\u00a0%`;
}

function minus(words: string): string {
  return words.replaceAll("-", "−");
}

/** Fixed decimals with a proper minus sign; what rounds to zero carries none. */
export function fixed(x: number, decimals: number): string {
  const words = x.toFixed(decimals);
  return Number(words) === 0 ? words.replace("-", "") : words.replace("-", "−");
}

/** `palpate.format.interval` without the name: lengths below 1 m in mm. */
export function interval(low: number, high: number, unit: string): string {
  const { size, unit: name } = rangeUnit(low, high, unit);
  return `${tidy(low / size)} … ${tidy(high / size)} ${name}`.trimEnd();
}

/** The multiple in which all values of a range are printed: mm for lengths below 1 m, else the unit itself. */
export function rangeUnit(low: number, high: number, unit: string): { size: number; unit: string } {
  const short = unit === "m" && Math.max(Math.abs(low), Math.abs(high)) < 1;
  return short ? { size: 1e-3, unit: "mm" } : { size: 1, unit };
}

const MULTIPLES: Record<string, readonly (readonly [size: number, unit: string])[]> = {
  m: [
    [1, "m"],
    [1e-3, "mm"],
    [1e-6, "µm"],
    [1e-9, "nm"],
  ],
  Pa: [
    [1e9, "GPa"],
    [1e6, "MPa"],
    [1e3, "kPa"],
    [1, "Pa"],
  ],
};

const ROUNDS_TO = 0.9995; // so that 999.6 mm is 1 m

/** The multiple of a unit for values up to `full`: the largest of which `full` is at least one. */
export function multiple(full: number, unit: string): { size: number; unit: string } {
  const all = MULTIPLES[unit] ?? [[1, unit] as const];
  const fitting = all.find(([size]) => Math.abs(full) >= ROUNDS_TO * size) ?? all.at(-1)!;
  const [size, name] = full === 0 ? (all.find(([size]) => size === 1) ?? fitting) : fitting;
  return { size, unit: name };
}

/** `palpate.format.length` and `pressure`: a value with the multiple of its unit that fits it. */
export function measured(x: number, unit: string): string {
  const { size, unit: name } = multiple(x, unit);
  return `${tidy(x / size)} ${name}`;
}

/** Words that begin with a capital letter. */
export function capital(words: string): string {
  return words.charAt(0).toUpperCase() + words.slice(1);
}
