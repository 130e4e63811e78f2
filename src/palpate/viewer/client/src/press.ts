// The hand that presses. Hold the mouse button, a finger or the space bar on the body: the probe goes in, to the depth
// that the wheel and the slider set; moving slides it over the surface.

import type { Link } from "./connection";
import type { Pad } from "./gamepad";
import { Hand } from "./hand";
import type { Hello, Vec3 } from "./messages";
import type { ToolShape } from "./tool_shape";
import type { PressView, Spot } from "./touch_view";
import { Turning } from "./turning";

const SINK = 90; // ms, time constant with which the probe takes a new depth: a press and no blow
const ARRIVED = 1e-4; // of the deepest press: nearer than this is there
const NOTCH = 0.05; // of the deepest trained depth, a step of the wheel or a key
const STEP = 12; // px, a step of the arrow keys
const SMALL_STEP = 3;
const SPEED = 0.22; // px per ms, of a stick that is pushed all the way
const KEYS: Record<string, readonly [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};
const DEPTHS: Record<string, number> = { PageDown: 1, PageUp: -1, "+": 1, "-": -1 };

export class PressHand extends Hand {
  /** m, of the rigid probe in the surface at rest */
  wanted = 0;
  most = 0;
  /** Further inputs of the latest picture. */
  inForce: Float32Array = new Float32Array();
  /** Hears of a depth that wheel or keys have set. */
  deepened: (depth: number) => void = () => {};

  private view: PressView | null = null;
  private at: [x: number, y: number] | null = null; // px, where the hand points
  private spot: Spot | null = null;
  private depth = 0;
  private force = NaN; // of a pen or a trigger, 0 … 1
  private second: { id: number; x: number; y: number } | null = null; // finger that turns the tool
  private readonly turning: Turning;
  private lastTick = 0;

  constructor(
    canvas: HTMLCanvasElement,
    connection: Link,
    hello: Hello,
    private readonly shape: ToolShape,
  ) {
    super(canvas, connection, hello);
    this.turning = new Turning(hello);
    if (hello.device) return; // a device holds the hand
    canvas.addEventListener("pointerleave", () => this.pointer === null && !this.grabbed && this.hover(null));
    canvas.addEventListener("wheel", (e) => this.wheel(e), { passive: false });
    for (const kind of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(kind, (e) => e.pointerId === this.second?.id && (this.second = null));
    }
    canvas.addEventListener("keyup", (e) => e.key === " " && this.pointer === null && this.release());
  }

  attach(view: PressView): void {
    this.release();
    this.view = view;
  }

  /** Go on in another view of the same body; what is pressed stays pressed. */
  change(view: PressView): void {
    this.view = view;
    view.turnable = !this.grabbed;
  }

  /** The probe sinks to its depth, picture by picture. */
  override tick(): void {
    const now = performance.now();
    const elapsed = Math.min(now - this.lastTick, 100);
    this.lastTick = now;
    if (this.grabbed) {
      const goal = Number.isNaN(this.force) ? this.wanted : this.force * this.most;
      this.depth += (goal - this.depth) * (1 - Math.exp(-elapsed / SINK));
      if (Math.abs(goal - this.depth) < ARRIVED * this.most) this.depth = goal;
      // for programs that drive the page: whether the probe is still on its way
      document.documentElement.dataset["sinking"] = String(this.depth !== goal);
    }
    super.tick();
  }

  override release(): void {
    this.second = null;
    this.force = NaN;
    super.release();
  }

  protected override held(on: boolean): void {
    document.documentElement.dataset["sinking"] = String(on);
    if (!this.view) return;
    this.view.turnable = !on;
    if (on) this.view.point(null, this.shape);
  }

  /** The ball's centre, or the tool's place. */
  protected override wish(): Vec3 {
    const { hello, spot } = this;
    if (!spot) return [0, 0, 0];
    const lift = this.shape.lift(spot.normal) - this.depth;
    return [0, 1, 2].map((k) => spot.point[k]! + lift * spot.normal[k]! - hello.centre[k]!) as Vec3;
  }

  protected override down(e: PointerEvent): void {
    if (this.grabbed) {
      if (e.pointerId === this.pointer || this.second) return;
      if (this.turning.possible && this.pointer !== null) this.second = { id: e.pointerId, x: e.offsetX, y: e.offsetY };
      else this.release(); // a second finger turns the view and zooms
      return;
    }
    if (!this.view || e.button !== 0 || this.pointer !== null) return;
    const spot = this.view.spotAt(e.offsetX, e.offsetY);
    if (!spot?.touchable) return; // beside the touched surface the view turns
    this.capture(e);
    this.at = [e.offsetX, e.offsetY];
    this.force = e.pointerType === "pen" && e.pressure > 0 ? e.pressure : NaN;
    this.press(spot);
  }

  protected override move(e: PointerEvent): void {
    if (!this.view) return;
    if (this.second?.id === e.pointerId) {
      this.turn(this.turning.byFinger(e.offsetX - this.second.x, e.offsetY - this.second.y, this.now));
      [this.second.x, this.second.y] = [e.offsetX, e.offsetY];
    } else if (e.pointerId === this.pointer) {
      this.slide(e.offsetX, e.offsetY);
      if (e.pointerType === "pen" && e.pressure > 0) this.force = e.pressure;
    } else if (e.pointerType !== "touch" && !this.grabbed && e.buttons === 0) {
      const spot = this.view.spotAt(e.offsetX, e.offsetY);
      if (spot?.touchable) this.at = [e.offsetX, e.offsetY];
      this.hover(spot);
    }
  }

  protected override turned(e: KeyboardEvent): void {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const parameters = this.turning.byKey(e.key, e.shiftKey, this.now);
    if (parameters) this.turn(parameters);
  }

  protected override key(e: KeyboardEvent): void {
    if (!this.view) return;
    const [step, deeper] = [KEYS[e.key], DEPTHS[e.key]];
    if (e.key !== " " && !step && deeper === undefined) return;
    e.preventDefault();
    if (deeper !== undefined) this.deepen(deeper);
    if (step) this.walk(step, e.shiftKey ? SMALL_STEP : STEP);
    if (e.key === " " && !e.repeat && !this.grabbed) {
      const spot = this.view.spotAt(...this.pointed());
      if (spot?.touchable) this.press(spot);
    }
  }

  /** The left stick moves the probe; the trigger presses as far as it is pulled, the first button as deep as the slider says. */
  protected override follow(pad: Pad, elapsed: number): void {
    if (!this.view) return;
    const [right, up] = pad.left;
    if (right !== 0 || up !== 0) this.walk([right, -up], SPEED * elapsed);
    if (this.turning.possible && pad.right.some((way) => way !== 0)) this.turn(this.turning.byStick(pad.right, elapsed, this.now));
    if (!pad.hold && !pad.trigger) {
      if (this.padded) this.release();
      return;
    }
    if (!this.grabbed) {
      const spot = this.view.spotAt(...this.pointed());
      if (!spot?.touchable) return;
      this.padded = true;
      this.press(spot);
    }
    this.force = pad.hold ? NaN : pad.trigger;
  }

  /** The further inputs that are wanted, or else those in force. */
  private get now(): Float32Array {
    return this.parameters.length ? this.parameters : this.inForce;
  }

  private turn(parameters: Float32Array): void {
    this.parameters = parameters;
    this.shape.follow(parameters);
    this.send();
  }

  private press(spot: Spot): void {
    [this.spot, this.depth] = [spot, 0];
    this.canvas.dataset["cursor"] = "grabbing";
    this.grab();
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
    this.view?.point(on, this.shape);
  }

  private wheel(e: WheelEvent): void {
    if (!this.grabbed) return; // the wheel zooms
    e.preventDefault();
    this.deepen(e.deltaY > 0 ? 1 : -1);
  }

  private deepen(steps: number): void {
    const depth = this.wanted + steps * NOTCH * this.hello.deepest;
    this.wanted = Math.min(Math.max(depth, 0), this.most);
    this.deepened(this.wanted);
  }

  private walk([dx, dy]: readonly [number, number], size: number): void {
    const [x, y] = this.pointed();
    const [u, v] = [x + size * dx, y + size * dy];
    const spot = this.view!.spotAt(u, v);
    if (!spot?.touchable) return;
    if (this.grabbed) this.spot = spot;
    else this.hover(spot);
    this.at = [u, v];
  }

  /** Where the keys begin: where the pointer last was on the body, else in the middle of the touched place. */
  private pointed(): [number, number] {
    if (!this.at || !this.view!.spotAt(...this.at)?.touchable) {
      const { x, y } = this.view!.middle(this.hello.centre);
      this.at = [x, y];
    }
    return this.at;
  }
}
