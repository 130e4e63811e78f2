// A field on a body's surface under a touch, summed on the page: rest + coefficients · modes + local mode. The local mode
// travels with the probe: cubic B-splines in the distance from the contact point, times 1 and the coordinates of the offset from
// it (docs/method/touch-field.md); the server sends its profile with each picture.

import type { FieldInfo, Modes, Surface, Vec3 } from "./messages";

const OFFSETS = 4; // 1 and three coordinates

export class Field {
  /** components of each point */
  readonly values: Float32Array;
  readonly touched: Int32Array;

  constructor(
    readonly info: FieldInfo,
    private readonly modes: Modes,
    private readonly points: Float32Array, // m, x y z at rest
  ) {
    this.values = Float32Array.from(modes.rest);
    this.touched = Int32Array.from(modes.touched);
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
    for (let k = 0; k < this.info.modes; k++) {
      const b = numbers[k]!;
      if (b === 0) continue;
      const mode = modes.modes.subarray(k * n, (k + 1) * n);
      for (let i = 0; i < n; i++) values[i]! += b * mode[i]!;
    }
    if (modes.rows > 0) this.local(numbers.subarray(this.info.modes), contact);
  }

  /** The size of the field at each point. */
  sizes(): Float32Array {
    const [u, per] = [this.values, this.info.components];
    if (per === 1) return u;
    return Float32Array.from({ length: u.length / per }, (_, i) => {
      let sum = 0;
      for (let c = 0; c < per; c++) sum += u[per * i + c]! ** 2;
      return Math.sqrt(sum);
    });
  }

  private local(profile: Float32Array, contact: Vec3): void {
    if (!profile.some((x) => x !== 0)) return;
    const { values, points } = this;
    const { reach, rows } = this.modes;
    const per = this.info.components;
    for (const i of this.touched) {
      const offset = [1, ...contact.map((o, c) => (points[3 * i + c]! - o) / reach)];
      const far = Math.hypot(offset[1]!, offset[2]!, offset[3]!);
      if (far >= 1) continue;
      const t = far * (rows - 3);
      const first = Math.min(Math.floor(t), rows - 4);
      const w = weights(t - first);
      for (let c = 0; c < per; c++) {
        let sum = 0;
        for (let h = 0; h < OFFSETS; h++) {
          let along = 0;
          for (let j = 0; j < 4; j++) along += w[j]! * profile[((first + j) * OFFSETS + h) * per + c]!;
          sum += offset[h]! * along;
        }
        values[per * i + c]! += sum;
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
