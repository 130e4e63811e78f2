// The 3-D view: the body, its ghost at rest, the hand, the force. Rendered only when something changed.

import {
  BufferGeometry,
  Color,
  DirectionalLight,
  HemisphereLight,
  LessDepth,
  Line,
  LineBasicMaterial,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MOUSE,
  PerspectiveCamera,
  Plane,
  Raycaster,
  Scene,
  SphereGeometry,
  TOUCH,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import type { Group } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Arrow } from "./arrow";
import { fit, free, outline, pixel, project } from "./framing";
import type { Size } from "./framing";
import type { Frame, Hello, Vec3 } from "./messages";
import { sizeLabels, surroundings } from "./surroundings";
import type { Extent } from "./surroundings";
import { Tube } from "./tube";
import { css, round125 } from "./units";

const THINNEST = 0.011; // radius as drawn, of the length: thinner would be lost on a small screen
const LIVELY = 0.1; // a reach below this share of the length is drawn enlarged
const LIVELY_AIM = 0.3;

export class View {
  enlarged = 1; // displacement as drawn / true displacement
  readonly thickened: number;
  readonly enlargement: number;
  readonly extent: Extent;
  readonly tip = new Vector3();
  readonly arrow: Arrow;

  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(30, 1, 0.01, 100);
  private readonly controls: OrbitControls;
  private readonly tube: Tube;
  private readonly ghost: Mesh;
  private readonly shadow: Mesh;
  private readonly handle: Mesh<SphereGeometry, MeshLambertMaterial>;
  private readonly hand: Mesh<SphereGeometry, MeshLambertMaterial>;
  private readonly thread = new Line(new BufferGeometry(), new LineBasicMaterial());
  private readonly beads: Mesh<SphereGeometry, MeshLambertMaterial>[];
  private around: Group | null = null;
  private readonly rest: Float32Array;
  private readonly points: Float32Array;
  private readonly shares: Float32Array;
  private readonly length: number;
  private dirty = true;

  constructor(
    readonly canvas: HTMLCanvasElement,
    readonly hello: Hello,
    private readonly words: readonly Element[], // that stand in front of the canvas
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.rest = Float32Array.from(hello.rest.flat());
    this.points = new Float32Array(this.rest.length);
    this.shares = new Float32Array(hello.rest.length);
    const xs = hello.rest.map((p) => p[0]);
    this.length = Math.max(...xs) - Math.min(...xs) || hello.reach;
    const lively = hello.reach < LIVELY * this.length;
    this.enlargement = lively ? round125((LIVELY_AIM * this.length) / hello.reach) : 1;
    this.enlarged = this.enlargement;
    this.thickened = Math.max(1, Math.ceil((THINNEST * this.length) / hello.radius));
    const cell = round125(this.length / 14);
    const depth = Math.round((0.2 * this.length) / cell) * cell;
    this.extent = { root: Math.min(...xs), length: this.length, floor: 0, cell, depth };

    const radius = this.thickened * hello.radius;
    this.tube = new Tube(hello.rest.length, radius);
    const ball = Math.max(1.9 * radius, 0.022 * this.length);
    this.handle = new Mesh(new SphereGeometry(ball, 28, 18), new MeshLambertMaterial());
    this.hand = new Mesh(new SphereGeometry(0.5 * ball, 18, 12), new MeshLambertMaterial());
    const bead = new SphereGeometry(1.25 * radius, 18, 12);
    const beads = hello.nodes_of_interest.filter((i) => i !== hello.touch_node);
    this.beads = beads.map(() => new Mesh(bead, new MeshLambertMaterial()));
    this.arrow = new Arrow(0.3 * this.length, fullForce(hello), 1.15 * ball);
    this.ghost = new Mesh(this.restGeometry(radius), ghostMaterial());
    this.shadow = new Mesh(this.tube.geometry, shadowMaterial());
    this.shadow.matrixAutoUpdate = false;
    this.assemble();
    this.controls = this.orbit();
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

  /** Take over one frame's shape; true force, drawn displacement. */
  show(frame: Frame): void {
    const { rest, points, shares, hello, enlarged } = this;
    const u = frame.displacement;
    for (let i = 0; i < shares.length; i++) {
      const size = Math.hypot(u[3 * i]!, u[3 * i + 1]!, u[3 * i + 2]!);
      shares[i] = size / hello.reach;
      for (let k = 3 * i; k < 3 * i + 3; k++) points[k] = rest[k]! + enlarged * u[k]!;
    }
    this.tube.update(points, shares);
    this.each((bead, node) => bead.position.fromArray(points, 3 * node));
    this.drawn(frame.contact, this.tip);
    this.handle.position.copy(this.tip);
    this.drawn(frame.position, this.hand.position);
    const apart = frame.grabbed && this.hand.position.distanceTo(this.tip) > 0.004 * this.length;
    this.hand.visible = this.thread.visible = apart;
    if (apart) this.thread.geometry.setFromPoints([this.tip, this.hand.position]);
    this.arrow.update(this.tip, frame.force);
    this.dirty = true;
  }

  /** Render if anything changed since. */
  render(): boolean {
    if (!this.dirty) return false;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
    return true;
  }

  /** Where a point of the scene is on the canvas, CSS pixels. */
  project(point: Vector3): Vector2 {
    return project(this.camera, this.size(), point);
  }

  /** The offset of the held node (m, true) under a canvas point, in the plane of the body; null beside it. */
  offsetAt(x: number, y: number): Vec3 | null {
    const at = new Vector2((2 * x) / this.canvas.clientWidth - 1, 1 - (2 * y) / this.canvas.clientHeight);
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera);
    const node = this.node();
    const hit = ray.ray.intersectPlane(new Plane(new Vector3(0, 0, 1), -node.z), new Vector3());
    if (!hit) return null;
    hit.sub(node).divideScalar(this.enlarged);
    return [hit.x, hit.y, 0];
  }

  /** Whether right-drag, wheel and two fingers turn the view. */
  set turnable(on: boolean) {
    this.controls.enabled = on;
  }

  /** Make the handle answer the pointer. */
  highlight(on: boolean): void {
    const size = on ? 1.22 : 1;
    if (this.handle.scale.x === size) return;
    this.handle.scale.setScalar(size);
    this.dirty = true;
  }

  resize(): void {
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.sizeLabels();
    this.dirty = true;
  }

  /** Look from the front, a little from above, with all that the held node can do in the picture. */
  look(): void {
    const room = free(this.canvas, this.words);
    const { centre, distance } = fit(this.camera, this.size(), room, outline(this.extent, ...this.room()));
    this.controls.target.copy(centre);
    [this.camera.near, this.camera.far] = [distance / 50, distance * 20];
    [this.controls.minDistance, this.controls.maxDistance] = [0.1 * distance, 4 * distance];
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.dirty = true;
  }

  /** Take the theme's colours. */
  recolour(): void {
    if (this.around) this.scene.remove(this.around);
    this.around = surroundings(this.extent);
    this.scene.add(this.around);
    this.sizeLabels();
    this.handle.material.color.set(css("--accent"));
    this.handle.material.emissive.set(css("--accent")).multiplyScalar(0.3);
    this.each((bead) => bead.material.color.set(css("--bead")));
    this.hand.material.color.set(css("--accent-2"));
    this.hand.material.emissive.set(css("--accent-2")).multiplyScalar(0.3);
    this.thread.material.color.set(css("--accent-2"));
    (this.ghost.material as MeshBasicMaterial).color.set(css("--soft"));
    this.arrow.recolour();
    this.dirty = true;
  }

  private assemble(): void {
    const body = new Mesh(this.tube.geometry, new MeshLambertMaterial({ vertexColors: true }));
    body.frustumCulled = this.shadow.frustumCulled = this.thread.frustumCulled = false;
    this.scene.add(body, this.ghost, this.shadow, this.handle, this.hand, this.thread, this.arrow.group, ...this.beads);
    this.scene.add(new HemisphereLight(new Color(0xffffff), new Color(0xb9c4cc), 2.3));
    const sun = new DirectionalLight(0xffffff, 1.5);
    sun.position.set(-0.5, 1.5, 1.2);
    this.scene.add(sun);
    this.hand.visible = this.thread.visible = this.arrow.group.visible = false;
  }

  private orbit(): OrbitControls {
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.mouseButtons = { LEFT: null, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.ROTATE };
    controls.touches = { ONE: null, TWO: TOUCH.DOLLY_ROTATE };
    controls.enablePan = false;
    // seen edge-on, the plane in which the hand moves would vanish
    [controls.minAzimuthAngle, controls.maxAzimuthAngle] = [-1.2, 1.2];
    [controls.minPolarAngle, controls.maxPolarAngle] = [0.5, 1.7];
    controls.addEventListener("change", () => (this.dirty = true));
    return controls;
  }

  private size(): Size {
    return [this.canvas.clientWidth || 1, this.canvas.clientHeight || 1];
  }

  private sizeLabels(): void {
    if (this.around) sizeLabels(this.around, pixel(this.camera, this.size()));
  }

  /** Opposite corners of the box that the ball at the held node may fill, as drawn. */
  private room(): [Vector3, Vector3] {
    const [low, high] = this.hello.travel.map((corner) => this.drawn(corner, new Vector3()));
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
    const tube = new Tube(this.hello.rest.length, 0.9 * radius);
    tube.update(this.rest, this.shares);
    return tube.geometry;
  }

  /** Visit the beads that mark the nodes of interest. */
  private each(visit: (bead: Mesh<SphereGeometry, MeshLambertMaterial>, node: number) => void): void {
    const nodes = this.hello.nodes_of_interest.filter((i) => i !== this.hello.touch_node);
    this.beads.forEach((bead, k) => visit(bead, nodes[k]!));
  }

  private node(): Vector3 {
    return new Vector3(...this.hello.rest[this.hello.touch_node]!);
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

/** The largest load that the hand can be asked to supply, N. */
function fullForce(hello: Hello): number {
  const others = new Set(hello.parameters.map((r) => r.name));
  const own = hello.inputs.filter((r) => !others.has(r.name));
  return Math.max(...own.map((r) => Math.max(Math.abs(r.low), Math.abs(r.high))), 1e-9);
}
