// The colour scale: which quantity colours the body, between which values, and how large it is now.

import { gradient } from "./colour";
import type { FieldInfo, TrustMap } from "./messages";
import { capital, element, multiple, tidy, worded } from "./units";

/** Show the scale of a quantity; null hides it. `none` is the share of it at which there is nothing to show. */
export function legend(info: FieldInfo | null, none = info ? nothing(info) : 0): void {
  element("legend").hidden = !info;
  if (!info) return;
  const { size, unit } = scale(info);
  element("legend-bar").style.background = gradient(none);
  element("legend-title").textContent = unit ? `${info.name} (${unit})` : info.name;
  element("legend-ticks").replaceChildren(
    ...[0, 0.5, 1].map((t) => worded("span", tidy((info.low + t * (info.high - info.low)) / size))),
  );
}

/** What the colours of a map of trust show, in per cent. */
export function trusted({ high, known }: TrustMap): FieldInfo {
  const name = known ? "uncertainty of the force" : "not trained";
  return { name, unit: "%", low: 0, high: 100 * high, components: 1, modes: 0 };
}

/** A button for each quantity; `choose` hears of the one taken, `chosen` is the one at first. */
export function choices(infos: FieldInfo[], choose: (index: number) => void, chosen = 0): void {
  element("colours").hidden = infos.length < 2;
  const buttons = infos.map((info, i) => {
    const button = worded("button", info.name) as HTMLButtonElement;
    button.type = "button";
    button.setAttribute("aria-pressed", String(i === chosen));
    button.addEventListener("click", () => {
      buttons.forEach((other, j) => other.setAttribute("aria-pressed", String(j === i)));
      choose(i);
    });
    return button;
  });
  element("fields").replaceChildren(...buttons);
}

/** Say how large a quantity is at most, of its values at the body's points; return that. */
export function largest(info: FieldInfo | null, values: Float32Array): number {
  element("largest-section").hidden = !info;
  if (!info) return 0;
  const { size, unit } = scale(info);
  let most = -Infinity;
  for (let i = 0; i < values.length; i++) if (values[i]! > most) most = values[i]!;
  element("largest-title").textContent = info.name.startsWith("largest") ? capital(info.name) : `Largest ${info.name}`;
  element("largest").textContent = tidy(most / size);
  element("largest-unit").textContent = unit;
  document.documentElement.dataset["largest"] = String(most); // for programs that read the page
  return most;
}

/** The share of the scale at which a quantity shows nothing: its zero, or the lower end of a scale without one. */
export function nothing({ low, high }: FieldInfo): number {
  return low < 0 ? Math.min(-low / (high - low), 1) : 0;
}

/** Each point's share of the scale, into `out` if that is given. */
export function shares(info: FieldInfo, values: Float32Array, out = new Float32Array(values.length)): Float32Array {
  const [low, scale] = [info.low, 1 / (info.high - info.low)];
  for (let i = 0; i < values.length; i++) out[i] = (values[i]! - low) * scale;
  return out;
}

function scale(info: FieldInfo): { size: number; unit: string } {
  return multiple(Math.max(Math.abs(info.low), Math.abs(info.high)), info.unit);
}
