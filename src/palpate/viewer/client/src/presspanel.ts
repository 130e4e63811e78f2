// The side panel of a body that is pressed: force, depth, how far to trust it, sliders, the loop's timing.

import { about } from "./about";
import { flags } from "./flags";
import type { Look, Press, Touched } from "./messages";
import { Plot } from "./plot";
import { element, EVERY, Flags, follow, put, record, sliders, Timing, trained } from "./readings";
import { measured, metres, multiple, round125, share, tidy } from "./units";

const AT_FIRST = 0.5; // of the deepest trained depth
const MOST = 1.25; // so that it can be seen what lies outside
const PLACES = {
  free: "Nobody presses. Hold the mouse button, a finger or the space bar on the body.",
  inside: "Inside what the surrogate was trained on.",
  outside: "Outside the trained region: the energy is continued, and nothing vouches for the force.",
};

interface Told {
  moved(i: number, value: number): void;
  deeper(depth: number): void;
}

export class PressPanel {
  start_depth = 0; // m
  most = 0;

  private readonly force = new Plot(element<HTMLCanvasElement>("force-plot"), "--accent");
  private readonly timing = new Timing();
  private readonly flags = new Flags();
  private readonly slider = element<HTMLInputElement>("depth-wanted");
  private hello: Touched | null = null;
  private last = 0;

  recolour(): void {
    this.force.recolour();
    this.timing.recolour();
    this.last = 0;
  }

  /** Another body, or the same after a restart. */
  start(hello: Touched, told: Told): void {
    this.hello = hello;
    [this.start_depth, this.most] = [AT_FIRST * hello.deepest, MOST * hello.deepest];
    element("model-name").textContent = hello.name;
    element("model-line").replaceChildren(
      ...[`probe of radius ${measured(hello.radius, "m")}`, ", ", `trained to ${measured(hello.deepest, "m")} deep`].map(whole),
      ...(hello.parameters.length ? [", ", ...hello.parameters.flatMap(trained)] : []),
      hello.remembers ? `; ${hello.remembers}` : "",
    );
    document.title = `${hello.name} · palpate`;
    sliders(hello.parameters, told.moved);
    [this.slider.max, this.slider.step] = [String(this.most), String(this.most / 250)];
    this.slider.oninput = () => {
      told.deeper(this.slider.valueAsNumber);
      this.depth(this.slider.valueAsNumber);
    };
    this.depth(this.start_depth);
    about(hello, [
      ["largest trained force", `${tidy(hello.force_max)} N`],
      ["largest trained stiffness", `${tidy(hello.stiffness_max)} N/m`],
      ...hello.fields.map((look) => [look.name, `${look.modes} modes`] as const),
    ]);
  }

  /** Show how deep (m) the next press goes. */
  depth(depth: number): void {
    this.slider.valueAsNumber = depth;
    const beyond = depth > this.hello!.deepest * (1 + 1e-9);
    element("depth-label").textContent = `${metres(depth, 0)}${beyond ? ", untrained" : ""}`;
  }

  /** Record every frame; now and then show it. */
  update(frame: Press): void {
    const hello = this.hello;
    if (!hello) return;
    this.force.add(frame.time, Math.hypot(...frame.force));
    this.timing.add(frame, true);
    const now = performance.now();
    if (now - this.last < EVERY) return;
    this.last = now;
    this.numbers(frame);
    this.timing.show(frame, now);
    this.flags.tell(flags(frame, hello, PLACES));
    follow(frame);
    const peak = round125(Math.max(this.force.peak(frame.time), 0.05 * hello.force_max));
    this.force.draw(frame.time, { unit: "N", low: 0, high: peak, logarithmic: false, stepped: false });
  }

  /** The largest value of the field that colours the body. */
  largest(look: Look | null, values: Float32Array): void {
    element("largest-section").hidden = !look;
    if (!look) return;
    const { size, unit } = multiple(Math.max(Math.abs(look.low), Math.abs(look.high)), look.unit);
    const most = values.reduce((a, b) => Math.max(a, b), -Infinity);
    element("largest-title").textContent = look.name.startsWith("largest") ? look.name : `Largest ${look.name}`;
    element("largest").textContent = `${tidy(most / size)} ${unit}`;
    document.documentElement.dataset["largest"] = String(most);
  }

  /** The tab went to the background. */
  hidden(): void {
    this.flags.hidden();
  }

  /** Nothing is known any more. */
  lost(): void {
    for (const id of ["force-norm", "force-x", "force-y", "force-z", "depth", "stiffness", "rate", "picture-rate"]) {
      put(id, NaN, 0);
    }
    element("trust").textContent = element("deviation").textContent = "–";
    delete document.documentElement.dataset["tick"];
    this.flags.lost();
  }

  private numbers(frame: Press): void {
    const data = document.documentElement.dataset;
    put("force-norm", Math.hypot(...frame.force), 3);
    ["force-x", "force-y", "force-z"].forEach((id, k) => put(id, frame.force[k]!, 3));
    put("depth", frame.grabbed ? 1000 * Math.max(frame.depth, 0) : NaN, 2);
    put("stiffness", frame.grabbed ? frame.stiffness : NaN, 0);
    element("trust").textContent = !frame.grabbed ? "–" : frame.inside ? "inside" : "outside";
    element("deviation").textContent = deviation(frame);
    record(frame); // one frame, whole
    data["depth"] = String(frame.depth);
    data["deviation"] = String(frame.deviation);
  }
}

/** Words that no line break parts. */
function whole(words: string): HTMLElement {
  const span = document.createElement("span");
  [span.className, span.textContent] = ["whole", words];
  return span;
}

/** How far the force may be off, in words. */
function deviation(frame: Press): string {
  if (!frame.grabbed) return "–";
  return Number.isNaN(frame.deviation) ? "not known" : `± ${share(frame.deviation)}`;
}
