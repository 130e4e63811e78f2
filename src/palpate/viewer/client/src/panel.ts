// The side panel of a held body: numbers, flags, plots, sliders, and what is known of the model.

import { about } from "./about";
import { flags } from "./flags";
import type { Frame, Hello } from "./messages";
import { Plot } from "./plot";
import { element, EVERY, Flags, follow, put, record, sliders, Timing, trained } from "./readings";
import { metres, round125 } from "./units";

const PLACES = {
  free: "Nobody holds the body. Drag the ball at its tip.",
  inside: "Within what the network was trained on.",
  outside: "Outside the trained range: the force is the one at its edge.",
};

export class Panel {
  private readonly force = new Plot(element<HTMLCanvasElement>("force-plot"), "--accent");
  private readonly timing = new Timing();
  private readonly flags = new Flags();
  private hello: Hello | null = null;
  private last = 0;

  recolour(): void {
    this.force.recolour();
    this.timing.recolour();
    this.last = 0;
  }

  /** Another body, or the same after a restart. `moved` hears of slider i at a value. */
  start(hello: Hello, moved: (i: number, value: number) => void): void {
    this.hello = hello;
    element("model-name").textContent = hello.name;
    element("model-line").replaceChildren("trained on ", ...hello.inputs.flatMap(trained));
    document.title = `${hello.name} · palpate`;
    sliders(hello.parameters, moved);
    about(hello, [
      ["reach of the tip", metres(hello.reach, hello.reach)],
      ["nodes", String(hello.rest.length)],
    ]);
  }

  /** Record every frame; now and then show it. */
  update(frame: Frame, drawn: boolean): void {
    const hello = this.hello;
    if (!hello) return;
    this.force.add(frame.time, Math.hypot(...frame.force));
    this.timing.add(frame, drawn);
    const now = performance.now();
    if (now - this.last < EVERY) return;
    this.last = now;
    this.numbers(frame);
    this.timing.show(frame, now);
    this.flags.tell(flags(frame, hello, PLACES));
    follow(frame);
    const peak = round125(Math.max(this.force.peak(frame.time), 0.1));
    this.force.draw(frame.time, { unit: "N", low: 0, high: peak, logarithmic: false, stepped: false });
  }

  /** The tab went to the background. */
  hidden(): void {
    this.flags.hidden();
  }

  /** Nothing is known any more. */
  lost(): void {
    for (const id of ["force-norm", "force-x", "force-y", "tip-x", "tip-y", "tip-norm", "rate", "picture-rate"]) {
      put(id, NaN, 0);
    }
    delete document.documentElement.dataset["tick"];
    this.flags.lost();
  }

  private numbers(frame: Frame): void {
    const [fx, fy] = frame.force;
    put("force-norm", Math.hypot(...frame.force), 3);
    put("force-x", fx, 3);
    put("force-y", fy, 3);
    const mm = frame.contact.map((x) => 1000 * x);
    put("tip-x", mm[0]!, 1);
    put("tip-y", mm[1]!, 1);
    put("tip-norm", Math.hypot(...mm), 1);
    record(frame); // one frame, whole
    document.documentElement.dataset["contact"] = frame.contact.join(" ");
  }
}
