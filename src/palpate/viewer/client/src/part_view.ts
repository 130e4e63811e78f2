// A part that is set up: its surface, what of it is held and touched, and how much of it a pick takes. What is held is seen through the
// body, hatched, where it lies on the far side.

import {
  BufferGeometry,
  DoubleSide,
  GreaterDepth,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MOUSE,
  Vector3,
} from "three";
import { Role } from "./messages";
import type { PartFaces, Surface, Vec3 } from "./messages";
import { SurfaceView } from "./surface_view";
import type { ToolShape } from "./tool_shape";
import { css } from "./units";

const ROOM = 0.32; // of the part's size, above it, for the ball and its arrow
const LAYERS = { ghost: false, mesh: false };

/** A place that was pointed at. */
export interface Pointed {
  triangle: number;
  point: Vec3;
  normal: Vec3;
}

export class PartView extends SurfaceView {
  readonly roles: Uint8Array;
  private readonly middles: Float32Array; // m, x y z of each triangle's middle
  private readonly normals: Float32Array; // outward unit normals of the triangles
  private readonly areas: Float32Array; // m²
  private readonly faces: Uint32Array;
  private readonly held: Mesh<BufferGeometry, MeshLambertMaterial>;
  private readonly touched: Mesh<BufferGeometry, MeshLambertMaterial>;
  private readonly asked: Mesh<BufferGeometry, MeshLambertMaterial>; // what a click would take
  private readonly behind: Mesh<BufferGeometry, MeshBasicMaterial>; // what is held, on the far side
  private readonly painted: LineSegments<BufferGeometry, LineBasicMaterial>; // of what will be touched
  private neighbours: Int32Array | null = null; // three of each triangle, -1 for none

  constructor(canvas: HTMLCanvasElement, surface: Surface, faces: PartFaces, words: readonly Element[]) {
    super(canvas, surface, words);
    this.roles = Uint8Array.from(faces.roles);
    this.faces = Uint32Array.from(faces.faces);
    const count = surface.triangles.length / 3;
    [this.middles, this.normals, this.areas] = [
      new Float32Array(3 * count),
      new Float32Array(3 * count),
      new Float32Array(count),
    ];
    this.measure();
    const still = new Float32Array(surface.rest.length);
    this.deform(still, 1, new Float32Array(still.length / 3), null, LAYERS);
    [this.held, this.touched, this.asked] = [this.overlay(), this.overlay(), this.overlay()];
    this.behind = new Mesh(this.held.geometry, hatched());
    this.behind.frustumCulled = false;
    this.behind.renderOrder = 2; // after the surfaces, behind which it lies
    this.painted = this.border();
    this.scene.add(this.held, this.touched, this.asked, this.behind, this.painted);
    this.probe.material.opacity = 0.5;
    this.recolour();
    this.refresh();
  }

  /** The place of the surface under a point of the canvas (CSS pixels); null beside the part. */
  pointed(x: number, y: number): Pointed | null {
    const hit = this.ray(x, y).intersectObject(this.body, false)[0];
    if (!hit || hit.faceIndex == null) return null;
    return { triangle: hit.faceIndex, point: hit.point.toArray() as Vec3, normal: this.normal(hit.faceIndex) };
  }

  /** Triangles of the face that a triangle belongs to. */
  face(triangle: number): number[] {
    return this.ofFace(this.faces[triangle]!);
  }

  ofFace(face: number): number[] {
    return this.where((t) => this.faces[t] === face);
  }

  /** Triangles around one that hang together and whose normals differ from its own by no more than an angle. */
  patch(triangle: number, degrees: number): number[] {
    const [n, least] = [this.normal(triangle), Math.cos((degrees * Math.PI) / 180) - 1e-6];
    const next = (this.neighbours ??= this.adjacent());
    const seen = new Set([triangle]);
    for (const t of seen) {
      for (let k = 0; k < 3; k++) {
        const other = next[3 * t + k]!;
        if (other >= 0 && !seen.has(other) && dot(this.normal(other), n) >= least) seen.add(other);
      }
    }
    return [...seen];
  }

  /** Triangles within a distance (m) of a place that face its way. */
  near({ triangle, point, normal }: Pointed, radius: number): number[] {
    const close = this.where((t) => {
      const away = Math.hypot(...[0, 1, 2].map((k) => this.middles[3 * t + k]! - point[k]!));
      return away <= radius && dot(this.normal(t), normal) > 0;
    });
    return close.length ? close : [triangle];
  }

  /** All triangles that face up within 60°, or lie in the lowest eighth of the height, or have no role yet. */
  all(kind: "up" | "low" | "rest"): number[] {
    const [low, high] = this.heights();
    if (kind === "rest") return this.where((t) => this.roles[t] === Role.FREE);
    if (kind === "up") return this.where((t) => this.normals[3 * t + 2]! >= 0.5);
    return this.where((t) => this.middles[3 * t + 2]! <= low + 0.12 * (high - low));
  }

  assign(triangles: readonly number[], role: number): void {
    for (const t of triangles) this.roles[t] = role;
    this.refresh();
  }

  /** Mark the triangles that a click would take. */
  ask(triangles: readonly number[]): void {
    this.pick(this.asked, triangles);
    this.dirty = true;
  }

  /** Area with a role, m². */
  area(role: number): number {
    return this.areas.reduce((sum, area, t) => sum + (this.roles[t] === role ? area : 0), 0);
  }

  /** The role of all of a face; -1 where it has several. */
  roleOf(face: number): number {
    const mine = this.ofFace(face);
    const first = this.roles[mine[0] ?? 0]!;
    return mine.every((t) => this.roles[t] === first) ? first : -1;
  }

  /** Show what presses where it would touch; null hides it. */
  press(at: Pointed | null, shape: ToolShape): void {
    if (!at && !this.probe.visible) return;
    this.probe.visible = at !== null && (shape.tool !== null || shape.radius > 0);
    if (at && this.probe.visible) {
      this.probe.position.set(...at.point).addScaledVector(new Vector3(...at.normal), shape.lift(at.normal));
      this.probe.scale.setScalar(shape.size);
    }
    this.dirty = true;
  }

  /** The place in the middle of what is touched; null where nothing is. */
  middle(): Pointed | null {
    const touched = this.where((t) => this.roles[t] === Role.TOUCHED);
    if (!touched.length) return null;
    const mean = new Vector3();
    let whole = 0;
    for (const t of touched) {
      mean.addScaledVector(new Vector3().fromArray(this.middles, 3 * t), this.areas[t]!);
      whole += this.areas[t]!;
    }
    mean.divideScalar(whole);
    const far = (t: number): number => new Vector3().fromArray(this.middles, 3 * t).distanceTo(mean);
    const triangle = touched.reduce((best, t) => (far(t) < far(best) ? t : best));
    const normal = this.normal(triangle);
    const above = mean.sub(new Vector3().fromArray(this.middles, 3 * triangle));
    const n = new Vector3(...normal);
    const point = above.addScaledVector(n, -above.dot(n)).add(new Vector3().fromArray(this.middles, 3 * triangle));
    return { triangle, point: point.toArray() as Vec3, normal };
  }

  /** Let the left button and one finger turn the view, or leave them to the brush. */
  set brushing(on: boolean) {
    this.controls.mouseButtons.LEFT = on ? null : MOUSE.ROTATE;
    this.controls.enabled = !on;
  }

  /** Where a triangle's middle is on the canvas, CSS pixels: for programs that drive the page. */
  spot(triangle: number): { x: number; y: number } {
    return this.project(new Vector3(...this.middles.subarray(3 * triangle, 3 * triangle + 3)));
  }

  /** Leave room above the part for what is drawn there once it is touched, so that nothing moves then. */
  leaveRoom(): void {
    this.roof = ROOM * this.across();
    this.look();
  }

  /** The size of the part, m. */
  get extent(): number {
    return this.across();
  }

  override recolour(): void {
    super.recolour();
    this.held?.material.color.set(css("--accent-2")); // not there yet while the base class is made
    this.touched?.material.color.set(css("--accent"));
    this.asked?.material.color.set(css("--warn"));
    this.behind?.material.color.set(css("--accent-2"));
    this.painted?.material.color.set(css("--ink"));
    this.probe.material.color.set(css("--ink")); // it stands on what has its usual colour
    this.probe.material.emissive.set(css("--ink")).multiplyScalar(0.1);
  }

  private refresh(): void {
    for (const [mesh, role] of [
      [this.held, Role.HELD],
      [this.touched, Role.TOUCHED],
    ] as const) {
      this.pick(mesh, this.where((t) => this.roles[t] === role));
    }
    this.pick(this.asked, []);
    this.painted.geometry.setIndex(this.edges(Role.TOUCHED));
    this.behind.visible = this.held.visible;
    this.dirty = true;
  }

  /** Let a second skin cover some triangles. */
  private pick(mesh: Mesh, chosen: readonly number[]): void {
    const { triangles } = this.surface;
    mesh.geometry.setIndex(chosen.flatMap((t) => [...triangles.subarray(3 * t, 3 * t + 3)]));
    mesh.visible = chosen.length > 0;
  }

  /** A second skin on the part's own points, for some of its triangles. */
  private overlay(): Mesh<BufferGeometry, MeshLambertMaterial> {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", this.geometry.getAttribute("position"));
    geometry.setAttribute("normal", this.geometry.getAttribute("normal"));
    const material = new MeshLambertMaterial({ transparent: true, opacity: 0.78 });
    const mesh = new Mesh(geometry, material);
    mesh.frustumCulled = false;
    return mesh;
  }

  /** The line around what has a role, on the part's own points. */
  private border(): LineSegments<BufferGeometry, LineBasicMaterial> {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", this.geometry.getAttribute("position"));
    const lines = new LineSegments(geometry, new LineBasicMaterial());
    lines.frustumCulled = false;
    lines.renderOrder = 1; // over the skins, on whose edges it lies
    return lines;
  }

  /** Pairs of points: the edges between triangles with a role and others. */
  private edges(role: number): number[] {
    const { triangles } = this.surface;
    const next = (this.neighbours ??= this.adjacent());
    const pairs: number[] = [];
    for (let i = 0; i < triangles.length; i++) {
      if (this.roles[Math.floor(i / 3)] !== role) continue;
      const other = next[i]!;
      if (other >= 0 && this.roles[other] === role) continue;
      pairs.push(triangles[i]!, triangles[i % 3 === 2 ? i - 2 : i + 1]!);
    }
    return pairs;
  }

  private measure(): void {
    const { rest, triangles } = this.surface;
    const at = (i: number): Vector3 => new Vector3().fromArray(rest, 3 * triangles[i]!);
    for (let t = 0; t < this.areas.length; t++) {
      const [a, b, c] = [at(3 * t), at(3 * t + 1), at(3 * t + 2)];
      const across = new Vector3().subVectors(b, a).cross(new Vector3().subVectors(c, a));
      this.areas[t] = across.length() / 2;
      across.normalize().toArray(this.normals, 3 * t);
      a.add(b).add(c).divideScalar(3).toArray(this.middles, 3 * t);
    }
  }

  /** Triangles that share an edge of the smooth surface. */
  private adjacent(): Int32Array {
    const { triangles } = this.surface;
    const next = new Int32Array(triangles.length).fill(-1);
    const open = new Map<string, number>();
    for (let i = 0; i < triangles.length; i++) {
      const [a, b] = [triangles[i]!, triangles[i % 3 === 2 ? i - 2 : i + 1]!];
      const other = open.get(`${b} ${a}`);
      if (other === undefined) open.set(`${a} ${b}`, i);
      else [next[i], next[other]] = [Math.floor(other / 3), Math.floor(i / 3)];
    }
    return next;
  }

  private heights(): [number, number] {
    const z = this.surface.rest.filter((_, i) => i % 3 === 2);
    return [z.reduce((a, b) => Math.min(a, b)), z.reduce((a, b) => Math.max(a, b))];
  }

  private normal(t: number): Vec3 {
    return [this.normals[3 * t]!, this.normals[3 * t + 1]!, this.normals[3 * t + 2]!];
  }

  private where(test: (triangle: number) => boolean): number[] {
    const chosen: number[] = [];
    for (let t = 0; t < this.roles.length; t++) if (test(t)) chosen.push(t);
    return chosen;
  }
}

/** Stripes of the picture's own pixels, drawn only where something lies in front. */
function hatched(): MeshBasicMaterial {
  const material = new MeshBasicMaterial({ transparent: true, opacity: 0.5, depthWrite: false, side: DoubleSide });
  material.depthFunc = GreaterDepth;
  material.onBeforeCompile = (shader) => {
    const stripes = "if (mod(gl_FragCoord.x + gl_FragCoord.y, 12.0) > 4.0) discard;";
    shader.fragmentShader = shader.fragmentShader.replace("#include <clipping_planes_fragment>", stripes);
  };
  return material;
}

function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
