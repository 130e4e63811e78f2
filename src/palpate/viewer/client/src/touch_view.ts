// A solid body under a hand: pressed by a free probe, or held by a pad; the force as an arrow.

import { CylinderGeometry, DoubleSide, Mesh, MeshLambertMaterial, Plane, Vector3 } from "three";
import type { BufferGeometry, Vector2 } from "three";
import { Arrow } from "./arrow";
import { normalsInto, Target } from "./mesh";
import type { Frame, Hello, Surface, Vec3 } from "./messages";
import { SurfaceView } from "./surface_view";
import type { Layers } from "./surface_view";
import type { ToolShape } from "./tool_shape";
import { css } from "./units";

const LONG = 0.22; // of the body's size: the arrow at the largest trained force

/** A place on the surface at rest. */
export interface Spot {
  point: Vec3; // m
  normal: Vec3; // outwards
  touchable: boolean;
}

export class PressView extends SurfaceView {
  readonly arrow: Arrow;
  readonly grip = new Vector3(); // the middle of what presses

  private target: Target | null = null; // made when the pointer first comes
  private readonly resting: Float32Array; // normals of the points at rest
  private readonly hover: Mesh<BufferGeometry, MeshLambertMaterial>;
  private nearby: Vector3 | null = null; // m, of the device's centre

  constructor(
    canvas: HTMLCanvasElement,
    surface: Surface,
    protected readonly hello: Hello,
    words: readonly Element[],
    shape: ToolShape,
    before: PressView | null = null,
  ) {
    super(canvas, surface, words, before);
    this.arrow = new Arrow(LONG * this.across(), Math.max(hello.force_max, 1e-9), hello.radius);
    this.hover = new Mesh(
      shape.geometry(),
      new MeshLambertMaterial({ transparent: true, opacity: 0.28, depthWrite: false }),
    );
    this.hover.visible = this.arrow.group.visible = false;
    this.shape(shape);
    this.probe.material.opacity = 0.45; // the dent is seen through it
    this.still.material.side = DoubleSide;
    this.resting = new Float32Array(surface.rest.length);
    normalsInto(this.resting, surface.rest, this.triangles);
    this.scene.add(this.hover, this.arrow.group);
    this.roof = Math.max(2 * hello.radius, shape.height) + LONG * this.across(); // what presses, and its arrow
    this.recolour();
  }

  /** Take over one picture: displacement of each point, colours by each point's share of the scale. */
  touch(frame: Frame, shape: ToolShape, moved: Float32Array, shares: ArrayLike<number>, layers: Layers): void {
    const seen = frame.grabbed || this.hello.device !== ""; // a device's hand is seen in the air, too
    this.deform(moved, 1, shares, seen ? { centre: frame.position, shape } : null, layers);
    this.grip.set(...frame.position).add(shape.middle);
    this.arrow.resize(shape.radius);
    this.arrow.update(this.grip, seen ? frame.force : [0, 0, 0]);
    if (seen) this.hover.visible = false;
  }

  /** Draw where a press would begin; null draws nothing. */
  point(spot: Spot | null, shape: ToolShape): void {
    if (!spot && !this.hover.visible) return;
    this.hover.visible = spot !== null;
    if (spot) {
      this.hover.position.set(...spot.point).addScaledVector(new Vector3(...spot.normal), shape.lift(spot.normal));
      this.hover.scale.setScalar(shape.size);
      this.hover.quaternion.copy(shape.turned);
    }
    this.dirty = true;
  }

  /** The place on the surface at rest under a point of the canvas (CSS pixels); null beside the body. */
  spotAt(x: number, y: number): Spot | null {
    const { origin, direction } = this.ray(x, y).ray;
    const toward = direction.toArray() as Vec3;
    this.target ??= new Target(this.surface.rest, this.triangles);
    const hit = this.target.meet(origin.toArray() as Vec3, toward);
    if (!hit) return null;
    const facing = direction.dot(new Vector3(...hit.across)) < 0;
    const normal = new Vector3();
    hit.shares.forEach((share, k) => {
      const corner = 3 * this.triangles[3 * hit.triangle + k]!;
      normal.addScaledVector(new Vector3().fromArray(this.resting, corner), facing ? share : -share);
    });
    const touchable = this.surface.touchable[hit.triangle]! > 0 && facing;
    return { point: hit.point, normal: normal.normalize().toArray() as Vec3, touchable };
  }

  /** Where the touchable point at rest that is nearest to a ball's centre (m) is on the canvas, CSS pixels. */
  middle(centre: Vec3): Vector2 {
    return this.project((this.nearby ??= this.touchableNear(new Vector3(...centre))));
  }

  private touchableNear(centre: Vector3): Vector3 {
    const { rest, triangles, touchable } = this.surface;
    let [best, least] = [centre, Infinity];
    touchable.forEach((yes, t) => {
      if (!yes) return;
      const middle = new Vector3();
      for (let k = 0; k < 3; k++) middle.add(new Vector3().fromArray(rest, 3 * triangles[3 * t + k]!));
      const far = middle.divideScalar(3).distanceTo(centre);
      if (far < least) [best, least] = [middle, far];
    });
    return best;
  }

  override recolour(): void {
    super.recolour();
    this.hover?.material.color.set(css("--accent-2")); // not there yet while the base class is made
    this.arrow?.recolour();
  }
}

/** A patch that a hand holds and displaces; the surface around it is drawn at rest. */
export class PadView extends SurfaceView {
  readonly arrow: Arrow;
  readonly grip = new Vector3(); // the middle of the pad

  private readonly pad: Mesh<CylinderGeometry, MeshLambertMaterial>;
  private readonly place = new Vector3(); // at rest

  constructor(
    canvas: HTMLCanvasElement,
    surface: Surface,
    private readonly hello: Hello,
    words: readonly Element[],
  ) {
    super(canvas, surface, words);
    const { radius } = hello;
    this.arrow = new Arrow(LONG * this.across(), Math.max(hello.force_max, 1e-9), 0.4 * radius);
    const disc = new CylinderGeometry(radius, radius, 0.25 * radius, 48).rotateX(Math.PI / 2);
    this.pad = new Mesh(disc, new MeshLambertMaterial());
    [this.body.material.transparent, this.body.material.opacity] = [true, 0.6]; // a pad pushed in is seen below the face
    this.arrow.group.visible = false;
    this.scene.add(this.pad, this.arrow.group);
    this.roof = hello.deepest + LONG * this.across();
    this.recolour();
  }

  /** Take over one picture: where the pad is, its force, and the tissue around it; `shares` gets the colours' shares. */
  hold(frame: Frame, shares: Float32Array): void {
    this.place.set(...frame.contact);
    this.grip.set(...frame.position).add(this.place);
    this.deform(this.follow(frame, shares), 1, shares, null, { ghost: false, mesh: false });
    this.pad.position.copy(this.grip);
    this.arrow.update(this.grip, frame.grabbed ? frame.force : [0, 0, 0]);
  }

  /** Displacements of the tissue: that of the pad beneath it, (2/π) asin(a/r) of it around, as of a half-space under a rigid disc. */
  private follow({ position, normal }: Frame, shares: Float32Array): Float32Array {
    const { rest } = this.surface;
    const [moved, size] = [new Float32Array(rest.length), Math.hypot(...position) / this.hello.deepest];
    const [across, up] = [new Vector3(), new Vector3(...normal)];
    for (let i = 0; i < shares.length; i++) {
      across.fromArray(rest, 3 * i).sub(this.place);
      const depth = across.dot(up); // below the face, the closer to the pad the more it follows
      const far = Math.hypot(across.addScaledVector(up, -depth).length(), depth);
      const part = far > this.hello.radius ? (2 / Math.PI) * Math.asin(this.hello.radius / far) : 1;
      shares[i] = part * size;
      for (let k = 0; k < 3; k++) moved[3 * i + k] = part * position[k]!;
    }
    return moved;
  }

  /** The offset (m) of the pad from rest under a canvas point, in the plane through it that faces the camera. */
  offsetAt(x: number, y: number): Vec3 | null {
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.camera.getWorldDirection(new Vector3()), this.grip);
    const hit = this.ray(x, y).ray.intersectPlane(plane, new Vector3());
    return hit ? (hit.sub(this.place).toArray() as Vec3) : null;
  }

  /** The offset (m) at which the pad is drawn now. */
  offset(): Vec3 {
    return this.grip.clone().sub(this.place).toArray() as Vec3;
  }

  /** Make the pad answer the pointer. */
  highlight(on: boolean): void {
    const size = on ? 1.15 : 1;
    if (this.pad.scale.x === size) return;
    this.pad.scale.setScalar(size);
    this.dirty = true;
  }

  override recolour(): void {
    super.recolour();
    this.pad?.material.color.set(css("--accent")); // not there yet while the base class is made
    this.pad?.material.emissive.set(css("--accent")).multiplyScalar(0.25);
    this.arrow?.recolour();
  }
}
