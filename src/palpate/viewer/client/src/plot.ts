// A small plot of the last seconds on a canvas.

import { css, tidy } from "./units";

export const SECONDS = 8;
const CAPACITY = 1200; // 150 Hz for eight seconds

export interface Scale {
  unit: string;
  low: number;
  high: number;
  logarithmic: boolean;
  stepped: boolean; // a value belongs to the whole time since the one before
}

/** A canvas to draw on; nothing is drawn where it is not shown. */
export class Sheet {
  width = 0; // px
  height = 0;
  private pen: CanvasRenderingContext2D | null = null;

  constructor(private readonly canvas: HTMLCanvasElement) {
    // asked at each drawing, the size would make the browser lay out the page each time
    new ResizeObserver(() => ([this.width, this.height] = [canvas.clientWidth, canvas.clientHeight])).observe(canvas);
  }

  /** A pen on the empty canvas; null where it is not shown. */
  clear(): CanvasRenderingContext2D | null {
    const { canvas } = this;
    if (this.width === 0) return null;
    const ratio = Math.min(devicePixelRatio, 2);
    const [width, height] = [this.width * ratio, this.height * ratio].map(Math.round);
    const pen = (this.pen ??= canvas.getContext("2d")!);
    if (canvas.width !== width || canvas.height !== height || !pen.font.startsWith("11px")) {
      [canvas.width, canvas.height] = [width!, height!];
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.font = "11px system-ui, sans-serif"; // to set it takes longer than to draw
    }
    pen.clearRect(0, 0, this.width, this.height);
    return pen;
  }
}

export class Plot {
  private readonly sheet: Sheet;
  private readonly times = new Float64Array(CAPACITY);
  private readonly values = new Float64Array(CAPACITY);
  private count = 0;
  private colour = "";
  private soft = "";
  private line = "";

  constructor(
    canvas: HTMLCanvasElement,
    private readonly variable: string,
  ) {
    this.sheet = new Sheet(canvas);
    this.recolour();
  }

  recolour(): void {
    [this.colour, this.soft, this.line] = [css(this.variable), css("--soft"), css("--line")];
  }

  /** Add a value at a time (s). Time that runs backwards starts afresh: another loop. */
  add(time: number, value: number): void {
    const last = this.times[(this.count + CAPACITY - 1) % CAPACITY]!;
    if (this.count && time < last) this.count = 0;
    if (this.count && time === last) return;
    this.times[this.count % CAPACITY] = time;
    this.values[this.count % CAPACITY] = value;
    this.count += 1;
  }

  /** Largest value on show. */
  peak(now: number): number {
    let peak = 0;
    this.each(now, (_, value) => (peak = Math.max(peak, value)));
    return peak;
  }

  draw(now: number, scale: Scale, marks: readonly number[] = []): void {
    const pen = this.sheet.clear();
    if (!pen) return;
    const { width, height } = this.sheet;
    const [left, top, bottom] = [56, 7, height - 7];
    const x = (time: number): number => width - 2 - ((now - time) / SECONDS) * (width - 2 - left);
    const y = (value: number): number => bottom - share(value, scale) * (bottom - top);
    for (const level of levels(scale)) {
      rule(pen, left, width, y(level), this.line, []);
      pen.fillStyle = this.soft;
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      pen.fillText(label(level, scale), left - 6, y(level));
    }
    for (const mark of marks) if (mark > 0) rule(pen, left, width, y(mark), this.soft, [3, 3]);
    pen.beginPath();
    let previous = -Infinity;
    this.each(now, (time, value) => {
      // a gap in time is a gap in the line
      if (time - previous > 0.5) pen.moveTo(x(time), y(value));
      else if (scale.stepped) pen.lineTo(x(previous), y(value));
      pen.lineTo(x(time), y(value));
      previous = time;
    });
    pen.strokeStyle = this.colour;
    pen.lineWidth = scale.stepped ? 1 : 1.8;
    pen.lineJoin = "round";
    pen.stroke();
  }

  private each(now: number, visit: (time: number, value: number) => void): void {
    for (let i = Math.max(0, this.count - CAPACITY); i < this.count; i++) {
      const time = this.times[i % CAPACITY]!;
      if (now - time <= SECONDS) visit(time, this.values[i % CAPACITY]!);
    }
  }
}

function share(value: number, { low, high, logarithmic }: Scale): number {
  const f = logarithmic ? Math.log : (v: number): number => v;
  const t = (f(Math.max(value, logarithmic ? low : -Infinity)) - f(low)) / (f(high) - f(low));
  return Math.min(Math.max(t, 0), 1);
}

function levels({ low, high, logarithmic }: Scale): number[] {
  if (!logarithmic) return [low, (low + high) / 2, high];
  const all: number[] = [];
  for (let v = low; v <= high * 1.001; v *= 10) all.push(v);
  return all;
}

function label(level: number, { unit, high, logarithmic }: Scale): string {
  if (logarithmic && Math.round(Math.log10(level)) % 2 !== 0) return ""; // every second decade
  if (logarithmic && level >= 1000) return `${tidy(level / 1000)} m${unit.slice(1)}`;
  return level === high || logarithmic ? `${tidy(level)} ${unit}` : tidy(level);
}

function rule(pen: CanvasRenderingContext2D, left: number, right: number, y: number, colour: string, dash: number[]): void {
  pen.beginPath();
  pen.setLineDash(dash);
  pen.moveTo(left, Math.round(y) + 0.5);
  pen.lineTo(right, Math.round(y) + 0.5);
  pen.strokeStyle = colour;
  pen.lineWidth = 1;
  pen.stroke();
  pen.setLineDash([]);
}
