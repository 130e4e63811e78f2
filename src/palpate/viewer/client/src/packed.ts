// A surface with its fields, from the few bytes in which a page that is one file holds them: palpate/viewer/packed_surface.py
// tells the form.

import type { Modes, Surface } from "./messages";

type Sizes = [count: number, bytes: number][];

/** What the numbers of a surface mean. */
export interface SurfaceFacts {
  points: number;
  step: number; // m, of the coordinates
  direction: number; // step of a normal's components
  lists: Sizes;
}

/** What the numbers of a field mean. */
export interface FieldFacts {
  reach: number; // m
  rows: number;
  scales: number[]; // what 1 stands for in the rest and in each mode
  lists: Sizes;
}

interface Mesh {
  triangles: Int32Array;
  parents: Int32Array; // three points by which each one's values are guessed; -1 for none
}

export class PackedSurface {
  readonly surface: Surface;
  private readonly parents: Int32Array;

  constructor({ points, step, direction, lists }: SurfaceFacts, bytes: Uint8Array) {
    const list = reader(lists, bytes);
    const { triangles, parents } = connect(list(), list(), list(), points);
    this.parents = parents;
    const touchable = Float32Array.from(list());
    const rest = new Float32Array(3 * points);
    fill(rest, list(), step, parents);
    this.surface = {
      rest,
      triangles: Float32Array.from(triangles),
      creases: interleave(list(), 2, 1),
      fixed: new Float32Array(),
      touchable,
      yielding: interleave(list(), 1, 1),
      normals: interleave(list(), 3, direction),
    };
  }

  /** The modes of a field on this surface. */
  field({ reach, rows, scales, lists }: FieldFacts, bytes: Uint8Array): Modes {
    const list = reader(lists, bytes);
    const [size, count] = [lists[0]![0], scales.length - 1];
    const rest = new Float32Array(size);
    fill(rest, list(), scales[0]!, this.parents);
    const modes = new Float32Array(count * size);
    for (let k = 0; k < count; k++) fill(modes.subarray(k * size, (k + 1) * size), list(), scales[k + 1]!, this.parents);
    return { reach, rows, rest, modes, touched: interleave(list(), 1, 1) };
  }
}

/** The next list of whole numbers at each call. */
function reader(sizes: Sizes, bytes: Uint8Array): () => Int32Array {
  let [next, at] = [0, 0];
  return () => {
    const [count, width] = sizes[next++]!;
    const out = new Int32Array(count);
    for (let b = 0; b < width; b++, at += count) for (let i = 0; i < count; i++) out[i]! |= bytes[at + i]! << (8 * b);
    for (let i = 0; i < count; i++) out[i] = (out[i]! >>> 1) ^ -(out[i]! & 1);
    return out;
  };
}

/** Triangles across edges of earlier ones, and the three points by which a new point's values are guessed. */
function connect(gates: Int32Array, thirds: Int32Array, starts: Int32Array, points: number): Mesh {
  const triangles = new Int32Array(3 * gates.length);
  const parents = new Int32Array(3 * points).fill(-1);
  let [known, start] = [0, 0];
  const corner = (code: number): number => (code === 0 ? known++ : known - code);
  for (let t = 0; t < gates.length; t++) {
    const gate = gates[t]!;
    if (gate === 0) {
      for (let k = 0; k < 3; k++) triangles[3 * t + k] = corner(starts[start++]!);
      continue;
    }
    const [from, edge] = [3 * (t - Math.floor(gate / 3)), gate % 3];
    const [a, b, d] = [0, 1, 2].map((k) => triangles[from + ((edge + k) % 3)]!) as [number, number, number];
    if (thirds[t] === 0) parents.set([a, b, d], 3 * known);
    triangles.set([b, a, corner(thirds[t]!)], 3 * t);
  }
  return { triangles, parents };
}

/** Values at points, component after component, from their differences from guesses; into `out` point after point. */
function fill(out: Float32Array, numbers: Int32Array, scale: number, parents: Int32Array): void {
  const points = parents.length / 3;
  const per = numbers.length / points;
  for (let c = 0; c < per; c++) {
    const values = numbers.subarray(c * points, (c + 1) * points);
    for (let i = 0; i < points; i++) {
      const a = parents[3 * i]!;
      if (a >= 0) values[i]! += values[a]! + values[parents[3 * i + 1]!]! - values[parents[3 * i + 2]!]!;
      else if (i > 0) values[i]! += values[i - 1]!;
      out[per * i + c] = scale * values[i]!;
    }
  }
}

/** Rows of differences as numbers times a step, column after column. */
function interleave(numbers: Int32Array, rows: number, step: number): Float32Array {
  const count = numbers.length / rows;
  const out = new Float32Array(numbers.length);
  for (let r = 0; r < rows; r++) {
    let total = 0;
    for (let i = 0; i < count; i++) out[rows * i + r] = step * (total += numbers[r * count + i]!);
  }
  return out;
}
