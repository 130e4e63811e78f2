// A field on a body's surface under a touch, summed on the page: rest + coefficients · modes + local mode. The local mode
// travels with the probe: cubic B-splines in the distance from the contact point, times 1 and the coordinates of the offset from
// it (docs/method/touch-field.md); the server sends its profile with each picture.

import type { FieldInfo, Modes, Surface, Vec3 } from "./messages";

const OFFSETS = 4; // 1 and three coordinates

type Rows = [Float32Array, Float32Array, Float32Array, Float32Array];

export class Field {
  /** components of each point */
  readonly values: Float32Array;
  readonly touched: Int32Array;
  private readonly size: Float32Array;

  constructor(
    readonly info: FieldInfo,
    private readonly modes: Modes,
    private readonly points: Float32Array, // m, x y z at rest
  ) {
    this.values = Float32Array.from(modes.rest);
    this.touched = Int32Array.from(modes.touched);
    this.size = new Float32Array(this.values.length / info.components);
  }

  /** Numbers of `Frame.coefficients` that this field takes. */
  get count(): number {
    return this.info.modes + OFFSETS * this.modes.rows * this.info.components;
  }

  /** Sum it up: `numbers` are its modes' coefficients and its local mode's profile. */
  update(numbers: Float32Array, contact: Vec3): void {
    const { values, modes } = this;
    const n = values.length;
    values.set(modes.rest);
    // eight modes at a time, then four: the values are loaded and stored less often
    let k = 0;
    for (; k + 8 <= this.info.modes; k += 8) {
      const [a, b, c, d] = [numbers[k]!, numbers[k + 1]!, numbers[k + 2]!, numbers[k + 3]!];
      const [e, f, g, h] = [numbers[k + 4]!, numbers[k + 5]!, numbers[k + 6]!, numbers[k + 7]!];
      if (a === 0 && b === 0 && c === 0 && d === 0 && e === 0 && f === 0 && g === 0 && h === 0) continue;
      const [p, q, r, t] = this.rows(k);
      const [u, v, w, x] = this.rows(k + 4);
      for (let i = 0; i < n; i++) {
        values[i]! += a * p[i]! + b * q[i]! + (c * r[i]! + d * t[i]!) + (e * u[i]! + f * v[i]! + (g * w[i]! + h * x[i]!));
      }
    }
    for (; k + 4 <= this.info.modes; k += 4) {
      const [a, b, c, d] = [numbers[k]!, numbers[k + 1]!, numbers[k + 2]!, numbers[k + 3]!];
      if (a === 0 && b === 0 && c === 0 && d === 0) continue;
      const [p, q, r, t] = this.rows(k);
      for (let i = 0; i < n; i++) values[i]! += a * p[i]! + b * q[i]! + (c * r[i]! + d * t[i]!);
    }
    for (; k < this.info.modes; k++) {
      const b = numbers[k]!;
      if (b === 0) continue;
      const mode = modes.modes.subarray(k * n, (k + 1) * n);
      for (let i = 0; i < n; i++) values[i]! += b * mode[i]!;
    }
    if (modes.rows > 0) this.local(numbers.subarray(this.info.modes), contact);
  }

  /** Modes k to k + 3. */
  private rows(k: number): Rows {
    const n = this.values.length;
    return [0, 1, 2, 3].map((j) => this.modes.modes.subarray((k + j) * n, (k + j + 1) * n)) as Rows;
  }

  /** The size of the field at each point; overwritten by the next call. */
  sizes(): Float32Array {
    const [u, per, out] = [this.values, this.info.components, this.size];
    if (per === 1) return u;
    for (let i = 0, at = 0; i < out.length; i++, at += 3) {
      const x = u[at]!;
      const y = u[at + 1]!;
      const z = u[at + 2]!;
      out[i] = Math.sqrt(x * x + y * y + z * z);
    }
    return out;
  }

  private local(profile: Float32Array, contact: Vec3): void {
    if (!profile.some((x) => x !== 0)) return;
    const { values, points } = this;
    const { reach, rows, shares } = this.modes;
    const per = this.info.components;
    const [cx, cy, cz] = contact;
    const { touched } = this;
    const cells = rows - 3;
    const wide = OFFSETS * per;
    const w = new Float64Array(4);
    // this runs for thousands of points a picture: nothing is allocated in it
    for (let k = 0; k < touched.length; k++) {
      const i = touched[k]!;
      const share = shares[k]!;
      const x = (points[3 * i]! - cx) / reach;
      const y = (points[3 * i + 1]! - cy) / reach;
      const z = (points[3 * i + 2]! - cz) / reach;
      const square = x * x + y * y + z * z;
      if (square >= 1) continue;
      const t = Math.sqrt(square) * cells;
      const first = Math.min(Math.floor(t), rows - 4);
      weights(t - first, w);
      for (let c = 0; c < per; c++) {
        let sum = 0;
        for (let j = 0; j < 4; j++) {
          const at = (first + j) * wide + c;
          const along = profile[at]! + x * profile[at + per]! + y * profile[at + 2 * per]! + z * profile[at + 3 * per]!;
          sum += w[j]! * along;
        }
        values[per * i + c]! += share * sum;
      }
    }
  }
}

/** What stays pressed in a body that yields: depths along the normals of those points that may keep an indentation. */
export class Indentation {
  private readonly points: Int32Array;

  constructor(private readonly surface: Surface) {
    this.points = Int32Array.from(surface.yielding);
  }

  /** Press displacements (x y z of each point, m) down by the depths (m) of a picture; empty where nothing stays. */
  into(moved: Float32Array, depths: Float32Array): void {
    const { normals } = this.surface;
    for (let k = 0; k < depths.length; k++) {
      const depth = depths[k]!;
      if (depth === 0) continue;
      for (let i = 0; i < 3; i++) moved[3 * this.points[k]! + i]! -= depth * normals[3 * k + i]!;
    }
  }
}

/** The four uniform cubic B-splines at u in [0, 1] of a cell, into `out`. */
function weights(u: number, out: Float64Array): void {
  const v = 1 - u;
  out[0] = (v * v * v) / 6;
  out[1] = (3 * u * u * u - 6 * u * u + 4) / 6;
  out[2] = (3 * v * v * v - 6 * v * v + 4) / 6;
  out[3] = (u * u * u) / 6;
}
