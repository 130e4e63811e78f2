// What presses a body: a ball, or a tool of any shape in its orientation.

import { BufferGeometry, Float32BufferAttribute, Quaternion, SphereGeometry, Vector3 } from "three";
import type { BufferAttribute } from "three";
import type { DrawnTool, Vec3 } from "./messages";

const STRAIGHT: Vec3 = [0, 0, 0];

/** What is drawn where something presses, around its place. */
export class ToolShape {
  /** How it is turned about its place beside its own orientation: a rotation vector, rad. */
  turn: Vec3 = STRAIGHT;
  /** How far apart two jaws are, m. */
  opening = 0;

  constructor(
    readonly tool: DrawnTool | null,
    /** of a ball, m; of a tool about half its width */
    public radius: number,
  ) {}

  /** Its surface; that of a ball has the radius 1. */
  geometry(): BufferGeometry {
    const { tool } = this;
    if (!tool) return new SphereGeometry(1, 48, 32);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(tool.points, 3));
    geometry.setAttribute("normal", new Float32BufferAttribute(tool.normals, 3));
    geometry.setIndex([...tool.triangles]);
    return geometry;
  }

  /** Put two jaws that are drawn as `geometry` as far apart as they are. */
  fit(geometry: BufferGeometry): void {
    const { tool, opening } = this;
    if (!tool?.first || geometry.userData["opening"] === opening) return;
    const position = geometry.getAttribute("position") as BufferAttribute;
    for (let i = 0; i < position.count; i++) {
      const half = i < tool.first ? opening / 2 : -opening / 2;
      const [x, y, z] = tool.along.map((v, k) => tool.points[3 * i + k]! + half * v) as Vec3;
      position.setXYZ(i, x, y, z);
    }
    position.needsUpdate = true;
    geometry.computeBoundingSphere();
    geometry.userData["opening"] = opening;
  }

  /** By how much `geometry` is enlarged. */
  get size(): number {
    return this.tool ? 1 : Math.max(this.radius, 1e-9);
  }

  get turned(): Quaternion {
    const axis = new Vector3(...this.turn);
    const angle = axis.length();
    return angle > 0 ? new Quaternion().setFromAxisAngle(axis.divideScalar(angle), angle) : new Quaternion();
  }

  /** How high its place is above a plane of this normal that it just touches, m. */
  lift(normal: Vec3): number {
    const { tool } = this;
    if (!tool) return this.radius;
    const [x, y, z] = new Vector3(...normal).applyQuaternion(this.turned.invert()).toArray();
    let most = -Infinity;
    for (let i = 0; i < tool.points.length; i += 3) {
      most = Math.max(most, -(x * tool.points[i]! + y * tool.points[i + 1]! + z * tool.points[i + 2]!));
    }
    return most;
  }

  /** The way from its place to its middle, m. */
  get middle(): Vector3 {
    return new Vector3(...(this.tool?.centre ?? STRAIGHT)).applyQuaternion(this.turned);
  }

  /** How high it reaches above its place, m. */
  get height(): number {
    if (!this.tool) return this.radius;
    return this.tool.points.reduce((most, z, i) => (i % 3 === 2 ? Math.max(most, z) : most), 0);
  }

  /** Take turn and opening out of a body's further inputs. */
  follow(parameters: ArrayLike<number>): void {
    const { tool } = this;
    if (tool) this.opening = parameters[tool.opening] ?? 0;
    if (tool) this.turn = tool.turns.map((i) => (i < 0 ? 0 : parameters[i] ?? 0)) as Vec3;
  }
}
