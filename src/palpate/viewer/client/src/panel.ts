// The side panel of a touched body: force, displacement or depth, how far to trust it, sliders, the loop's timing.

import { about } from "./about";
import { flags } from "./flags";
import { away, moves, pinches } from "./hand_words";
import type { Flag, Places } from "./flags";
import { Hold, Loop } from "./messages";
import type { Frame, Hello, RangeInfo } from "./messages";
import { Plot } from "./plot";
import { element, fixed, input, interval, measured, rangeUnit, round125, share, tidy, worded } from "./units";

const EVERY = 80; // ms between changes of the numbers: faster can't be read
const AT_FIRST = 0.5; // of the deepest trained depth, how deep a press goes
const SAME = 1e-6; // of a range, by which its ends may differ and still be as far
const MOST = 1.25; // so that it can be seen what lies outside
const NUMBERS = ["force-norm", "force-x", "force-y", "force-z", "tip-x", "tip-y", "tip-z", "tip-norm"];
const DEGREES = { size: Math.PI / 180, unit: "°" }; // people turn by degrees
const UNKNOWN = [...NUMBERS, "torque-norm", "torque-x", "torque-y", "torque-z", "effort", "depth", "stiffness", "rate", "picture-rate"];

const PULLING: Places = {
  inside: "Within what it was trained on.",
  outside: "Outside the trained range: nothing vouches for the force.",
};
const PRESSING: Places = {
  inside: "Inside what the surrogate was trained on.",
  outside: "Outside the trained region: the energy is continued, and nothing vouches for the force.",
};

export interface Wishes {
  moved(i: number, value: number): void;
  deeper(depth: number): void;
}

export class Panel {
  private readonly force = new Plot(element<HTMLCanvasElement>("force-plot"), "--accent");
  private readonly timing = new Timing();
  private flagged = "";
  private hello: Hello | null = null;
  private last = 0;
  private error: number | null = null; // of the force over all places, at the 95th percentile

  recolour(): void {
    this.force.recolour();
    this.timing.recolour();
    this.last = 0;
  }

  /** Depths of a press at first and at most, m. */
  static depths(hello: Hello): readonly [first: number, most: number] {
    return [AT_FIRST * hello.deepest, MOST * hello.deepest];
  }

  /** Another body, or the same after a restart. */
  start(hello: Hello, wishes: Wishes): void {
    this.hello = hello;
    element("model-name").textContent = hello.name;
    element("model-line").replaceChildren(...subtitle(hello), hello.remembers ? `; ${hello.remembers}` : "");
    moves(hello);
    document.title = `${hello.name} · palpate`;
    sliders(hello.parameters, (i, value) => wishes.moved(i, value));
    const [first, most] = Panel.depths(hello);
    const slider = input("depth-wanted");
    [slider.max, slider.step] = [String(most), String(most / 250)];
    slider.oninput = () => {
      wishes.deeper(slider.valueAsNumber);
      this.depth(slider.valueAsNumber);
    };
    this.depth(first);
    this.describe(hello);
  }

  /** Another surrogate of the same body: sliders stay where they are. */
  renew(hello: Hello): void {
    this.hello = hello;
    this.describe(hello);
  }

  private describe(hello: Hello): void {
    element("pad-words").textContent = hello.pad;
    element("torque").hidden = !hello.twists;
    about(hello, [
      [hello.holds ? "largest trained displacement" : "deepest trained press", measured(hello.deepest, "m")],
      ["largest trained force", `${tidy(hello.force_max)} N`],
      ["largest trained stiffness", `${tidy(hello.stiffness_max)} N/m`],
    ]);
  }

  /** Take the force error over all places, relative, at the 95th percentile; null where it is not known. */
  state(error: number | null): void {
    this.error = error;
  }

  /** Show how deep (m) the next press goes. */
  depth(depth: number): void {
    input("depth-wanted").valueAsNumber = depth;
    const beyond = depth > this.hello!.deepest * (1 + 1e-9);
    element("depth-label").textContent = `${tidy(1000 * depth)} mm${beyond ? ", untrained" : ""}`;
  }

  /** Say with which share of the display's resolution the body is drawn. */
  sharpness(share: number): void {
    if (element("resolution").dataset["value"] !== String(100 * share)) put("resolution", 100 * share, 0);
  }

  /** Record every frame; now and then show it. */
  update(frame: Frame): void {
    const hello = this.hello;
    if (!hello) return;
    this.force.add(frame.time, Math.hypot(...frame.force));
    this.timing.add(frame);
    const now = performance.now();
    if (now - this.last < EVERY) return;
    this.last = now;
    this.numbers(frame);
    this.timing.show(frame, now);
    this.list(flags(frame, hello, hello.holds ? PULLING : PRESSING));
    follow(frame);
    const peak = round125(Math.max(this.force.peak(frame.time), 0.05 * hello.force_max, 1e-9));
    this.force.draw(frame.time, { unit: "N", low: 0, high: peak, logarithmic: false, stepped: false });
  }

  /** The tab went to the background. */
  hidden(): void {
    this.list([{ id: "hidden", tone: "warn", words: away() }]);
  }

  /** Nothing is known any more. */
  lost(): void {
    for (const id of UNKNOWN) put(id, NaN, 0);
    element("trust").textContent = element("deviation").textContent = "–";
    this.compare(false);
    delete document.documentElement.dataset["tick"];
    this.list([{ id: "lost", tone: "bad", words: "Disconnected: nothing is known of the body. Trying again." }]);
  }

  private numbers(frame: Frame): void {
    const felt = frame.grabbed;
    const offset = this.hello!.line ? frame.contact : frame.position;
    put("force-norm", Math.hypot(...frame.force), 3);
    put("effort", frame.effort, 3);
    if (this.hello!.twists) put("torque-norm", 1000 * Math.hypot(...frame.torque), 2);
    put("tip-norm", 1000 * Math.hypot(...offset), 1);
    ["x", "y", "z"].forEach((axis, k) => {
      put(`force-${axis}`, frame.force[k]!, 3);
      if (this.hello!.twists) put(`torque-${axis}`, 1000 * frame.torque[k]!, 2);
      put(`tip-${axis}`, 1000 * offset[k]!, 1);
    });
    put("depth", felt ? 1000 * Math.max(frame.depth, 0) : NaN, 2);
    put("stiffness", felt ? frame.stiffness : NaN, 0);
    element("trust").textContent = !felt ? "–" : frame.inside ? "inside" : "outside";
    element("deviation").textContent = deviation(frame, this.hello!);
    this.compare(element("deviation").textContent.startsWith("±"));
    record(frame); // one frame, whole
  }

  /** Say beside the deviation at this place how it goes together with the error over all places. */
  private compare(stated: boolean): void {
    const note = element("deviation-note");
    note.hidden = !stated || this.error === null;
    if (this.error === null) return;
    const words = `An estimate for this place. Over all places it is ${share(this.error)} at most, for 95 of 100 presses.`;
    if (note.textContent !== words) note.textContent = words;
  }

  /** The list of flags; changed only when they change, since it is read aloud. */
  private list(flagged: Flag[]): void {
    const key = JSON.stringify(flagged);
    if (key === this.flagged) return;
    this.flagged = key;
    element("flags").replaceChildren(
      ...flagged.map((flag) => {
        const row = worded("li", flag.words);
        [row.dataset["flag"], row.dataset["tone"]] = [flag.id, flag.tone];
        return row;
      }),
    );
  }
}

/** Lateness of the loop, and delay of the pictures behind the hand. */
class Timing {
  private readonly lateness = new Plot(element<HTMLCanvasElement>("lateness-plot"), "--accent-2");
  private pictures = 0;
  private since = 0;
  private delay = NaN; // ms from the hand's message to the picture, smoothed

  recolour(): void {
    this.lateness.recolour();
  }

  /** Every frame. */
  add(frame: Frame): void {
    if (frame.loop === Loop.RUNNING) this.lateness.add(frame.time, 1e6 * frame.lateness);
    this.pictures += 1;
  }

  /** Now and then. */
  show(frame: Frame, now: number): void {
    duration("lateness-p50", frame.lateness_p50);
    duration("lateness-p99", frame.lateness_p99);
    duration("lateness-max", frame.lateness_max);
    put("rate", frame.rate, 0);
    element("rate-note").textContent = frame.resting ? "ticks, nobody touches" : "ticks";
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

/** The line under the body's name: the probe, and the ranges that were trained. */
function subtitle(hello: Hello): (Node | string)[] {
  // the words of a tool are long, and may be parted
  const probe = hello.tool ? hello.tool.words : whole(`probe of radius ${measured(hello.radius, "m")}`);
  const press = [probe, whole(`trained to ${measured(hello.deepest, "m")} deep`)];
  // the words of a tool tell how far it turns; friction is not trained, and stands with what is remembered
  const further = hello.parameters.filter(({ name }, i) => name !== "friction" && !hello.tool?.turns.includes(i));
  const ranges = hello.holds ? hello.inputs : further;
  const parts = [...(hello.holds ? [] : press), ...trained(ranges)];
  const joined = parts.flatMap((part, i) => (i === 0 ? [part] : [", ", part]));
  return hello.holds ? ["trained on ", ...joined] : joined;
}

/** Publish a frame for programs that read the page. */
function record(frame: Frame): void {
  const data = document.documentElement.dataset;
  for (const name of ["position", "force", "torque", "contact", "parameters"] as const) data[name] = frame[name].join(" ");
  for (const name of ["tick", "time", "effort", "grabbed", "inside", "loop", "hold", "depth", "deviation"] as const) {
    data[name] = String(frame[name]);
  }
}

/** Words that no line break parts. */
function whole(words: string): HTMLElement {
  const span = worded("span", words);
  span.className = "whole";
  return span;
}

/** Inputs and their ranges; those that differ in their axis alone stand together. */
function trained(ranges: readonly RangeInfo[]): HTMLElement[] {
  const groups = new Map<string, string[]>();
  for (const { words, low, high, unit } of ranges) {
    const [, stem, axis] = /^(.* along )([xyz])$/.exec(words) ?? ["", words, ""];
    // as far to both sides: also where a mirrored body was loaded to one side alone
    const both = low < 0 && Math.abs(low + high) < SAME * high;
    const key = `${stem}\t${both ? `up to ${measured(high, unit)} either way` : interval(low, high, unit)}`;
    groups.set(key, [...(groups.get(key) ?? []), axis!]);
  }
  return [...groups].map(([key, axes]) => {
    const [stem, between] = key.split("\t");
    const words = worded("span", `${stem}${axes.join(", ")} `);
    words.append(whole(between!));
    return words;
  });
}

/** The deviation of the force, in words. */
function deviation(frame: Frame, hello: Hello): string {
  if (!frame.grabbed || (!hello.holds && frame.depth <= 0)) return "–"; // no force, no deviation
  if (Number.isNaN(frame.deviation) || !frame.inside) return "not known";
  if (!pinches(hello)) return `± ${share(frame.deviation)}`;
  return `± ${measured(frame.deviation * Math.hypot(...frame.force), "N")}`; // two jaws' forces cancel, their error does not
}

function put(id: string, value: number, decimals: number): void {
  const output = element(id);
  output.textContent = Number.isFinite(value) ? fixed(value, decimals) : "–";
  output.dataset["value"] = String(value);
}

/** A duration in s as µs or ms. */
function duration(id: string, seconds: number): void {
  const [us, output] = [1e6 * seconds, element(id)];
  output.dataset["value"] = String(us);
  if (us < 1) output.textContent = "< 1 µs"; // where the loop's histogram starts
  else output.textContent = us < 9999.5 ? `${fixed(us, us < 9.95 ? 1 : 0)} µs` : `${fixed(us / 1000, 0)} ms`;
}

function sliders(parameters: RangeInfo[], moved: (i: number, value: number) => void): void {
  element("parameters").hidden = parameters.length === 0;
  element("sliders").replaceChildren(
    ...parameters.map((range, i) => {
      const [label, value, name] = ["label", "output", "span"].map((tag) => document.createElement(tag));
      const slider = document.createElement("input");
      [slider.type, slider.id] = ["range", `parameter-${i}`];
      [slider.min, slider.max] = [String(range.low), String(range.high)];
      slider.step = String((range.high - range.low) / 200);
      const { size, unit } = range.unit === "rad" ? DEGREES : rangeUnit(range.low, range.high, range.unit);
      [slider.dataset["size"], slider.dataset["unit"]] = [String(size), unit];
      slider.addEventListener("input", () => moved(i, slider.valueAsNumber));
      name!.append(range.words);
      label!.append(name!, value!, slider);
      return label!;
    }),
  );
}

/** Sliders show the values in force, whoever set them, except under the user's finger. */
function follow(frame: Frame): void {
  frame.parameters.forEach((value, i) => {
    const slider = document.getElementById(`parameter-${i}`) as HTMLInputElement | null;
    if (!slider) return;
    if (!slider.matches(":active")) slider.valueAsNumber = value;
    const { size, unit } = slider.dataset;
    slider.previousElementSibling!.textContent = `${tidy(value / Number(size))} ${unit}`;
  });
}
