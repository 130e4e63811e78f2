// A curve with axes and a band around it, on a canvas.

import { Sheet } from "./plot";
import { css, tidy } from "./units";

export interface Graph {
  x: readonly number[];
  y: readonly number[];
  half: readonly number[]; // half width of the band; not-a-number for none
  across: string; // names of the axes, with their units
  along: string;
  mark: number | null; // place on the axis that is marked
}

const [LEFT, RIGHT, TOP, BOTTOM] = [58, 10, 24, 40]; // px around the curve
const LEVELS = 4; // intervals of an axis, about

export class GraphSheet {
  private readonly sheet: Sheet;
  private graph: Graph | null = null;

  constructor(canvas: HTMLCanvasElement) {
    this.sheet = new Sheet(canvas);
    new ResizeObserver(() => requestAnimationFrame(() => this.draw())).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  show(graph: Graph): void {
    this.graph = graph;
    this.draw();
  }

  private draw(): void {
    const pen = this.graph && this.sheet.clear();
    if (!pen || !this.graph) return;
    const { x, y, half, across, along, mark } = this.graph;
    const { width, height } = this.sheet;
    const banded = half.every((h) => Number.isFinite(h));
    const [low, high] = ends(banded ? y.flatMap((v, i) => [v - half[i]!, v + half[i]!]) : [...y]);
    const [first, last] = [x[0]!, x.at(-1)!];
    const px = (v: number): number => LEFT + ((v - first) / (last - first || 1)) * (width - LEFT - RIGHT);
    const py = (v: number): number => height - BOTTOM - ((v - low) / (high - low)) * (height - TOP - BOTTOM);
    const [soft, line] = [css("--soft"), css("--line")];
    pen.lineWidth = 1;
    pen.fillStyle = soft;
    pen.strokeStyle = line;
    [pen.textAlign, pen.textBaseline] = ["right", "middle"];
    for (const v of ticks(low, high)) {
      stroke(pen, [[LEFT, py(v)], [width - RIGHT, py(v)]]);
      pen.fillText(tidy(v), LEFT - 6, py(v));
    }
    [pen.textAlign, pen.textBaseline] = ["center", "top"];
    for (const v of ticks(first, last)) {
      stroke(pen, [[px(v), height - BOTTOM], [px(v), height - BOTTOM + 4]]);
      pen.fillText(tidy(v), Math.min(px(v), width - 1 - pen.measureText(tidy(v)).width / 2), height - BOTTOM + 7);
    }
    pen.textAlign = "right";
    pen.fillText(across, width - RIGHT, height - 14);
    pen.textAlign = "left";
    pen.fillText(along, 4, 4);
    if (banded) {
      pen.beginPath();
      x.forEach((v, i) => pen.lineTo(px(v), py(y[i]! + half[i]!)));
      for (let i = x.length - 1; i >= 0; i--) pen.lineTo(px(x[i]!), py(y[i]! - half[i]!));
      pen.globalAlpha = 0.2;
      pen.fillStyle = css("--accent-2");
      pen.fill();
      pen.globalAlpha = 1;
    }
    if (mark !== null) {
      pen.setLineDash([3, 3]);
      pen.strokeStyle = soft;
      stroke(pen, [[px(mark), TOP], [px(mark), height - BOTTOM]]);
      pen.setLineDash([]);
    }
    pen.strokeStyle = css("--accent-2");
    pen.lineWidth = 1.8;
    stroke(pen, x.map((v, i) => [px(v), py(y[i]!)]));
  }
}

function stroke(pen: CanvasRenderingContext2D, points: readonly (readonly number[])[]): void {
  pen.beginPath();
  for (const [x, y] of points) pen.lineTo(x!, y!);
  pen.stroke();
}

/** Ends of an axis that holds all values, with some room. */
function ends(values: number[]): [low: number, high: number] {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const room = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
  return [low - room, high + room];
}

/** Round values between two ends. */
function ticks(low: number, high: number): number[] {
  const rough = (high - low) / LEVELS;
  if (!(rough > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].find((m) => m * power >= rough)! * power;
  const count = Math.floor(high / step + 1e-9) - Math.ceil(low / step - 1e-9) + 1;
  return Array.from({ length: count }, (_, i) => (Math.ceil(low / step - 1e-9) + i) * step);
}
