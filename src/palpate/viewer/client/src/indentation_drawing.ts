// Indentations of a page that is one file: how deep a ball would rest on the body without a force, at each point of its surface.
// palpate/viewer/indentation_drawing.py says what is drawn and why; a server works it out for all points at once, the page for
// those near where the body has just yielded, a few milliseconds' worth a picture.

import type { Evaluator } from "./evaluator";
import type { Hello, Surface, Vec3 } from "./messages";

const LEVELS = 33; // depths between which amplitudes are straight
const BEYOND = 1.5; // the last one, over the deepest trained depth
const FAR = 4.5; // widths from a place at which it counts no more: exp(−FAR²/2) = 4e-5
const CHANGED = 1e-4; // of the largest amplitude: less is no change
const WORK = 2; // ms a picture

/** Where a body keeps indentations, and over which width (m) the probe meets them. */
export interface Places {
  points: Vec3[];
  width: number;
}

export class IndentationDrawing {
  /** m, at each point of `Surface.yielding`; another list once something has changed */
  depths: Float32Array;

  private readonly parameters: Float64Array;
  private readonly levels: Float64Array; // m
  private readonly centres: Float32Array; // m, of the points
  private readonly rows: (Row | null)[];
  private readonly level: Uint8Array; // below each point's depth
  private readonly between: Float64Array; // amplitudes at that level and the next
  private readonly due: Uint8Array;
  private readonly latest: Float64Array; // amplitudes at the places as they are drawn
  private pending = 0;

  constructor(
    private readonly evaluator: Evaluator,
    private readonly hello: Hello,
    private readonly surface: Surface,
    private readonly places: Places,
  ) {
    const count = surface.yielding.length;
    this.parameters = Float64Array.from(hello.parameters, ({ low, high }) => (low + high) / 2);
    this.levels = Float64Array.from({ length: LEVELS }, (_, k) => BEYOND * hello.deepest * (k / (LEVELS - 1)) ** 2);
    this.centres = Float32Array.from(surface.yielding).reduce((all, i, k) => {
      all.set(surface.rest.subarray(3 * i, 3 * i + 3), 3 * k);
      return all;
    }, new Float32Array(3 * count));
    this.depths = new Float32Array(count);
    this.rows = new Array<Row | null>(count).fill(null);
    this.level = new Uint8Array(count);
    this.between = new Float64Array(2 * count).fill(NaN);
    this.due = new Uint8Array(count);
    this.latest = new Float64Array(places.points.length);
  }

  /** Follow the body's memory; `depths` are what is drawn then. */
  update(): void {
    this.spread();
    if (this.pending === 0) return;
    const began = performance.now();
    this.depths = Float32Array.from(this.depths);
    for (let i = 0; i < this.due.length && this.pending > 0; i++) {
      if (this.due[i] === 0) continue;
      [this.due[i], this.pending] = [0, this.pending - 1];
      this.depths[i] = this.depth(i);
      if (performance.now() - began > WORK) break; // the rest comes with the next pictures
    }
  }

  /** The share of the elastic shape that is drawn on top: none until the probe meets the bottom. */
  elastic(depth: number, contact: Vec3, normal: Vec3): number {
    const met = this.met(this.row(contact), this.evaluator.amplitudes);
    if (!(met > 0)) return 1;
    let [low, high] = [0, LEVELS - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.amplitude(contact, normal, middle) < met) low = middle;
      else high = middle;
    }
    const ends = [low, low + 1].map((k) => this.amplitude(contact, normal, k)) as [number, number];
    return Math.max(0, 1 - this.rest(met, low, ends[0], ends[1]) / Math.max(depth, 1e-12));
  }

  /** Mark the points around places whose amplitudes have changed. */
  private spread(): void {
    const { latest, places, centres, due } = this;
    const now = this.evaluator.amplitudes;
    const least = CHANGED * now.reduce((most, v) => Math.max(most, v), 0);
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (let j = 0; j < now.length; j++) {
      if (Math.abs(now[j]! - latest[j]!) <= least) continue;
      latest[j] = now[j]!;
      places.points[j]!.forEach((v, k) => ([low[k], high[k]] = [Math.min(low[k]!, v), Math.max(high[k]!, v)]));
    }
    if (low[0] === Infinity) return;
    const far = FAR * places.width;
    for (let i = 0; i < due.length; i++) {
      let inside = due[i] === 0;
      for (let k = 0; k < 3; k++) inside &&= centres[3 * i + k]! > low[k]! - far && centres[3 * i + k]! < high[k]! + far;
      if (inside) [due[i], this.pending] = [1, this.pending + 1];
    }
  }

  /** How deep a ball rests at point i, m. */
  private depth(i: number): number {
    const place = Array.from(this.centres.subarray(3 * i, 3 * i + 3)) as Vec3;
    const normal = Array.from(this.surface.normals.subarray(3 * i, 3 * i + 3)) as Vec3;
    const met = this.met((this.rows[i] ??= this.row(place)), this.latest);
    if (!(met > 0)) return 0;
    const { between, level } = this;
    const at = (k: number): number => this.amplitude(place, normal, k);
    // the first time, or after all was forgotten
    if (!(between[2 * i]! < met)) [level[i], between[2 * i], between[2 * i + 1]] = [0, at(0), at(1)];
    while (between[2 * i + 1]! < met && level[i]! < LEVELS - 2) {
      level[i]! += 1;
      [between[2 * i], between[2 * i + 1]] = [between[2 * i + 1]!, at(level[i]! + 1)];
    }
    return this.rest(met, level[i]!, between[2 * i]!, between[2 * i + 1]!);
  }

  /** The depth of an amplitude between those of level k and the next. */
  private rest(met: number, k: number, low: number, high: number): number {
    const share = Math.min(Math.max((met - low) / Math.max(high - low, 1e-300), 0), 1);
    return this.levels[k]! + share * (this.levels[k + 1]! - this.levels[k]!);
  }

  /** The elastic amplitude √(2U) of a ball as deep as level k at a place. */
  private amplitude(place: Vec3, normal: Vec3, k: number): number {
    const lift = this.hello.radius - this.levels[k]!;
    const centre = place.map((v, axis) => v + lift * normal[axis]!) as Vec3;
    return Math.sqrt(2 * Math.max(this.evaluator.answer(centre, this.parameters).energy, 0));
  }

  private met({ which, weights }: Row, amplitudes: Float64Array): number {
    let sum = 0;
    for (let j = 0; j < which.length; j++) sum += weights[j]! * amplitudes[which[j]!]!;
    return sum;
  }

  /** Places that a probe meets at a point, and their weights. */
  private row([x, y, z]: Vec3): Row {
    const { points, width } = this.places;
    const squares = Float64Array.from(points, ([a, b, c]) => (a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2);
    const least = squares.reduce((a, b) => Math.min(a, b), Infinity);
    const which: number[] = [];
    squares.forEach((square, j) => square < least + (FAR * width) ** 2 && which.push(j));
    const shares = which.map((j) => Math.exp((least - squares[j]!) / (2 * width * width)));
    const total = shares.reduce((a, b) => a + b, 0);
    return { which: Uint32Array.from(which), weights: Float64Array.from(shares, (v) => v / total) };
  }
}

interface Row {
  which: Uint32Array;
  weights: Float64Array;
}
