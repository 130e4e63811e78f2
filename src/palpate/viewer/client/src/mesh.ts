// Work on a triangulated surface that is done for every picture or every move of the pointer: normals of its points, and where a
// ray meets it. Bodies have tens of thousands of triangles, so all of it runs over plain lists of numbers, and the inner loops make no
// small arrays: those cost four times the arithmetic.

import type { Vec3 } from "./messages";

const BLOCK = 32; // triangles that a ray is tried against together
const BITS = 10; // of each coordinate by which triangles are put into an order

/** Unit normals of points (x y z each) into `out`: the sum of their triangles', by area. */
export function normalsInto(out: Float32Array, points: Float32Array, triangles: Uint32Array): void {
  out.fill(0);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t]!;
    const b = 3 * triangles[t + 1]!;
    const c = 3 * triangles[t + 2]!;
    const x = points[a]!;
    const y = points[a + 1]!;
    const z = points[a + 2]!;
    const ux = points[b]! - x;
    const uy = points[b + 1]! - y;
    const uz = points[b + 2]! - z;
    const vx = points[c]! - x;
    const vy = points[c + 1]! - y;
    const vz = points[c + 2]! - z;
    const nx = uy * vz - uz * vy;
    const ny = uz * vx - ux * vz;
    const nz = ux * vy - uy * vx;
    out[a]! += nx;
    out[a + 1]! += ny;
    out[a + 2]! += nz;
    out[b]! += nx;
    out[b + 1]! += ny;
    out[b + 2]! += nz;
    out[c]! += nx;
    out[c + 1]! += ny;
    out[c + 2]! += nz;
  }
  for (let i = 0; i < out.length; i += 3) {
    const x = out[i]!;
    const y = out[i + 1]!;
    const z = out[i + 2]!;
    const share = 1 / (Math.sqrt(x * x + y * y + z * z) || 1);
    out[i] = x * share;
    out[i + 1] = y * share;
    out[i + 2] = z * share;
  }
}

/** Where a ray meets a surface first. */
export interface Hit {
  triangle: number;
  point: Vec3;
  across: Vec3; // across the triangle, outwards, of any length
  shares: Vec3; // of its three corners
}

/** A surface at rest, in blocks of triangles that are near each other, so that a ray is tried against few of them. */
export class Target {
  private readonly order: Uint32Array;
  private readonly balls: Float32Array; // around each block: centre and square of the radius

  constructor(
    private readonly points: Float32Array,
    private readonly triangles: Uint32Array,
  ) {
    this.order = along(points, triangles);
    const blocks = Math.ceil(this.order.length / BLOCK);
    this.balls = new Float32Array(4 * blocks);
    for (let b = 0; b < blocks; b++) this.balls.set(this.around(b), 4 * b);
  }

  /** The nearest meeting of a ray from an origin along a unit direction; null where there is none. */
  meet(origin: Vec3, direction: Vec3): Hit | null {
    const [ox, oy, oz] = origin;
    const [dx, dy, dz] = direction;
    const { balls, order } = this;
    const found = { far: Infinity, triangle: -1, u: 0, v: 0 };
    for (let b = 0; 4 * b < balls.length; b++) {
      const [x, y, z] = [balls[4 * b]! - ox, balls[4 * b + 1]! - oy, balls[4 * b + 2]! - oz];
      const ahead = x * dx + y * dy + z * dz;
      if (x * x + y * y + z * z - ahead * ahead > balls[4 * b + 3]!) continue;
      const end = Math.min(order.length, (b + 1) * BLOCK);
      for (let i = b * BLOCK; i < end; i++) this.cross(order[i]!, origin, direction, found);
    }
    if (found.triangle < 0) return null;
    const { far, triangle, u, v } = found;
    return {
      triangle,
      point: [ox + far * dx, oy + far * dy, oz + far * dz],
      across: this.across(triangle),
      shares: [1 - u - v, u, v],
    };
  }

  /** Keep a triangle that the ray meets nearer than what was found (Möller & Trumbore 1997). */
  private cross(t: number, [ox, oy, oz]: Vec3, [dx, dy, dz]: Vec3, found: { far: number; triangle: number; u: number; v: number }): void {
    const { points, triangles } = this;
    const [a, b, c] = [3 * triangles[3 * t]!, 3 * triangles[3 * t + 1]!, 3 * triangles[3 * t + 2]!];
    const [x, y, z] = [points[a]!, points[a + 1]!, points[a + 2]!];
    const [ux, uy, uz] = [points[b]! - x, points[b + 1]! - y, points[b + 2]! - z];
    const [vx, vy, vz] = [points[c]! - x, points[c + 1]! - y, points[c + 2]! - z];
    const [px, py, pz] = [dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx];
    const size = ux * px + uy * py + uz * pz;
    if (size === 0) return;
    const [sx, sy, sz] = [ox - x, oy - y, oz - z];
    const u = (sx * px + sy * py + sz * pz) / size;
    if (!(u >= 0 && u <= 1)) return;
    const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
    const v = (dx * qx + dy * qy + dz * qz) / size;
    if (!(v >= 0 && u + v <= 1)) return;
    const far = (vx * qx + vy * qy + vz * qz) / size;
    if (far > 0 && far < found.far) Object.assign(found, { far, triangle: t, u, v });
  }

  private across(t: number): Vec3 {
    const { points, triangles } = this;
    const [a, b, c] = [0, 1, 2].map((k) => 3 * triangles[3 * t + k]!) as Vec3;
    const [u, v] = [b, c].map((i) => [0, 1, 2].map((k) => points[i + k]! - points[a + k]!)) as [Vec3, Vec3];
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  }

  /** A ball around a block: its centre, and the square of its radius. */
  private around(block: number): number[] {
    const { points, triangles } = this;
    const some = this.order.subarray(block * BLOCK, (block + 1) * BLOCK);
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const t of some) for (let k = 0; k < 3; k++) widen(low, high, points, triangles[3 * t + k]!);
    const centre = low.map((v, k) => (v + high[k]!) / 2);
    let most = 0;
    for (const t of some) {
      for (let k = 0; k < 3; k++) {
        const i = 3 * triangles[3 * t + k]!;
        const square = (points[i]! - centre[0]!) ** 2 + (points[i + 1]! - centre[1]!) ** 2 + (points[i + 2]! - centre[2]!) ** 2;
        if (square > most) most = square;
      }
    }
    return [...centre, most * (1 + 1e-5)]; // single precision
  }
}

/** Widen a box, its lowest and highest coordinates, to hold point i. */
function widen(low: number[], high: number[], points: Float32Array, i: number): void {
  for (let k = 0; k < 3; k++) {
    const v = points[3 * i + k]!;
    if (v < low[k]!) low[k] = v;
    if (v > high[k]!) high[k] = v;
  }
}

/** Triangles in the order of a curve through space (Morton 1966): what is near in it is near. */
function along(points: Float32Array, triangles: Uint32Array): Uint32Array {
  const count = triangles.length / 3;
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; 3 * i < points.length; i++) widen(low, high, points, i);
  const size = Math.max(...high.map((v, k) => v - low[k]!)) || 1;
  const keys = new Uint32Array(count);
  for (let t = 0; t < count; t++) {
    for (let k = 0; k < 3; k++) {
      const middle = (points[3 * triangles[3 * t]! + k]! + points[3 * triangles[3 * t + 1]! + k]! + points[3 * triangles[3 * t + 2]! + k]!) / 3;
      const cell = Math.floor(((middle - low[k]!) / size) * (2 ** BITS - 1));
      for (let b = 0; b < BITS; b++) keys[t]! |= ((cell >> b) & 1) << (3 * b + k);
    }
  }
  const order = new Uint32Array(count);
  for (let t = 0; t < count; t++) order[t] = t;
  return order.sort((a, b) => keys[a]! - keys[b]!);
}
