// Readings of a side panel that every page has: numbers, sliders, the loop's timing, the flags.

import type { Beat, Flag } from "./flags";
import { Hold, Loop } from "./messages";
import type { RangeInfo } from "./messages";
import { Plot } from "./plot";
import { fixed, printed, tidy } from "./units";

export const EVERY = 80; // ms between changes of the numbers: faster can't be read

export function element<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

/** How late the loop is, and how far pictures trail the hand. */
export class Timing {
  private readonly lateness = new Plot(element<HTMLCanvasElement>("lateness-plot"), "--accent-2");
  private pictures = 0;
  private since = 0;
  private delay = NaN; // ms from the hand's message to the picture, smoothed

  recolour(): void {
    this.lateness.recolour();
  }

  /** Every frame. */
  add(frame: Beat, drawn: boolean): void {
    if (frame.loop === Loop.RUNNING) this.lateness.add(frame.time, 1e6 * frame.lateness);
    this.pictures += drawn ? 1 : 0;
  }

  /** Now and then. */
  show(frame: Beat, now: number): void {
    duration("lateness-p50", frame.lateness_p50);
    duration("lateness-p99", frame.lateness_p99);
    duration("lateness-max", frame.lateness_max);
    put("rate", frame.rate, 0);
    this.delay += 0.2 * (now - frame.echo - this.delay);
    if (!frame.grabbed || frame.hold !== Hold.YOURS) this.delay = NaN;
    else if (Number.isNaN(this.delay)) this.delay = now - frame.echo;
    put("delay", this.delay, 0);
    duration("work", frame.work_p50);
    if (now - this.since > 1000) {
      put("picture-rate", (1000 * this.pictures) / (now - this.since), 0);
      [this.pictures, this.since] = [0, now];
    }
    const scale = { unit: "µs", low: 1, high: 1e5, logarithmic: true, stepped: true };
    this.lateness.draw(frame.time, scale, [1e6 * frame.lateness_p50, 1e6 * frame.lateness_p99]);
  }
}

/** The list of flags; changed only when they change, since it is read aloud. */
export class Flags {
  private shown = "";

  tell(found: Flag[]): void {
    const key = JSON.stringify(found);
    if (key === this.shown) return;
    this.shown = key;
    element("flags").replaceChildren(
      ...found.map((flag) => {
        const row = document.createElement("li");
        row.textContent = flag.words;
        row.dataset["flag"] = flag.id;
        row.dataset["tone"] = flag.tone;
        return row;
      }),
    );
  }

  /** The tab went to the background. */
  hidden(): void {
    this.tell([{ id: "hidden", tone: "warn", words: "This tab is in the background: the hand has let go." }]);
  }

  /** Nothing is known any more. */
  lost(): void {
    this.tell([{ id: "lost", tone: "bad", words: "Disconnected: nothing is known of the body. Trying again." }]);
  }
}

/** What every frame tells programs that read the page. */
export function record(frame: Beat): void {
  const data = document.documentElement.dataset;
  data["tick"] = String(frame.tick);
  data["time"] = String(frame.time);
  data["position"] = frame.position.join(" ");
  data["force"] = frame.force.join(" ");
  data["parameters"] = frame.parameters.join(" ");
  data["grabbed"] = String(frame.grabbed);
  data["inside"] = String(frame.inside);
  data["loop"] = String(frame.loop);
  data["hold"] = String(frame.hold);
}

/** An input and its range, which no line break parts. */
export function trained(range: RangeInfo, i: number): (Node | string)[] {
  const words = document.createElement("span");
  words.className = "whole";
  words.append(...printed(range.name), ` ${tidy(range.low)} … ${tidy(range.high)} ${range.unit}`);
  return i === 0 ? [words] : [", ", words];
}

export function put(id: string, value: number, decimals: number): void {
  const output = element(id);
  output.textContent = Number.isFinite(value) ? fixed(value, decimals) : "–";
  output.dataset["value"] = String(value);
}

/** A duration in s as µs or ms. */
export function duration(id: string, seconds: number): void {
  const [us, output] = [1e6 * seconds, element(id)];
  output.dataset["value"] = String(us);
  if (us < 1) output.textContent = "< 1 µs"; // where the loop's histogram starts
  else output.textContent = us < 9999.5 ? `${fixed(us, us < 9.95 ? 1 : 0)} µs` : `${fixed(us / 1000, 0)} ms`;
}

export function sliders(parameters: RangeInfo[], moved: (i: number, value: number) => void): void {
  element("parameters").hidden = parameters.length === 0;
  element("sliders").replaceChildren(
    ...parameters.map((range, i) => {
      const [label, value, input] = ["label", "output", "input"].map((t) => document.createElement(t));
      const slider = input as HTMLInputElement;
      [slider.type, slider.id] = ["range", `parameter-${i}`];
      [slider.min, slider.max, slider.step] = [range.low, range.high, (range.high - range.low) / 200].map(String) as [
        string,
        string,
        string,
      ];
      slider.dataset["unit"] = range.unit;
      slider.addEventListener("input", () => moved(i, slider.valueAsNumber));
      const name = document.createElement("span");
      name.append(...printed(range.name));
      label!.append(name, value!, slider);
      return label!;
    }),
  );
}

/** Sliders show the values in force, whoever set them, except under the user's finger. */
export function follow(frame: Beat): void {
  frame.parameters.forEach((value, i) => {
    const slider = document.getElementById(`parameter-${i}`) as HTMLInputElement | null;
    if (!slider) return;
    if (!slider.matches(":active")) slider.valueAsNumber = value;
    slider.previousElementSibling!.textContent = `${tidy(value)} ${slider.dataset["unit"]}`;
  });
}
