// The hand: what every kind of body has of it, and the one that takes hold of a node or a pad and pulls. Sends at display
// rate while it holds, else every 50 ms.

import type { Vector2, Vector3 } from "three";
import type { Link } from "./connection";
import type { Pad } from "./gamepad";
import { use } from "./hand_words";
import type { Hello, Vec3 } from "./messages";

const BEAT = 50; // ms between heartbeats
const PROMISE = 0.1; // s, the longest time between two: on a machine that is busy one may be late, and nobody is pushed
const NEAR_MOUSE = 26; // px around what is held that count as on it
const NEAR_FINGER = 44;
const KEYS: Record<string, readonly [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};
const STEP = 0.02; // of the deepest trained displacement, per key press
const SMALL_STEP = 0.004;

export abstract class Hand {
  grabbed = false;
  parameters: Float32Array = new Float32Array();

  protected pointer: number | null = null;
  protected padded = false; // the gamepad holds
  private lastSent = 0;

  constructor(
    protected readonly canvas: HTMLCanvasElement,
    private readonly connection: Link,
    protected readonly hello: Hello,
  ) {
    setInterval(() => performance.now() - this.lastSent > 0.9 * BEAT && this.send(), BEAT);
    if (hello.device) return; // a device holds the hand
    // registered before the view's own handlers, so that a grab can keep the view still
    canvas.addEventListener("pointerdown", (e) => {
      use(e.pointerType);
      this.down(e);
    });
    canvas.addEventListener("pointermove", (e) => this.move(e));
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      canvas.addEventListener(kind, (e) => e.pointerId === this.pointer && this.release());
    }
    canvas.addEventListener("keydown", (e) => {
      if (e.key === "Escape") this.release();
      this.turned(e);
      if (this.pointer === null) this.key(e);
    });
    canvas.addEventListener("blur", () => this.pointer === null && !this.padded && this.release());
    document.addEventListener("visibilitychange", () => {
      this.release();
      this.send();
    });
  }

  /** True while a gamepad holds the body. */
  get byPad(): boolean {
    return this.padded && this.grabbed;
  }

  /** Follow a gamepad (null: there is none), `elapsed` ms after the picture before. */
  drive(pad: Pad | null, elapsed: number): void {
    if (this.hello.device || this.pointer !== null || (this.grabbed && !this.padded)) return;
    if (pad && (pad.hold || pad.trigger)) use("gamepad");
    if (pad) this.follow(pad, elapsed);
    else if (this.padded) this.release();
  }

  /** Where the hand wants what it holds, or the probe's centre, m from the device's centre in the body's axes. */
  protected abstract wish(): Vec3;
  protected abstract down(e: PointerEvent): void;
  protected abstract move(e: PointerEvent): void;
  protected abstract key(e: KeyboardEvent): void;
  protected abstract follow(pad: Pad, elapsed: number): void;
  /** Hear a key that turns what presses, which works while a mouse or finger holds, too. */
  protected turned(_: KeyboardEvent): void {
    // most hands turn nothing
  }
  /** Let the view follow: the hand takes hold or lets go. */
  protected abstract held(on: boolean): void;

  /** Called for every picture: while holding, the hand's place is sent at display rate. */
  tick(): void {
    if (this.grabbed) this.send();
  }

  release(): void {
    this.pointer = null;
    this.padded = false;
    if (!this.grabbed) return;
    this.grabbed = false;
    this.canvas.dataset["cursor"] = "";
    this.held(false);
    this.send();
  }

  send(): void {
    this.lastSent = performance.now();
    const { hello } = this;
    const [x, y, z] = this.wish().map((v) => v / hello.scale) as Vec3;
    // devices have y up and z towards the user, as a line has; a solid's z is the device's y
    const device: Vec3 = hello.line ? [x, y, z] : [x, z, -y];
    const size = Math.hypot(...device);
    this.connection.send({
      sent: this.lastSent,
      period: PROMISE,
      target: size > hello.workspace ? (device.map((v) => (v * hello.workspace) / size) as Vec3) : device,
      grabbed: this.grabbed,
      hidden: document.hidden,
      parameters: this.parameters,
    });
  }

  protected capture(e: PointerEvent): void {
    this.pointer = e.pointerId;
    this.canvas.setPointerCapture(e.pointerId);
  }

  protected grab(): void {
    this.grabbed = true;
    this.held(true);
    this.send();
  }
}

/** A view as a hand that takes hold sees it. */
export interface Handle {
  readonly grip: Vector3;
  turnable: boolean;
  project(point: Vector3): Vector2;
  offsetAt(x: number, y: number): Vec3 | null;
  offset(): Vec3;
  highlight(on: boolean): void;
}

export class PullHand extends Hand {
  protected view: Handle | null = null;
  private wanted: Vec3 = [0, 0, 0]; // m, of what is held, from rest
  private gap: Vec3 = [0, 0, 0]; // from the pointer to what is held at the moment of grabbing
  private taken: Vec3 = [0, 0, 0]; // where the gamepad took hold

  attach(view: Handle): void {
    this.release();
    this.view = view;
  }

  protected override wish(): Vec3 {
    return this.wanted;
  }

  protected override held(on: boolean): void {
    if (!this.view) return;
    this.view.turnable = !on;
    this.view.highlight(on);
  }

  protected override down(e: PointerEvent): void {
    if (!this.view || e.button !== 0 || this.pointer !== null || !this.near(e)) return;
    const at = this.view.offsetAt(e.offsetX, e.offsetY);
    if (!at) return;
    this.wanted = this.view.offset();
    this.gap = this.wanted.map((v, k) => v - at[k]!) as Vec3;
    this.capture(e);
    this.canvas.dataset["cursor"] = "grabbing";
    this.grab();
  }

  protected override move(e: PointerEvent): void {
    if (!this.view) return;
    if (e.pointerId === this.pointer) {
      const at = this.view.offsetAt(e.offsetX, e.offsetY);
      if (at) this.want(at.map((v, k) => v + this.gap[k]!) as Vec3);
    } else if (e.pointerType === "mouse" && !this.grabbed) {
      const near = this.near(e);
      this.canvas.dataset["cursor"] = near ? "grab" : "";
      this.view.highlight(near);
    }
  }

  /** Arrow keys pull along x, and upwards. */
  protected override key(e: KeyboardEvent): void {
    const step = KEYS[e.key];
    if (!step || !this.view) return;
    e.preventDefault();
    if (!this.grabbed) {
      this.wanted = this.view.offset();
      this.grab();
    }
    const size = (e.shiftKey ? SMALL_STEP : STEP) * this.reach;
    const [right, up] = step.map((s) => size * s) as [number, number];
    const [x, y, z] = this.wanted;
    this.want(this.hello.line ? [x + right, y + up, z] : [x + right, y, z + up]);
  }

  /** The trigger or the first button holds; the left stick pulls along x and upwards, the right one away and back. */
  protected override follow(pad: Pad): void {
    if (!pad.hold && !pad.trigger) {
      if (this.padded) this.release();
      return;
    }
    if (!this.view) return;
    if (!this.grabbed) {
      this.taken = this.wanted = this.view.offset();
      this.padded = true;
      this.grab();
    }
    const { reach } = this;
    const [x, y, z] = this.taken;
    const [[right, up], [, away]] = [pad.left, pad.right].map(([a, b]) => [reach * a, reach * b] as const) as [
      readonly [number, number],
      readonly [number, number],
    ];
    this.want(this.hello.line ? [x + right, y + up, z] : [x + right, y + away, z + up]);
  }

  /** How far a gamepad's stick pulls, m. */
  protected get reach(): number {
    return this.hello.deepest;
  }

  protected near(e: PointerEvent): boolean {
    const at = this.view!.project(this.view!.grip);
    const limit = e.pointerType === "touch" ? NEAR_FINGER : NEAR_MOUSE;
    return Math.hypot(at.x - e.offsetX, at.y - e.offsetY) < limit;
  }

  /** The hand stays inside its workspace. */
  private want(offset: Vec3): void {
    const limit = this.hello.workspace * this.hello.scale;
    const size = Math.hypot(...offset);
    this.wanted = size > limit ? (offset.map((x) => (x * limit) / size) as Vec3) : offset;
  }
}
