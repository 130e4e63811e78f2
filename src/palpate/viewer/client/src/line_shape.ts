// The shape of a body drawn as a line, in a page that is one file: the network of its nodes is asked by the loads that the
// answered force says and by the further inputs. Once released the line swings back to rest as the server draws it.

import type { Evaluator } from "./evaluator";
import type { Vec3 } from "./messages";

/** What the page knows of a line: palpate/viewer/file_line.py. */
export interface LineFacts {
  stays: boolean; // it lies elsewhere after a touch
  directions: Vec3[]; // of the loads that the hand supplies
  touched: number[]; // which inputs these are
  further: number[]; // and which ones are further inputs
  by_place: boolean; // the place along each direction comes first
  low: number[];
  high: number[];
  mirror: Vec3 | null; // direction of the one load that mirrors
  columns: [node: number, component: number][];
  frequency: number; // Hz
  damping: number; // share of the critical one
  still: number;
}

export class LineShape {
  private readonly loads: Float64Array;
  private readonly values: Float32Array;
  private released = -Infinity; // s

  constructor(
    private readonly evaluator: Evaluator,
    private readonly facts: LineFacts,
    nodes: number,
  ) {
    this.loads = new Float64Array(facts.low.length);
    this.values = new Float32Array(3 * nodes);
  }

  /** Displacements (3 N), m, while a hand holds: under the loads of this answer. */
  held(place: Vec3, force: Vec3, parameters: ArrayLike<number>, at: number): Float32Array {
    const { touched, further, directions, by_place } = this.facts;
    directions.forEach((direction, a) => {
      this.loads[touched[a]!] = -dot(direction, force);
      if (by_place) this.loads[a] = dot(direction, place);
    });
    further.forEach((input, b) => (this.loads[input] = parameters[b]!));
    this.released = at;
    return this.at(this.loads);
  }

  /** The same without a hand: the last loads fade, the further inputs stay. */
  free(parameters: ArrayLike<number>, at: number): Float32Array {
    const { touched, further, low, high, mirror } = this.facts;
    const loads = this.loads.slice();
    further.forEach((input, b) => (loads[input] = parameters[b]!));
    const share = this.swing(at - this.released);
    for (const input of touched) {
      const least = mirror ? -high[input]! : Math.min(low[input]!, 0);
      loads[input] = Math.min(Math.max(share * loads[input]!, least), high[input]!);
    }
    return this.at(loads);
  }

  private at(loads: Float64Array): Float32Array {
    const { low, high, mirror, columns } = this.facts;
    const other = mirror !== null && loads[0]! < 0;
    const inputs = loads.map((load, i) => Math.min(Math.max(other ? -load : load, low[i]!), high[i]!));
    const outputs = this.evaluator.predict(inputs, columns.length);
    columns.forEach(([node, component], k) => (this.values[3 * node + component] = outputs[k]!));
    if (other) reflect(this.values, mirror!);
    return this.values.slice();
  }

  private swing(elapsed: number): number {
    const { frequency, damping, still } = this.facts;
    const w = 2 * Math.PI * frequency;
    const envelope = Math.exp(-damping * w * elapsed);
    if (!(envelope >= still)) return 0;
    const root = Math.sqrt(1 - damping ** 2);
    return envelope * (Math.cos(root * w * elapsed) + (damping / root) * Math.sin(root * w * elapsed));
  }
}

/** Mirror all displacements on the plane across a direction. */
function reflect(values: Float32Array, direction: Vec3): void {
  for (let i = 0; i < values.length; i += 3) {
    const along = 2 * (direction[0] * values[i]! + direction[1] * values[i + 1]! + direction[2] * values[i + 2]!);
    for (let k = 0; k < 3; k++) values[i + k]! -= along * direction[k]!;
  }
}

function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
