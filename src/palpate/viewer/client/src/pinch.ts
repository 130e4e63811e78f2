// The hand that moves two jaws: drag them, or the ball between them; wheel, keys, two fingers and a gamepad's trigger close and open
// them. A device moves them, and keys close them.

import type { Link } from "./connection";
import { PullHand } from "./hand";
import type { Pad } from "./gamepad";
import type { Hello } from "./messages";
import type { PinchView } from "./pinch_view";
import type { ToolShape } from "./tool_shape";

const STEP = 0.025; // of the trained openings, a notch of the wheel or a key
const SMALL_STEP = 0.005;
const SPAN = 200; // px by which two fingers come closer to close the jaws from their widest to their narrowest
const CLOSING: Record<string, number> = { PageDown: 1, PageUp: -1, "+": 1, "-": -1 };

/** Two fingers on the canvas: the second one's number, both places, and what they began with. */
interface Fingers {
  id: number;
  places: Map<number, readonly [number, number]>;
  apart: number;
  share: number;
}

export class PinchHand extends PullHand {
  /** Further inputs of the latest picture. */
  inForce: Float32Array = new Float32Array();
  private first: readonly [number, number] = [0, 0]; // the finger that holds
  private fingers: Fingers | null = null;

  constructor(
    canvas: HTMLCanvasElement,
    connection: Link,
    hello: Hello,
    private readonly shape: ToolShape,
  ) {
    super(canvas, connection, hello);
    if (hello.device) {
      canvas.addEventListener("keydown", (e) => this.turned(e));
      return;
    }
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      canvas.addEventListener(kind, (e) => e.pointerId === this.fingers?.id && (this.fingers = null));
    }
    canvas.addEventListener(
      "wheel",
      (e) => {
        if (!this.grabbed) return; // the wheel zooms
        e.preventDefault();
        this.close(this.share + (e.deltaY > 0 ? STEP : -STEP));
      },
      { passive: false },
    );
  }

  protected override get reach(): number {
    return this.hello.workspace * this.hello.scale;
  }

  protected override turned(e: KeyboardEvent): void {
    const way = CLOSING[e.key];
    if (way === undefined || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    this.close(this.share + way * (e.shiftKey && e.key !== "+" ? SMALL_STEP : STEP));
  }

  protected override down(e: PointerEvent): void {
    const holding = this.pointer;
    if (holding === null || e.pointerType !== "touch" || this.fingers) {
      this.first = [e.offsetX, e.offsetY];
      super.down(e);
      return;
    }
    const places = new Map([
      [holding, this.first],
      [e.pointerId, [e.offsetX, e.offsetY] as const],
    ]);
    this.fingers = { id: e.pointerId, places, apart: distance(places), share: this.share };
    this.canvas.setPointerCapture(e.pointerId);
  }

  protected override move(e: PointerEvent): void {
    super.move(e);
    if (e.pointerId === this.pointer) this.first = [e.offsetX, e.offsetY];
    const { fingers } = this;
    if (!fingers?.places.has(e.pointerId)) return;
    fingers.places.set(e.pointerId, [e.offsetX, e.offsetY]);
    this.close(fingers.share + (fingers.apart - distance(fingers.places)) / SPAN);
  }

  override release(): void {
    this.fingers = null;
    super.release();
  }

  /** The trigger closes the jaws as far as it is pulled; where the first button holds alone they stay as they are. */
  protected override follow(pad: Pad): void {
    super.follow(pad);
    if (this.byPad && pad.trigger) this.close(pad.trigger);
  }

  protected override near(e: PointerEvent): boolean {
    return super.near(e) || (this.view as PinchView).meets(e.offsetX, e.offsetY);
  }

  /** The further inputs that are wanted, or else those in force. */
  private get now(): Float32Array {
    return this.parameters.length ? this.parameters : this.inForce;
  }

  /** How far the jaws are closed: 0 at the widest of the trained openings, 1 at the narrowest. */
  private get share(): number {
    const i = this.shape.tool!.opening;
    const { low, high } = this.hello.parameters[i]!;
    return (high - (this.now[i] ?? high)) / (high - low);
  }

  /** Close the jaws to a share of the trained openings, and not beyond these. */
  private close(share: number): void {
    const i = this.shape.tool!.opening;
    const { low, high } = this.hello.parameters[i]!;
    const parameters = Float32Array.from(this.now);
    parameters[i] = Math.min(Math.max(high - share * (high - low), low), high);
    this.parameters = parameters;
    this.shape.follow(parameters);
    this.send();
  }
}

/** How far apart two fingers are, px. */
function distance(places: Map<number, readonly [number, number]>): number {
  const [a, b] = [...places.values()] as [readonly [number, number], readonly [number, number]];
  return Math.hypot(a[0] - b[0], a[1] - b[1]);
}
