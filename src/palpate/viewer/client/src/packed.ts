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
    const touched = interleave(list(), 1, 1);
    return { reach, rows, rest, modes, touched, shares: new Float32Array(touched.length).fill(1) };
  }
}

/** What the numbers of a binding mean. */
export interface BindingFacts {
  weight: number; // step of a barycentric coordinate
  lists: Sizes;
}

/** How a surface of its own is carried by a field's: by the corners and the middles of the sides of triangles in four parts. */
export class Binding {
  private readonly nodes: Int32Array; // six of each point
  private readonly shares: Float32Array;

  constructor({ weight, lists }: BindingFacts, bytes: Uint8Array, { triangles, rest }: Surface) {
    const list = reader(lists, bytes);
    const [middles, weights] = [interleave(list(), 1, 1), interleave(list(), 2, weight)];
    const points = rest.length / 3;
    const third = new Map<number, number>(); // beside each edge, as its triangle runs along it
    const edge = (a: number, b: number): number => a * points + b;
    for (let t = 0; t < triangles.length; t += 3) {
      for (let k = 0; k < 3; k++) third.set(edge(triangles[t + k]!, triangles[t + ((k + 1) % 3)]!), triangles[t + ((k + 2) % 3)]!);
    }
    this.nodes = new Int32Array(6 * middles.length);
    this.shares = new Float32Array(6 * middles.length);
    for (let i = 0; i < middles.length; i++) {
      const [u, v] = [weights[2 * i]!, weights[2 * i + 1]!];
      const w = [u, v, 1 - u - v];
      for (let k = 0; k < 3; k++) {
        const [before, middle] = [(k + 2) % 3, triangles[3 * middles[i]! + k]!];
        // the corner between the middles of two sides lies across the edge between these
        this.nodes[6 * i + k] = third.get(edge(middle, triangles[3 * middles[i]! + before]!))!;
        this.nodes[6 * i + 3 + k] = middle;
        this.shares[6 * i + k] = w[k]! * (2 * w[k]! - 1);
        this.shares[6 * i + 3 + k] = 4 * w[k]! * w[(k + 1) % 3]!;
      }
    }
  }

  /** A field's modes at the points that are carried, from those on the field's surface. */
  carry(modes: Modes, per: number): Modes {
    const count = modes.modes.length / (modes.rest.length || 1);
    const [from, to] = [modes.rest.length, (per * this.nodes.length) / 6];
    const out = new Float32Array(count * to);
    for (let k = 0; k < count; k++) this.values(out.subarray(k * to, (k + 1) * to), modes.modes.subarray(k * from, (k + 1) * from), per);
    const all = new Float32Array(from / per);
    modes.touched.forEach((i) => (all[i] = 1));
    const shares = this.values(new Float32Array(to / per), all, 1);
    const touched = Float32Array.from(shares.keys()).filter((i) => shares[i] !== 0);
    const rest = this.values(new Float32Array(to), modes.rest, per);
    return { ...modes, rest, modes: out, touched, shares: shares.filter((share) => share !== 0) };
  }

  private values(out: Float32Array, values: Float32Array, per: number): Float32Array {
    const { nodes, shares } = this;
    for (let i = 0, at = 0; at < nodes.length; i++, at += 6) {
      for (let c = 0; c < per; c++) {
        let sum = 0;
        for (let k = at; k < at + 6; k++) sum += shares[k]! * values[per * nodes[k]! + c]!;
        out[per * i + c] = sum;
      }
    }
    return out;
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
