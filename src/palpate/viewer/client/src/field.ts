// A field on a body's surface under a touch, summed on the page: rest + coefficients · modes + growth · dimple.
// The dimple is what travels with the probe, products of uniform cubic B-splines in the distance from its foot and in
// depth (docs/method/touch-field.md).

import type { Look, Modes, Vec3 } from "./messages";

/** Where the dimple of one picture is. */
export interface Place {
  depth: number; // m
  foot: Vec3; // m
  normal: Vec3;
}

export class Field {
  /** components of each point */
  readonly values: Float32Array;
  readonly touched: Int32Array;
  private readonly profile: Float64Array;

  constructor(
    readonly look: Look,
    private readonly modes: Modes,
    private readonly points: Float32Array, // m, x y z at rest
  ) {
    this.values = Float32Array.from(modes.rest);
    this.touched = Int32Array.from(modes.touched);
    this.profile = new Float64Array(modes.parts * modes.rows);
  }

  /** Numbers of `Press.coefficients` that this field takes. */
  get count(): number {
    return 1 + this.look.modes;
  }

  /** Sum it up: `numbers` are its growth with depth and its modes' coefficients. */
  update(numbers: Float32Array, place: Place): void {
    const { values, modes } = this;
    const n = values.length;
    values.set(modes.rest);
    for (let k = 0; k < this.look.modes; k++) {
      const b = numbers[1 + k]!;
      if (b === 0) continue;
      const mode = modes.modes.subarray(k * n, (k + 1) * n);
      for (let i = 0; i < n; i++) values[i]! += b * mode[i]!;
    }
    if (modes.reach > 0 && numbers[0]! > 0) this.dimple(numbers[0]!, place);
  }

  /** The size of the field at each point. */
  sizes(): Float32Array {
    const [u, per] = [this.values, this.look.components];
    if (per === 1) return u;
    return Float32Array.from({ length: u.length / per }, (_, i) => {
      let sum = 0;
      for (let c = 0; c < per; c++) sum += u[per * i + c]! ** 2;
      return Math.sqrt(sum);
    });
  }

  private dimple(growth: number, { depth, foot, normal }: Place): void {
    const { modes, values, points } = this;
    this.profiles(growth, depth);
    const [reach, per] = [modes.reach, (modes.rows - 3) / modes.reach];
    const [nx, ny, nz] = normal;
    for (const i of this.touched) {
      const [x, y, z] = [points[3 * i]! - foot[0], points[3 * i + 1]! - foot[1], points[3 * i + 2]! - foot[2]];
      const far = Math.sqrt(x * x + y * y + z * z);
      if (far >= reach) continue;
      const t = far * per;
      const first = Math.min(Math.floor(t), modes.rows - 4);
      let along = this.spline(t - first, first);
      if (modes.parts === 1) {
        values[i]! += along;
        continue;
      }
      const across = this.spline(t - first, modes.rows + first) / reach;
      along -= across * (x * nx + y * ny + z * nz);
      values[3 * i]! += along * nx + across * x;
      values[3 * i + 1]! += along * ny + across * y;
      values[3 * i + 2]! += along * nz + across * z;
    }
  }

  /** The table's splines in the distance, at one depth. */
  private profiles(growth: number, depth: number): void {
    const { table, columns, deepest, parts, rows } = this.modes;
    const t = Math.min((depth / deepest) * (columns - 3), columns - 3);
    const j = Math.min(Math.floor(t), columns - 4);
    const w = weights(t - j);
    for (let row = 0; row < parts * rows; row++) {
      let sum = 0;
      for (let m = 0; m < 4; m++) sum += w[m]! * table[row * columns + j + m]!;
      this.profile[row] = growth * sum;
    }
  }

  private spline(u: number, first: number): number {
    const w = weights(u);
    let sum = 0;
    for (let m = 0; m < 4; m++) sum += w[m]! * this.profile[first + m]!;
    return sum;
  }
}

/** The four uniform cubic B-splines at u in [0, 1] of a cell. */
function weights(u: number): [number, number, number, number] {
  const v = 1 - u;
  return [
    v ** 3 / 6,
    (3 * u ** 3 - 6 * u ** 2 + 4) / 6,
    (3 * v ** 3 - 6 * v ** 2 + 4) / 6,
    u ** 3 / 6,
  ];
}
