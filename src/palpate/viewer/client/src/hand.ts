// The hand: mouse, finger or arrow keys hold the body's tip. Sends at display rate while holding, else every 50 ms.

import type { Connection } from "./connection";
import type { Frame, Hello, Vec3 } from "./messages";
import type { View } from "./scene";

const BEAT = 50; // ms between heartbeats
const NEAR_MOUSE = 26; // px around the tip that count as on it
const NEAR_FINGER = 44;
const KEYS: Record<string, readonly [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};
const STEP = 0.02; // of the reach per key press
const SMALL_STEP = 0.004;

export class HandInput {
  grabbed = false;
  /** m, where the hand wants the held node, as an offset from rest */
  wanted: Vec3 = [0, 0, 0];
  parameters = new Float32Array();

  private view: View | null = null;
  private pointer: number | null = null;
  private grip: Vec3 = [0, 0, 0]; // from the pointer to the node at the moment of grabbing
  private lastSent = 0;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly connection: Connection<Hello, Frame>,
  ) {
    // registered before the view's own handlers, so that a grab can keep the view still
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      canvas.addEventListener(kind, (e) => e.pointerId === this.pointer && this.release());
    }
    canvas.addEventListener("keydown", (e) => this.key(e));
    canvas.addEventListener("blur", () => this.pointer === null && this.release());
    document.addEventListener("visibilitychange", () => {
      this.release();
      this.send();
    });
    setInterval(() => performance.now() - this.lastSent > 0.9 * BEAT && this.send(), BEAT);
  }

  attach(view: View): void {
    this.release();
    this.view = view;
  }

  /** Called for every picture: while holding, the hand is told at display rate. */
  tick(): void {
    if (this.grabbed) this.send();
  }

  release(): void {
    this.pointer = null;
    if (!this.grabbed) return;
    this.grabbed = false;
    this.canvas.dataset["cursor"] = "";
    if (this.view) {
      this.view.turnable = true;
      this.view.highlight(false);
    }
    this.send();
  }

  send(): void {
    this.lastSent = performance.now();
    const scale = this.view?.hello.scale ?? 1;
    this.connection.send({
      sent: this.lastSent,
      period: BEAT / 1000,
      target: this.wanted.map((x) => x / scale) as Vec3,
      grabbed: this.grabbed,
      hidden: document.hidden,
      parameters: this.parameters,
    });
  }

  private near(e: PointerEvent): boolean {
    if (!this.view) return false;
    const tip = this.view.project(this.view.tip);
    const limit = e.pointerType === "touch" ? NEAR_FINGER : NEAR_MOUSE;
    return Math.hypot(tip.x - e.offsetX, tip.y - e.offsetY) < limit;
  }

  private down(e: PointerEvent): void {
    if (!this.view || e.button !== 0 || this.pointer !== null || !this.near(e)) return;
    const at = this.view.offsetAt(e.offsetX, e.offsetY);
    if (!at) return;
    const tip = this.tip();
    this.grip = [tip[0] - at[0], tip[1] - at[1], 0];
    this.pointer = e.pointerId;
    this.canvas.setPointerCapture(e.pointerId);
    this.canvas.dataset["cursor"] = "grabbing";
    this.grab(tip);
  }

  private move(e: PointerEvent): void {
    if (!this.view) return;
    if (e.pointerId !== this.pointer) {
      if (e.pointerType === "mouse" && !this.grabbed) this.hover(this.near(e));
      return;
    }
    const at = this.view.offsetAt(e.offsetX, e.offsetY);
    if (at) this.want([at[0] + this.grip[0], at[1] + this.grip[1], 0]);
  }

  private hover(near: boolean): void {
    this.canvas.dataset["cursor"] = near ? "grab" : "";
    this.view?.highlight(near);
  }

  private key(e: KeyboardEvent): void {
    if (e.key === "Escape") this.release();
    const step = KEYS[e.key];
    if (!step || !this.view || this.pointer !== null) return;
    e.preventDefault();
    if (!this.grabbed) this.grab(this.tip());
    const size = (e.shiftKey ? SMALL_STEP : STEP) * this.view.hello.reach;
    this.want([this.wanted[0] + size * step[0], this.wanted[1] + size * step[1], 0]);
  }

  private grab(at: Vec3): void {
    this.want(at);
    this.grabbed = true;
    if (this.view) {
      this.view.turnable = false;
      this.view.highlight(true);
    }
    this.send();
  }

  /** The hand stays inside its workspace. */
  private want(offset: Vec3): void {
    const hello = this.view!.hello;
    const limit = hello.workspace * hello.scale;
    const size = Math.hypot(...offset);
    this.wanted = size > limit ? (offset.map((x) => (x * limit) / size) as Vec3) : offset;
  }

  /** Offset (m) at which the held node is drawn now. */
  private tip(): Vec3 {
    const view = this.view!;
    const rest = view.hello.rest[view.hello.touch_node]!;
    return [0, 1, 2].map((k) => (view.tip.getComponent(k) - rest[k]!) / view.enlarged) as Vec3;
  }
}
