// A body held at one node and drawn as a line, y up: the tube, its ghost at rest, the hand, the force.

import {
  BufferGeometry,
  LessDepth,
  Line as ThreeLine,
  LineBasicMaterial,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MOUSE,
  Plane,
  SphereGeometry,
  TOUCH,
  Vector3,
} from "three";
import type { Group } from "three";
import { Arrow } from "./arrow";
import { outline, pixel } from "./framing";
import type { Frame, Hello, Line, Vec3 } from "./messages";
import { sizeLabels, surroundings } from "./surroundings";
import type { Extent } from "./surroundings";
import { Tube } from "./tube";
import { css, round125, tidy } from "./units";
import { View } from "./view";

const THINNEST = 0.011; // radius as drawn, of the length: thinner would be lost on a small screen
const LIVELY = 0.1; // a reach below this share of the length is drawn enlarged
const LIVELY_AIM = 0.3;
const STANCE = {
  up: new Vector3(0, 1, 0),
  from: new Vector3(0.16, 0.2, 1).normalize(),
  sky: 2.3,
  sun: 1.5,
  sunFrom: new Vector3(-0.5, 1.5, 1.2),
};

export class LineView extends View {
  enlarged = 1; // displacement as drawn / true displacement
  readonly enlargement: number;
  readonly grip = new Vector3(); // where the held node is drawn
  readonly arrow: Arrow;

  private readonly line: Line;
  private readonly thickened: number;
  private readonly extent: Extent;
  private readonly tube: Tube;
  private readonly ghost: Mesh;
  private readonly shadow: Mesh;
  private readonly handle: Mesh<SphereGeometry, MeshLambertMaterial>;
  private readonly hand: Mesh<SphereGeometry, MeshLambertMaterial>;
  private readonly thread = new ThreeLine(new BufferGeometry(), new LineBasicMaterial());
  private readonly beads: Mesh<SphereGeometry, MeshLambertMaterial>[];
  private around: Group | null = null;
  private readonly rest: Float32Array;
  private readonly points: Float32Array;
  private readonly shares: Float32Array;
  private readonly length: number;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly hello: Hello,
    words: readonly Element[],
  ) {
    super(canvas, words, STANCE);
    const line = (this.line = hello.line!);
    this.rest = Float32Array.from(line.rest.flat());
    this.points = new Float32Array(this.rest.length);
    this.shares = new Float32Array(line.rest.length);
    const xs = line.rest.map((p) => p[0]);
    this.length = Math.max(...xs) - Math.min(...xs) || hello.deepest;
    const lively = hello.deepest < LIVELY * this.length;
    this.enlargement = lively ? round125((LIVELY_AIM * this.length) / hello.deepest) : 1;
    this.enlarged = this.enlargement;
    this.thickened = Math.max(1, Math.ceil((THINNEST * this.length) / hello.radius));
    const cell = round125(this.length / 14);
    const depth = Math.round((0.2 * this.length) / cell) * cell;
    this.extent = { root: Math.min(...xs), length: this.length, floor: 0, cell, depth };

    const radius = this.thickened * hello.radius;
    this.tube = new Tube(line.rest.length, radius);
    const ball = Math.max(1.9 * radius, 0.022 * this.length);
    this.handle = new Mesh(new SphereGeometry(ball, 28, 18), new MeshLambertMaterial());
    this.hand = new Mesh(new SphereGeometry(0.5 * ball, 18, 12), new MeshLambertMaterial());
    const bead = new SphereGeometry(1.25 * radius, 18, 12);
    this.beads = this.marked().map(() => new Mesh(bead, new MeshLambertMaterial()));
    this.arrow = new Arrow(0.3 * this.length, Math.max(hello.force_max, 1e-9), 1.15 * ball);
    this.ghost = new Mesh(this.restGeometry(radius), ghostMaterial());
    this.shadow = new Mesh(this.tube.geometry, shadowMaterial());
    this.shadow.matrixAutoUpdate = false;
    this.assemble();
    this.hold();
    this.place();
    this.recolour();
    this.resize();
    this.look();
  }

  /** Show the displacements at `factor` times their size. */
  enlarge(factor: number): void {
    this.enlarged = factor;
    this.place();
    this.recolour();
    this.look();
  }

  /** Notes on how it is drawn. */
  notes(): string[] {
    const times = (n: number): string => (n === 1 ? "to scale" : `drawn × ${tidy(n)}`);
    return [`displacement ${times(this.enlarged)}`, `thickness ${times(this.thickened)}`, "bands: nodes of interest"];
  }

  /** Take over one frame's shape; true force, drawn displacement. */
  show(frame: Frame): void {
    const { rest, points, shares, hello, enlarged } = this;
    const u = frame.displacement;
    for (let i = 0; i < shares.length; i++) {
      const size = Math.hypot(u[3 * i]!, u[3 * i + 1]!, u[3 * i + 2]!);
      shares[i] = size / hello.deepest;
      for (let k = 3 * i; k < 3 * i + 3; k++) points[k] = rest[k]! + enlarged * u[k]!;
    }
    this.tube.update(points, shares);
    this.marked().forEach((node, k) => this.beads[k]!.position.fromArray(points, 3 * node));
    this.drawn(frame.contact, this.grip);
    this.handle.position.copy(this.grip);
    this.drawn(frame.position, this.hand.position);
    const apart = frame.grabbed && this.hand.position.distanceTo(this.grip) > 0.004 * this.length;
    this.hand.visible = this.thread.visible = apart;
    if (apart) this.thread.geometry.setFromPoints([this.grip, this.hand.position]);
    this.arrow.update(this.grip, frame.force);
    this.dirty = true;
  }

  /** The offset of the held node (m, true) under a canvas point, in the plane of the body; null beside it. */
  offsetAt(x: number, y: number): Vec3 | null {
    const node = this.node();
    const hit = this.ray(x, y).ray.intersectPlane(new Plane(new Vector3(0, 0, 1), -node.z), new Vector3());
    if (!hit) return null;
    hit.sub(node).divideScalar(this.enlarged);
    return [hit.x, hit.y, 0];
  }

  /** The offset (m, true) at which the held node is drawn now. */
  offset(): Vec3 {
    return this.grip.clone().sub(this.node()).divideScalar(this.enlarged).toArray() as Vec3;
  }

  /** Make the handle answer the pointer. */
  highlight(on: boolean): void {
    const size = on ? 1.22 : 1;
    if (this.handle.scale.x === size) return;
    this.handle.scale.setScalar(size);
    this.dirty = true;
  }

  override resize(): void {
    super.resize();
    this.sizeLabels();
  }

  override recolour(): void {
    if (this.around) this.scene.remove(this.around);
    this.around = surroundings(this.extent);
    this.scene.add(this.around);
    this.sizeLabels();
    this.handle.material.color.set(css("--accent"));
    this.handle.material.emissive.set(css("--accent")).multiplyScalar(0.3);
    for (const bead of this.beads) bead.material.color.set(css("--bead"));
    this.hand.material.color.set(css("--accent-2"));
    this.hand.material.emissive.set(css("--accent-2")).multiplyScalar(0.3);
    this.thread.material.color.set(css("--accent-2"));
    (this.ghost.material as MeshBasicMaterial).color.set(css("--soft"));
    this.arrow.recolour();
    this.dirty = true;
  }

  protected override outline(): Vector3[] {
    return outline(this.extent, ...this.room());
  }

  private assemble(): void {
    const body = new Mesh(this.tube.geometry, new MeshLambertMaterial({ vertexColors: true }));
    body.frustumCulled = this.shadow.frustumCulled = this.thread.frustumCulled = false;
    this.scene.add(body, this.ghost, this.shadow, this.handle, this.hand, this.thread, this.arrow.group, ...this.beads);
    this.hand.visible = this.thread.visible = this.arrow.group.visible = false;
  }

  /** The left button is the hand's, and the view stays in front. */
  private hold(): void {
    const { controls } = this;
    const device = this.hello.device !== "";
    controls.mouseButtons = { LEFT: device ? MOUSE.ROTATE : null, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.ROTATE };
    controls.touches = { ONE: device ? TOUCH.ROTATE : null, TWO: TOUCH.DOLLY_ROTATE };
    controls.enablePan = false;
    // seen edge-on, the plane in which the hand moves would vanish
    [controls.minAzimuthAngle, controls.maxAzimuthAngle] = [-1.2, 1.2];
    [controls.minPolarAngle, controls.maxPolarAngle] = [0.5, 1.7];
  }

  private sizeLabels(): void {
    if (this.around) sizeLabels(this.around, pixel(this.camera, this.size()));
  }

  /** Opposite corners of the box that the ball at the held node may fill, as drawn. */
  private room(): [Vector3, Vector3] {
    const [low, high] = this.line.travel.map((corner) => this.drawn(corner, new Vector3()));
    const ball = 1.3 * this.handle.geometry.parameters.radius; // a highlighted one is larger
    return [low!.subScalar(ball), high!.addScalar(ball)];
  }

  /** Put floor and shadow where the enlarged motion leaves room. */
  private place(): void {
    const lowest = Math.max(-this.room()[0].y, 0.35 * this.length);
    this.extent.floor = -Math.ceil(lowest / this.extent.cell - 1e-9) * this.extent.cell;
    const flat = new Matrix4().makeScale(1, 0, 1).setPosition(0, this.extent.floor + 1e-3 * this.length, 0);
    this.shadow.matrix.copy(flat);
  }

  private restGeometry(radius: number): BufferGeometry {
    const tube = new Tube(this.line.rest.length, 0.9 * radius);
    tube.update(this.rest, this.shares);
    return tube.geometry;
  }

  /** The nodes that beads mark. */
  private marked(): number[] {
    return this.line.nodes_of_interest.filter((i) => i !== this.line.touch_node);
  }

  private node(): Vector3 {
    return new Vector3(...this.line.rest[this.line.touch_node]!);
  }

  private drawn(offset: Vec3, into: Vector3): Vector3 {
    return into.set(...offset).multiplyScalar(this.enlarged).add(this.node());
  }
}

function ghostMaterial(): MeshBasicMaterial {
  return new MeshBasicMaterial({ transparent: true, opacity: 0.16, depthWrite: false });
}

/** The body squeezed flat on the floor; the strict depth test keeps its two sides from darkening twice. */
function shadowMaterial(): MeshBasicMaterial {
  return new MeshBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.13, depthFunc: LessDepth });
}
