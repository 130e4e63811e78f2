// The curve of force over depth at the place that was pressed last, with the probe's present depth on it.

import type { Evaluator } from "./evaluator";
import { TRUSTED } from "./evaluator";
import type { Frame, Hello, Vec3 } from "./messages";
import { Sheet } from "./plot";
import { css, element, tidy } from "./units";

const POINTS = 48;
const EVERY = 100; // ms
const STEP = 1e-5; // m
const BEYOND = 1.25; // of the deepest trained depth
const MARGIN = { left: 56, right: 8, top: 8, bottom: 22 }; // px

export class DepthCurve {
  private readonly sheet = new Sheet(element<HTMLCanvasElement>("curve-plot"));
  private drawnAt = 0;
  private colours: Record<"soft" | "accent" | "ink", string> | null = null; // of the theme

  constructor(
    private readonly hello: Hello,
    private readonly evaluator: Evaluator,
  ) {
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (this.colours = null));
  }

  /** Follow a picture; the curve is drawn anew ten times a second at most. */
  update(frame: Frame): void {
    const now = performance.now();
    if (!frame.grabbed || now - this.drawnAt < EVERY) return;
    this.drawnAt = now;
    this.draw(frame);
  }

  private draw(frame: Frame): void {
    const { hello, evaluator } = this;
    const outward = this.outward(frame);
    if (!outward) return;
    const most = BEYOND * hello.deepest;
    const points = Array.from({ length: POINTS + 1 }, (_, i) => {
      const depth = (most * i) / POINTS;
      const centre = frame.position.map((v, k) => v + (frame.depth - depth) * outward[k]!) as Vec3;
      const { force, flags } = evaluator.answer(centre, frame.parameters);
      return { depth, force: Math.hypot(...force), known: (flags & TRUSTED) !== 0 };
    });
    const high = Math.max(...points.map((p) => p.force), Math.hypot(...frame.force), 1e-12);
    const pen = this.sheet.clear();
    if (!pen) return;
    const { width, height } = this.sheet;
    const { soft, accent, ink } = (this.colours ??= { soft: css("--soft"), accent: css("--accent"), ink: css("--ink") });
    const x = (depth: number): number => MARGIN.left + (depth / most) * (width - MARGIN.left - MARGIN.right);
    const y = (force: number): number => height - MARGIN.bottom - (force / high) * (height - MARGIN.top - MARGIN.bottom);
    pen.fillStyle = soft;
    pen.textAlign = "right";
    pen.fillText(`${tidy(high)} N`, MARGIN.left - 4, y(high) + 8);
    pen.fillText("0", MARGIN.left - 4, y(0));
    pen.fillText(`${tidy(1000 * most)} mm ${hello.holds ? "moved" : "deep"}`, width - MARGIN.right, height - 6);
    for (const known of [false, true]) {
      pen.strokeStyle = known ? accent : soft;
      pen.lineWidth = known ? 2 : 1;
      pen.setLineDash(known ? [] : [4, 3]);
      pen.beginPath();
      let on = false;
      for (const p of points) {
        if (known && !p.known) {
          on = false;
          continue;
        }
        if (on) pen.lineTo(x(p.depth), y(p.force));
        else pen.moveTo(x(p.depth), y(p.force));
        on = true;
      }
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.fillStyle = ink;
    pen.beginPath();
    pen.arc(x(Math.min(Math.max(frame.depth, 0), most)), y(Math.hypot(...frame.force)), 4, 0, 2 * Math.PI);
    pen.fill();
  }

  /** The way out of the body: along it the depth falls fastest. */
  private outward(frame: Frame): Vec3 | null {
    if (Math.hypot(...frame.normal) > 0) return frame.normal;
    const way = [0, 1, 2].map((axis) => {
      const [one, other] = [-STEP, STEP].map((step) => {
        const place = frame.position.map((v, k) => v + (k === axis ? step : 0)) as Vec3;
        return this.evaluator.answer(place, frame.parameters).depth;
      });
      return one! - other!;
    });
    const size = Math.hypot(...way);
    return size > 0 ? (way.map((v) => v / size) as Vec3) : null;
  }
}
