// The hand that moves two jaws: drag them, or the ball between them; wheel and keys close and open them.

import type { Link } from "./connection";
import { PullHand } from "./hand";
import type { Hello } from "./messages";
import type { PinchView } from "./pinch_view";
import type { ToolShape } from "./tool_shape";

const STEP = 0.025; // of the trained openings, a notch of the wheel or a key
const SMALL_STEP = 0.005;
const CLOSING: Record<string, number> = { PageDown: 1, PageUp: -1, "+": 1, "-": -1 };

export class PinchHand extends PullHand {
  /** Further inputs of the latest picture. */
  inForce: Float32Array = new Float32Array();

  constructor(
    canvas: HTMLCanvasElement,
    connection: Link,
    hello: Hello,
    private readonly shape: ToolShape,
  ) {
    super(canvas, connection, hello);
    if (hello.device) return; // a device holds the hand
    canvas.addEventListener(
      "wheel",
      (e) => {
        if (!this.grabbed) return; // the wheel zooms
        e.preventDefault();
        this.close(e.deltaY > 0 ? STEP : -STEP);
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
    this.close(way * (e.shiftKey && e.key !== "+" ? SMALL_STEP : STEP));
  }

  protected override near(e: PointerEvent): boolean {
    return super.near(e) || (this.view as PinchView).meets(e.offsetX, e.offsetY);
  }

  /** Close the jaws by a share of the trained openings. */
  private close(share: number): void {
    const i = this.shape.tool!.opening;
    const { low, high } = this.hello.parameters[i]!;
    const parameters = Float32Array.from(this.parameters.length ? this.parameters : this.inForce);
    parameters[i] = Math.min(Math.max(parameters[i]! - share * (high - low), low), high);
    this.parameters = parameters;
    this.shape.follow(parameters);
    this.send();
  }
}
