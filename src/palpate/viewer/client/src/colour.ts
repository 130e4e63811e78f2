// Perceptually uniform colours: viridis (van der Walt & Smith 2015, released under CC0), without its darkest part,
// which would vanish on a dark ground.

const VIRIDIS = [
  0x440154, 0x472d7b, 0x3b528b, 0x2c728e, 0x21918c, 0x28ae80, 0x5ec962, 0xaddc30, 0xfde725,
].map((c) => [(c >> 16) / 255, ((c >> 8) & 255) / 255, (c & 255) / 255] as const);
const DARKEST = 0.14;

export type Rgb = [number, number, number];

/** sRGB colour, each part 0 … 1, for a share of full scale 0 … 1. */
export function shade(share: number): Rgb {
  const t = DARKEST + (1 - DARKEST) * Math.min(Math.max(share, 0), 1);
  const at = t * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(at), VIRIDIS.length - 2);
  const [a, b] = [VIRIDIS[i]!, VIRIDIS[i + 1]!];
  return [0, 1, 2].map((k) => a[k]! + (b[k]! - a[k]!) * (at - i)) as Rgb;
}

/** The colour scale as a CSS gradient from left to right. */
export function gradient(): string {
  const stops = Array.from({ length: 13 }, (_, i) => shade(i / 12).map((c) => Math.round(255 * c)));
  return `linear-gradient(to right, ${stops.map((c) => `rgb(${c.join(" ")})`).join(", ")})`;
}
