// The body of a page of answers: its surface, coloured by a field and moved by a displacement, on which a click reads a value.

import { Mesh, Raycaster, Vector3 } from "three";
import type { Vec3 } from "./messages";
import { SurfaceView } from "./surface_view";

/** A place of the surface: its triangle's points, and the share of each. */
export interface Place {
  corners: Vec3;
  shares: Vec3;
}

export class AnswerView extends SurfaceView {
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
