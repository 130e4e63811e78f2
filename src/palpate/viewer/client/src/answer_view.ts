// The body of a page of answers: its surface, coloured by a field and moved by a displacement, on which a click reads a value.

import { BufferAttribute, BufferGeometry, Mesh, Raycaster, Vector3 } from "three";
import { normalsInto } from "./mesh";
import type { Vec3 } from "./messages";
import { SurfaceView } from "./surface_view";

/** A place of the surface: its triangle's points, and the share of each. */
export interface Place {
  corners: Vec3;
  shares: Vec3;
}

const APART = 1.4; // times the body's width: a body that is drawn beside stands so far to the right

export class AnswerView extends SurfaceView {
  private other: Mesh | null = null;

  /** Draw another state of the body beside it, as `deform` draws the one in its place; null takes it away. */
  beside(state: { displacement: Float32Array; factor: number; shares: ArrayLike<number> } | null): void {
    const was = this.other !== null;
    if (state && !this.other) {
      const geometry = new BufferGeometry();
      const { length } = this.surface.rest;
      for (const name of ["position", "normal", "color"]) geometry.setAttribute(name, new BufferAttribute(new Float32Array(length), 3));
      geometry.setIndex(new BufferAttribute(this.triangles, 1));
      this.other = new Mesh(geometry, this.body.material);
      this.other.frustumCulled = false;
      this.other.position.x = APART * this.width();
      this.scene.add(this.other);
    }
    if (!state && this.other) {
      this.scene.remove(this.other);
      this.other.geometry.dispose();
      this.other = null;
    }
    if (state && this.other) {
      const [position, normal, colour] = ["position", "normal", "color"].map((name) => this.other!.geometry.getAttribute(name)) as BufferAttribute[];
      const at = position!.array as Float32Array;
      this.surface.rest.forEach((v, i) => (at[i] = v + state.factor * state.displacement[i]!));
      normalsInto(normal!.array as Float32Array, at, this.triangles);
      this.tint(state.shares, colour!);
      for (const changed of [position, normal, colour]) changed!.needsUpdate = true;
    }
    this.dirty = true;
    if (was !== (this.other !== null)) this.look();
  }

  protected override outline(): Vector3[] {
    const own = super.outline();
    return this.other ? own.concat(own.map((point) => point.clone().setX(point.x + this.other!.position.x))) : own;
  }

  private width(): number {
    const { rest } = this.surface;
    let [low, high] = [Infinity, -Infinity];
    for (let i = 0; i < rest.length; i += 3) [low, high] = [Math.min(low, rest[i]!), Math.max(high, rest[i]!)];
    return high - low;
  }

  /** The place of the surface, as it is drawn, at a point of the canvas, CSS pixels; null beside the body. */
  place(x: number, y: number): Place | null {
    this.geometry.computeBoundingSphere();
    const caster: Raycaster = this.ray(x, y);
    const hit = caster.intersectObject(this.body as Mesh, false)[0];
    if (!hit?.face) return null;
    const corners: Vec3 = [hit.face.a, hit.face.b, hit.face.c];
    const [a, b, c] = corners.map((i) => new Vector3().fromBufferAttribute(this.geometry.getAttribute("position"), i)) as [Vector3, Vector3, Vector3];
    const normal = (p: Vector3, q: Vector3, r: Vector3): Vector3 => q.clone().sub(p).cross(r.clone().sub(p));
    const whole = normal(a, b, c);
    const part = (q: Vector3, r: Vector3): number => normal(hit.point, q, r).dot(whole) / whole.lengthSq();
    return { corners, shares: [part(b, c), part(c, a), part(a, b)] };
  }

  /** Where a place of the surface is at rest, m. */
  placeAtRest({ corners, shares }: Place): Vec3 {
    return [0, 1, 2].map((k) => corners.reduce((sum, i, j) => sum + shares[j]! * this.surface.rest[3 * i + k]!, 0)) as Vec3;
  }

  /** The size of the body, m. */
  get extent(): number {
    return this.across();
  }
}
