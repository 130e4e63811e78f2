// A tube along a smooth curve through the nodes, rebuilt in place for every picture.

import { BufferAttribute, BufferGeometry } from "three";
import { palette } from "./colour";

const BETWEEN = 4; // rings per pair of nodes
const SIDES = 12;

export class Tube {
  readonly geometry = new BufferGeometry();
  private readonly rings: number;
  private readonly line: Float32Array;
  private readonly tangents: Float32Array;
  private readonly amounts: Float32Array;
  private readonly position: BufferAttribute;
  private readonly normal: BufferAttribute;
  private readonly colour: BufferAttribute;
  private readonly palette = palette();

  constructor(
    private readonly nodes: number,
    private readonly radius: number,
  ) {
    this.rings = (nodes - 1) * BETWEEN + 1;
    this.line = new Float32Array(3 * this.rings);
    this.tangents = new Float32Array(3 * this.rings);
    this.amounts = new Float32Array(this.rings);
    const vertices = this.rings * SIDES;
    this.position = new BufferAttribute(new Float32Array(3 * vertices), 3);
    this.normal = new BufferAttribute(new Float32Array(3 * vertices), 3);
    this.colour = new BufferAttribute(new Float32Array(3 * vertices), 3);
    this.geometry.setAttribute("position", this.position);
    this.geometry.setAttribute("normal", this.normal);
    this.geometry.setAttribute("color", this.colour);
    this.geometry.setIndex(this.triangles());
  }

  /** Shape the tube: node positions (3 N) as drawn, and each node's share of the colour scale (N). */
  update(points: ArrayLike<number>, shares: ArrayLike<number>): void {
    this.interpolate(points, shares);
    this.sweep();
    this.position.needsUpdate = this.normal.needsUpdate = this.colour.needsUpdate = true;
    this.geometry.computeBoundingSphere();
  }

  private triangles(): number[] {
    const index: number[] = [];
    for (let r = 0; r + 1 < this.rings; r++) {
      for (let s = 0; s < SIDES; s++) {
        const [a, b] = [r * SIDES + s, r * SIDES + ((s + 1) % SIDES)];
        index.push(a, b, a + SIDES, b, b + SIDES, a + SIDES);
      }
    }
    return index;
  }

  /** Cubic Hermite curve with central-difference slopes (Catmull-Rom). */
  private interpolate(p: ArrayLike<number>, shares: ArrayLike<number>): void {
    const last = this.nodes - 1;
    for (let r = 0; r < this.rings; r++) {
      const i = Math.min(Math.floor(r / BETWEEN), last - 1);
      const t = r / BETWEEN - i;
      const [t2, t3] = [t * t, t * t * t];
      const basis = [2 * t3 - 3 * t2 + 1, t3 - 2 * t2 + t, -2 * t3 + 3 * t2, t3 - t2] as const;
      const slope = [6 * t2 - 6 * t, 3 * t2 - 4 * t + 1, -6 * t2 + 6 * t, 3 * t2 - 2 * t] as const;
      for (let k = 0; k < 3; k++) {
        const at = (n: number): number => p[3 * n + k]!;
        const m0 = i === 0 ? at(1) - at(0) : (at(i + 1) - at(i - 1)) / 2;
        const m1 = i + 1 === last ? at(last) - at(last - 1) : (at(i + 2) - at(i)) / 2;
        const [a, b] = [at(i), at(i + 1)];
        this.line[3 * r + k] = basis[0] * a + basis[1] * m0 + basis[2] * b + basis[3] * m1;
        this.tangents[3 * r + k] = slope[0] * a + slope[1] * m0 + slope[2] * b + slope[3] * m1;
      }
      this.amounts[r] = shares[i]! + (shares[i + 1]! - shares[i]!) * t;
    }
  }

  /** Rings across the curve; each ring's frame is the one before, turned as little as possible. */
  private sweep(): void {
    const { line, tangents } = this;
    let [nx, ny, nz] = [0, 0, 1];
    for (let r = 0; r < this.rings; r++) {
      const [tx, ty, tz] = unit(tangents[3 * r]!, tangents[3 * r + 1]!, tangents[3 * r + 2]!);
      const along = nx * tx + ny * ty + nz * tz;
      [nx, ny, nz] = unit(nx - along * tx, ny - along * ty, nz - along * tz);
      const [bx, by, bz] = [ty * nz - tz * ny, tz * nx - tx * nz, tx * ny - ty * nx];
      const tint = this.palette[Math.round(255 * Math.min(Math.max(this.amounts[r]!, 0), 1))]!;
      for (let s = 0; s < SIDES; s++) {
        const angle = (2 * Math.PI * s) / SIDES;
        const [c, d] = [Math.cos(angle), Math.sin(angle)];
        const [x, y, z] = [c * nx + d * bx, c * ny + d * by, c * nz + d * bz];
        const v = r * SIDES + s;
        const q = this.radius;
        this.position.setXYZ(v, line[3 * r]! + q * x, line[3 * r + 1]! + q * y, line[3 * r + 2]! + q * z);
        this.normal.setXYZ(v, x, y, z);
        this.colour.setXYZ(v, tint.r, tint.g, tint.b);
      }
    }
  }
}

function unit(x: number, y: number, z: number): [number, number, number] {
  const size = Math.hypot(x, y, z) || 1;
  return [x / size, y / size, z / size];
}
