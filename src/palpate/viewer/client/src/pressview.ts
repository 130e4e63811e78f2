// A body that is pressed, in three dimensions: what `SolidView` draws, the force as an arrow, and what lies under the
// pointer on the surface at rest.

import { DoubleSide, Mesh, MeshLambertMaterial, Raycaster, SphereGeometry, Vector2, Vector3 } from "three";
import type { Intersection } from "three";
import { Arrow } from "./arrow";
import { project } from "./framing";
import type { Press, Skin, Touched, Vec3 } from "./messages";
import { SolidView } from "./solid";
import { css } from "./units";

const STILL = new Float32Array(0);
const LONG = 0.22; // of the body's size: the arrow at the largest trained force

/** A place on the surface at rest. */
export interface Spot {
  point: Vec3; // m
  normal: Vec3; // outwards
  touchable: boolean;
}

export class PressView extends SolidView {
  readonly arrow: Arrow;
  readonly centre = new Vector3();

  private readonly hover: Mesh<SphereGeometry, MeshLambertMaterial>;
  private readonly ray = new Raycaster();
  private readonly touchable: Float32Array;

  constructor(canvas: HTMLCanvasElement, skin: Skin, hello: Touched, words: readonly Element[]) {
    super(canvas, { rest: skin.rest, triangles: skin.triangles, creases: skin.creases, fixed: STILL }, words);
    this.touchable = skin.touchable;
    this.arrow = new Arrow(LONG * this.size3(), Math.max(hello.force_max, 1e-9), hello.radius);
    this.hover = new Mesh(
      new SphereGeometry(1, 48, 32),
      new MeshLambertMaterial({ transparent: true, opacity: 0.28, depthWrite: false }),
    );
    this.hover.visible = this.arrow.group.visible = false;
    this.probe.material.opacity = 0.62;
    this.shade.geometry.computeVertexNormals();
    this.shade.material.side = DoubleSide;
    this.scene.add(this.hover, this.arrow.group);
    this.roof = 2 * hello.radius + LONG * this.size3(); // the probe and its arrow
    this.recolour();
  }

  /** Take over one picture: displacement of each point, colours by each point's share of the scale. */
  press(frame: Press, radius: number, moved: Float32Array, shares: ArrayLike<number>, layers: PressLayers): void {
    const seen = frame.grabbed;
    this.show(
      { index: 0, probed: seen, centre: frame.position, radius, displacement: moved, values: STILL },
      1,
      shares,
      { probe: true, ...layers },
    );
    this.centre.set(...frame.position);
    this.arrow.resize(radius);
    this.arrow.update(this.centre, seen ? frame.force : [0, 0, 0]);
    if (seen) this.hover.visible = false;
  }

  /** Draw where a press would begin; null draws nothing. */
  point(spot: Spot | null, radius: number): void {
    if (!spot && !this.hover.visible) return;
    this.hover.visible = spot !== null;
    if (spot) {
      this.hover.position.set(...spot.point).addScaledVector(new Vector3(...spot.normal), radius);
      this.hover.scale.setScalar(radius);
    }
    this.dirty = true;
  }

  /** What lies under a point of the canvas (CSS pixels) on the surface at rest; null beside the body. */
  spotAt(x: number, y: number): Spot | null {
    const at = new Vector2((2 * x) / this.canvas.clientWidth - 1, 1 - (2 * y) / this.canvas.clientHeight);
    this.ray.setFromCamera(at, this.camera);
    const hit: Intersection | undefined = this.ray.intersectObject(this.shade, false)[0];
    if (!hit?.normal || hit.faceIndex == null) return null;
    const normal = hit.normal.clone().normalize();
    const touchable = this.touchable[hit.faceIndex]! > 0 && this.ray.ray.direction.dot(hit.face!.normal) < 0;
    return { point: hit.point.toArray() as Vec3, normal: normal.toArray() as Vec3, touchable };
  }

  /** Where a point of the scene is on the canvas, CSS pixels. */
  project(point: Vector3): Vector2 {
    return project(this.camera, this.size(), point);
  }

  /** Where a point in body coordinates (m) is on the canvas, CSS pixels. */
  middle(point: Vec3): Vector2 {
    return this.project(new Vector3(...point));
  }

  /** Whether the mouse and fingers turn the view. */
  set turnable(on: boolean) {
    this.controls.enabled = on;
  }

  override recolour(): void {
    super.recolour();
    this.hover?.material.color.set(css("--accent-2")); // not there yet while the base class is made
    this.arrow?.recolour();
  }
}

export interface PressLayers {
  ghost: boolean;
  mesh: boolean;
}
