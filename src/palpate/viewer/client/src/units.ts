// Numbers as a person reads them, and the theme's colours.

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

/** Three significant digits without trailing zeros, and a proper minus sign. */
export function tidy(x: number): string {
  if (x === 0) return "0";
  const size = Math.abs(x);
  const short = size < 1e-3 || size >= 1e5 ? x.toExponential(2) : String(Number(x.toPrecision(3)));
  return short.replace("e+", "e").replaceAll("-", "−");
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
