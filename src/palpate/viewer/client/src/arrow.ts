// The force on the hand as an arrow at the held node.

import { ConeGeometry, CylinderGeometry, Group, Mesh, MeshLambertMaterial, Vector3 } from "three";
import { css } from "./units";

const UP = new Vector3(0, 1, 0);

export class Arrow {
  readonly group = new Group();
  readonly end = new Vector3();
  private readonly shaft: Mesh;
  private readonly head: Mesh;
  private readonly material = new MeshLambertMaterial();
  private readonly direction = new Vector3();

  /** `length`: of the arrow at the force `full` (N), m; `gap`: from the node to the arrow's start, m. */
  constructor(
    private readonly length: number,
    private readonly full: number,
    private gap: number,
  ) {
    const width = 0.021 * length;
    this.shaft = new Mesh(new CylinderGeometry(width, width, 1, 12).translate(0, 0.5, 0), this.material);
    this.head = new Mesh(new ConeGeometry(2.9 * width, 8 * width, 20).translate(0, -4 * width, 0), this.material);
    this.group.add(this.shaft, this.head);
    this.recolour();
  }

  recolour(): void {
    this.material.color.set(css("--accent"));
    this.material.emissive.set(css("--accent")).multiplyScalar(0.35);
  }

  /** Change the gap (m) between node and arrow. */
  resize(gap: number): void {
    this.gap = gap;
  }

  /** Point it; a force too small to see is not drawn. */
  update(at: Vector3, force: readonly [number, number, number]): void {
    const size = Math.hypot(...force);
    const long = (this.length * size) / this.full;
    this.group.visible = long > 0.004 * this.length;
    if (!this.group.visible) return;
    this.direction.set(...force).divideScalar(size);
    this.group.quaternion.setFromUnitVectors(UP, this.direction);
    this.group.position.copy(at).addScaledVector(this.direction, this.gap);
    const head = Math.min(1, (2.5 * long) / this.length);
    this.head.scale.setScalar(head);
    this.head.position.y = long;
    this.shaft.scale.y = Math.max(long - 0.16 * this.length * head, 1e-6);
    this.end.copy(at).addScaledVector(this.direction, this.gap + long);
  }
}
