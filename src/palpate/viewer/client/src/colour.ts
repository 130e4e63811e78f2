// Colours of a body: a light neutral where nothing is shown, and from there viridis from its bright end to its dark one (van der
// Walt & Smith 2015, released under CC0): lightness falls with the size. Its darkest part would vanish on a dark ground, its
// brightest is brighter than the neutral: both are left out.

import { Color, SRGBColorSpace } from "three";

const VIRIDIS = [
  0x440154, 0x472d7b, 0x3b528b, 0x2c728e, 0x21918c, 0x28ae80, 0x5ec962, 0xaddc30, 0xfde725,
].map((c) => [(c >> 16) / 255, ((c >> 8) & 255) / 255, (c & 255) / 255] as const);
const [BRIGHTEST, DARKEST] = [0.9, 0.16];
const NEUTRAL = [0.81, 0.83, 0.845] as const;
const FADE = 0.14; // of full scale, from the neutral to the full colour
export const NO_NEUTRAL = -1; // a share that is far from all of a scale: no part of it is neutral

export type Rgb = [number, number, number];

/** sRGB colour, each part 0 … 1, for a share of full scale 0 … 1; `none` is the share at which there is nothing to show. */
export function shade(share: number, none = 0): Rgb {
  const t = Math.min(Math.max(share, 0), 1);
  const at = (BRIGHTEST + (DARKEST - BRIGHTEST) * t) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(at), VIRIDIS.length - 2);
  const [a, b] = [VIRIDIS[i]!, VIRIDIS[i + 1]!];
  const u = Math.min(Math.abs(t - none) / FADE, 1);
  const colourful = u * u * (3 - 2 * u);
  return [0, 1, 2].map((k) => {
    const full = a[k]! + (b[k]! - a[k]!) * (at - i);
    return NEUTRAL[k]! + colourful * (full - NEUTRAL[k]!);
  }) as Rgb;
}

/** The colours of 256 shares from 0 to 1, for a picture. */
export function palette(none = 0): Color[] {
  return Array.from({ length: 256 }, (_, i) => new Color().setRGB(...shade(i / 255, none), SRGBColorSpace));
}

/** The colour scale as a CSS gradient from left to right. */
export function gradient(none = 0): string {
  const stops = Array.from({ length: 25 }, (_, i) => shade(i / 24, none).map((c) => Math.round(255 * c)));
  return `linear-gradient(to right, ${stops.map((c) => `rgb(${c.join(" ")})`).join(", ")})`;
}
