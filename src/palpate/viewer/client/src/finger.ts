// The hand on a body that is pressed anywhere. Hold the mouse button, a finger or the space bar on the body: the probe
// goes in, to the depth that the wheel and the slider set; moving slides it over the surface. Sends at display rate while
// it presses, else every 50 ms.

import type { Connection } from "./connection";
import type { Press, Touched, Vec3 } from "./messages";
import type { PressView, Spot } from "./pressview";

const BEAT = 50; // ms between heartbeats
const SINK = 90; // ms, time constant with which the probe takes a new depth: a press and no blow
const ARRIVED = 1e-4; // of the deepest press: nearer than this is there
const NOTCH = 0.05; // of the deepest trained depth, a step of the wheel or a key
const STEP = 12; // px, a step of the arrow keys
const SMALL_STEP = 3;
const KEYS: Record<string, readonly [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};
const DEPTHS: Record<string, number> = { PageDown: 1, PageUp: -1, "+": 1, "-": -1 };

export class Finger {
  pressing = false;
  /** m, of the rigid probe in the surface at rest */
  wanted = 0;
  most = 0;
  radius = 0;
  parameters = new Float32Array();
  /** Hears of a depth that wheel or keys have set. */
  deepened: (depth: number) => void = () => {};

  private view: PressView | null = null;
  private hello: Touched | null = null;
  private pointer: number | null = null; // null while the space bar presses
  private at: [x: number, y: number] | null = null; // px, where the hand points
  private spot: Spot | null = null;
  private depth = 0;
  private force = NaN; // of a pen, 0 … 1
  private lastSent = 0;
  private lastTick = 0;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly connection: Connection<Touched, Press>,
  ) {
    // registered before the view's own handlers, so that a press can keep the view still
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("pointerleave", () => this.pointer === null && !this.pressing && this.hover(null));
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      canvas.addEventListener(kind, (e) => e.pointerId === this.pointer && this.release());
    }
    canvas.addEventListener("wheel", (e) => this.wheel(e), { passive: false });
    canvas.addEventListener("keydown", (e) => this.key(e));
    canvas.addEventListener("keyup", (e) => e.key === " " && this.pointer === null && this.release());
    canvas.addEventListener("blur", () => this.pointer === null && this.release());
    document.addEventListener("visibilitychange", () => {
      this.release();
      this.send();
    });
    setInterval(() => performance.now() - this.lastSent > 0.9 * BEAT && this.send(), BEAT);
  }

  attach(view: PressView, hello: Touched): void {
    this.release();
    [this.view, this.hello] = [view, hello];
  }

  /** Called for every picture: while pressing, the hand is told at display rate. */
  tick(): void {
    const now = performance.now();
    const elapsed = Math.min(now - this.lastTick, 100);
    this.lastTick = now;
    if (!this.pressing) return;
    const goal = Number.isNaN(this.force) ? this.wanted : this.force * this.most;
    this.depth += (goal - this.depth) * (1 - Math.exp(-elapsed / SINK));
    if (Math.abs(goal - this.depth) < ARRIVED * this.most) this.depth = goal;
    // for programs that drive the page: whether the probe is still on its way
    document.documentElement.dataset["sinking"] = String(this.depth !== goal);
    this.send();
  }

  release(): void {
    this.pointer = null;
    this.force = NaN;
    if (!this.pressing) return;
    this.pressing = false;
    document.documentElement.dataset["sinking"] = "false";
    this.canvas.dataset["cursor"] = "";
    if (this.view) this.view.turnable = true;
    this.send();
  }

  send(): void {
    this.lastSent = performance.now();
    this.connection.send({
      sent: this.lastSent,
      period: BEAT / 1000,
      target: this.target(),
      grabbed: this.pressing,
      hidden: document.hidden,
      parameters: this.parameters,
    });
  }

  /** The probe's centre in device coordinates: the body's z is the device's y. */
  private target(): Vec3 {
    const { hello, spot } = this;
    if (!hello || !spot) return [0, 0, 0];
    const lift = this.radius - this.depth;
    const [x, y, z] = [0, 1, 2].map((k) => (spot.point[k]! + lift * spot.normal[k]! - hello.centre[k]!) / hello.scale);
    const device: Vec3 = [x!, z!, -y!];
    const size = Math.hypot(...device);
    return size > hello.workspace ? (device.map((v) => (v * hello.workspace) / size) as Vec3) : device;
  }

  private down(e: PointerEvent): void {
    if (this.pressing) {
      if (e.pointerId !== this.pointer) this.release(); // a second finger turns and zooms
      return;
    }
    if (!this.view || e.button !== 0 || this.pointer !== null) return;
    const spot = this.view.spotAt(e.offsetX, e.offsetY);
    if (!spot?.touchable) return; // beside the touched surface the view turns
    this.pointer = e.pointerId;
    this.canvas.setPointerCapture(e.pointerId);
    this.at = [e.offsetX, e.offsetY];
    this.force = e.pointerType === "pen" && e.pressure > 0 ? e.pressure : NaN;
    this.press(spot);
  }

  private press(spot: Spot): void {
    [this.spot, this.depth, this.pressing] = [spot, 0, true];
    document.documentElement.dataset["sinking"] = "true";
    this.canvas.dataset["cursor"] = "grabbing";
    if (this.view) {
      this.view.turnable = false;
      this.view.point(null, this.radius);
    }
    this.send();
  }

  private move(e: PointerEvent): void {
    if (!this.view) return;
    if (e.pointerId === this.pointer) {
      this.slide(e.offsetX, e.offsetY);
      if (e.pointerType === "pen" && e.pressure > 0) this.force = e.pressure;
    } else if (e.pointerType !== "touch" && !this.pressing && e.buttons === 0) {
      const spot = this.view.spotAt(e.offsetX, e.offsetY);
      if (spot?.touchable) this.at = [e.offsetX, e.offsetY];
      this.hover(spot);
    }
  }

  /** Over the surface that may be touched; beside it the probe stays where it was. */
  private slide(x: number, y: number): void {
    const spot = this.view!.spotAt(x, y);
    if (!spot?.touchable) return;
    [this.at, this.spot] = [[x, y], spot];
  }

  private hover(spot: Spot | null): void {
    const on = spot?.touchable ? spot : null;
    this.canvas.dataset["cursor"] = on ? "grab" : "";
    this.view?.point(on, this.radius);
  }

  private wheel(e: WheelEvent): void {
    if (!this.pressing) return; // the wheel zooms
    e.preventDefault();
    this.deepen(e.deltaY > 0 ? 1 : -1);
  }

  private deepen(steps: number): void {
    if (!this.hello) return;
    const depth = this.wanted + steps * NOTCH * this.hello.deepest;
    this.wanted = Math.min(Math.max(depth, 0), this.most);
    this.deepened(this.wanted);
  }

  private key(e: KeyboardEvent): void {
    if (e.key === "Escape") this.release();
    if (!this.view || this.pointer !== null) return;
    const [step, deeper] = [KEYS[e.key], DEPTHS[e.key]];
    if (e.key !== " " && !step && deeper === undefined) return;
    e.preventDefault();
    if (deeper !== undefined) this.deepen(deeper);
    if (step) this.walk(step, e.shiftKey ? SMALL_STEP : STEP);
    if (e.key === " " && !e.repeat && !this.pressing) {
      const spot = this.view.spotAt(...this.pointed());
      if (spot?.touchable) this.press(spot);
    }
  }

  private walk([dx, dy]: readonly [number, number], size: number): void {
    const [x, y] = this.pointed();
    const [u, v] = [x + size * dx, y + size * dy];
    const spot = this.view!.spotAt(u, v);
    if (!spot?.touchable) return;
    if (this.pressing) this.spot = spot;
    else this.hover(spot);
    this.at = [u, v];
  }

  /** Where the keys begin: where the pointer last was on the body, else in the middle of the touched place. */
  private pointed(): [number, number] {
    if (!this.at || !this.view!.spotAt(...this.at)?.touchable) {
      const { x, y } = this.view!.middle(this.hello!.centre);
      this.at = [x, y];
    }
    return this.at;
  }
}
