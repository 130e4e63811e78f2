// A solid body, z up: its deformed surface, its outline at rest, the probe, a floor with a scale.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  FrontSide,
  Float32BufferAttribute,
  InstancedMesh,
  LessDepth,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshPhongMaterial,
  NotEqualStencilFunc,
  ReplaceStencilOp,
  SphereGeometry,
  Vector3,
} from "three";
import { palette } from "./colour";
import { normalsInto } from "./mesh";
import type { Surface, Vec3 } from "./messages";
import type { ToolShape } from "./tool_shape";
import { css, round125 } from "./units";
import { View } from "./view";

const STANCE = {
  up: new Vector3(0, 0, 1),
  from: new Vector3(0.62, -1, 0.72).normalize(),
  sky: 1.6,
  sun: 2.4,
  sunFrom: new Vector3(-1.1, -0.55, 1.0), // low, so that a shallow dent has a bright and a dark side
};

const UNKNOWN = -0.5; // a share below it means that nothing is known there
const UNTOUCHED = -1.5; // and below this one, that nobody touches it
const OPEN = 1e-4; // sum of a surface's area vectors over its area, from which on it has a border
const DOT = 0.006; // of the body's size, radius of a dot

export interface Layers {
  ghost: boolean;
  mesh: boolean;
}

/** A rigid ball or tool at its place, m; null where there is none to draw. */
export interface Probe {
  centre: Vec3;
  shape: ToolShape;
}

export class SurfaceView extends View {
  readonly cell: number; // m, spacing of the floor's grid

  protected readonly geometry = new BufferGeometry();
  protected readonly triangles: Uint32Array;
  private readonly position: BufferAttribute;
  private readonly facing: BufferAttribute;
  private readonly colour: BufferAttribute;
  protected readonly body: Mesh<BufferGeometry, MeshPhongMaterial>;
  private readonly wires: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly creases: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly ghost: LineSegments<BufferGeometry, LineBasicMaterial>;
  protected readonly still: Mesh<BufferGeometry, MeshBasicMaterial>; // the surface at rest
  private readonly fixed: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly floor: LineSegments<BufferGeometry, LineBasicMaterial>;
  protected readonly probe: Mesh<BufferGeometry, MeshLambertMaterial>;
  private colours = numbers(palette());
  private readonly unknown = new Color();
  private readonly untouched = new Color();
  private readonly low = new Vector3().setScalar(Infinity);
  private readonly high = new Vector3().setScalar(-Infinity);
  private dots: InstancedMesh<SphereGeometry, MeshBasicMaterial> | null = null;
  private marks: { place: Vec3; nearest: number }[] = [];
  protected roof: number; // m, room that a view leaves above the body

  constructor(
    canvas: HTMLCanvasElement,
    protected readonly surface: Surface,
    words: readonly Element[],
    before: View | null = null,
  ) {
    super(canvas, words, STANCE, before);
    const { rest } = surface;
    this.triangles = Uint32Array.from(surface.triangles);
    this.position = new BufferAttribute(Float32Array.from(rest), 3);
    this.facing = new BufferAttribute(new Float32Array(rest.length), 3);
    this.colour = new BufferAttribute(new Float32Array(rest.length), 3);
    this.geometry.setAttribute("position", this.position);
    this.geometry.setAttribute("normal", this.facing); // a material that first sees a geometry without normals stays flat
    this.geometry.setAttribute("color", this.colour);
    this.geometry.setIndex(new BufferAttribute(this.triangles, 1));
    normalsInto(this.facing.array as Float32Array, rest, this.triangles);
    this.body = new Mesh(
      this.geometry,
      new MeshPhongMaterial({ vertexColors: true, side: closed(rest, this.triangles) ? FrontSide : DoubleSide, shininess: 24, specular: 0x1c1c1c }),
    );
    outlined(this.body.material);
    // pulled a little towards the camera, so that the lines on the surface are not half lost in it
    this.body.material.polygonOffset = true;
    [this.body.material.polygonOffsetFactor, this.body.material.polygonOffsetUnits] = [1, 1];
    this.wires = new Mesh(this.geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.22 }));
    this.creases = this.lines(surface.creases, this.position);
    const still = new BufferAttribute(rest, 3);
    this.ghost = this.lines(surface.creases, still);
    // where the body did not move, its own edges win
    [this.ghost.material.transparent, this.ghost.material.depthFunc] = [true, LessDepth];
    this.fixed = this.lines(surface.fixed, this.position);
    this.still = new Mesh(this.atRest(still), ghostMaterial());
    this.still.renderOrder = 1; // after the body, around which it is seen
    this.probe = new Mesh(
      new SphereGeometry(1, 48, 32),
      new MeshLambertMaterial({ transparent: true, opacity: 0.5, depthWrite: false }),
    );
    for (let i = 0; i < rest.length; i += 3) {
      const point = new Vector3(rest[i]!, rest[i + 1]!, rest[i + 2]!);
      this.low.min(point);
      this.high.max(point);
    }
    this.roof = 0.08 * this.across();
    this.cell = round125(this.across() / 14);
    this.floor = new LineSegments(this.grid(), new LineBasicMaterial());
    this.scene.add(this.floor, this.still, this.body, this.wires, this.creases, this.ghost, this.fixed, this.probe);
    this.scene.add(this.plate());
    for (const moving of [this.body, this.wires, this.creases, this.fixed]) moving.frustumCulled = false;
    this.recolour();
    if (before) return;
    this.resize();
    this.look();
  }

  /** Take over one state: displacements at `factor` times their size, colours by each point's share of the scale; -1: unknown, -2: not touched. */
  deform(
    displacement: Float32Array,
    factor: number,
    shares: ArrayLike<number>,
    probe: Probe | null,
    layers: Layers,
  ): void {
    const { rest } = this.surface;
    const at = this.position.array as Float32Array;
    for (let i = 0; i < at.length; i++) at[i] = rest[i]! + factor * displacement[i]!;
    this.tint(shares, this.colour);
    normalsInto(this.facing.array as Float32Array, at, this.triangles);
    this.position.needsUpdate = this.facing.needsUpdate = this.colour.needsUpdate = true;
    this.moveDots();
    this.probe.visible = probe !== null;
    if (probe) {
      this.probe.position.set(...probe.centre);
      this.probe.scale.setScalar(probe.shape.size);
      this.probe.quaternion.copy(probe.shape.turned);
      probe.shape.fit(this.probe.geometry);
    }
    this.wires.visible = layers.mesh;
    this.ghost.visible = this.still.visible = layers.ghost;
    this.dirty = true;
  }

  /** Draw what presses in its shape from now on. */
  shape(shape: ToolShape): void {
    this.probe.geometry.dispose();
    this.probe.geometry = shape.geometry();
    this.dirty = true;
  }

  /** Colours of points by their shares of the scale. */
  protected tint(shares: ArrayLike<number>, colour: BufferAttribute): void {
    const [tints, colours] = [colour.array, this.colours];
    for (let i = 0; i < shares.length; i++) {
      const share = shares[i]!;
      const known = share >= UNKNOWN;
      const { r, g, b } = share < UNTOUCHED ? this.untouched : this.unknown;
      const k = 3 * (share > 0 ? (share < 1 ? (255 * share + 0.5) | 0 : 255) : 0);
      tints[3 * i] = known ? colours[k]! : r;
      tints[3 * i + 1] = known ? colours[k + 1]! : g;
      tints[3 * i + 2] = known ? colours[k + 2]! : b;
    }
  }

  /** Draw dots at places (m) of the surface at rest; they move with it. */
  mark(places: readonly Vec3[]): void {
    if (this.dots) {
      this.scene.remove(this.dots);
      this.dots.dispose();
    }
    const material = new MeshBasicMaterial({ color: css("--ink") });
    this.dots = new InstancedMesh(new SphereGeometry(DOT * this.across(), 12, 8), material, places.length);
    this.dots.frustumCulled = false;
    this.marks = places.map((place) => ({ place, nearest: this.nearest(place) }));
    this.moveDots();
    this.scene.add(this.dots);
    this.dirty = true;
  }

  /** Put the dots where their places have moved to. */
  private moveDots(): void {
    const { rest } = this.surface;
    const at = this.position.array;
    this.marks.forEach(({ place, nearest }, i) => {
      const [x, y, z] = place.map((v, k) => v + at[3 * nearest + k]! - rest[3 * nearest + k]!) as Vec3;
      this.dots!.setMatrixAt(i, new Matrix4().makeTranslation(x, y, z));
    });
    if (this.dots) this.dots.instanceMatrix.needsUpdate = true;
  }

  /** The point of the surface at rest that is nearest to a place. */
  private nearest(place: Vec3): number {
    const { rest } = this.surface;
    let [best, least] = [0, Infinity];
    for (let i = 0; i < rest.length; i += 3) {
      const far = (rest[i]! - place[0]) ** 2 + (rest[i + 1]! - place[1]) ** 2 + (rest[i + 2]! - place[2]) ** 2;
      if (far < least) [best, least] = [i / 3, far];
    }
    return best;
  }

  /** Set the share of the colour scale at which there is nothing to show. */
  neutral(none: number): void {
    this.colours = numbers(palette(none));
  }

  override recolour(): void {
    this.wires.material.color.set(css("--ink"));
    this.creases.material.color.set(css("--ink"));
    this.ghost.material.color.set(css("--soft"));
    this.still.material.color.set(css("--soft"));
    this.fixed.material.color.set(css("--accent-2"));
    this.floor.material.color.set(css("--grid"));
    this.unknown.set(css("--unknown"));
    this.untouched.set(css("--untouched"));
    this.dots?.material.color.set(css("--ink"));
    this.probe.material.color.set(css("--accent"));
    this.probe.material.emissive.set(css("--accent")).multiplyScalar(0.25);
    this.dirty = true;
  }

  /** The size of the body, m. */
  protected across(): number {
    return this.low.distanceTo(this.high);
  }

  protected override outline(): Vector3[] {
    const all: Vector3[] = [];
    for (const x of [this.low.x, this.high.x]) {
      for (const y of [this.low.y, this.high.y]) {
        for (const z of [this.low.z - 0.03 * this.across(), this.high.z + this.roof]) all.push(new Vector3(x, y, z));
      }
    }
    return all;
  }

  private lines(ends: Float32Array, position: BufferAttribute): LineSegments<BufferGeometry, LineBasicMaterial> {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", position);
    geometry.setIndex(Array.from(ends));
    return new LineSegments(geometry, new LineBasicMaterial());
  }

  private atRest(rest: BufferAttribute): BufferGeometry {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", rest);
    geometry.setIndex(new BufferAttribute(this.triangles, 1));
    return geometry;
  }

  /** A grid just below the body, so that the two don't fight for the same pixels. */
  private grid(): BufferGeometry {
    const { low, high, cell } = this;
    const ends = (a: number, b: number): [number, number] => [
      (Math.floor(a / cell) - 2) * cell,
      (Math.ceil(b / cell) + 2) * cell,
    ];
    const [[x0, x1], [y0, y1]] = [ends(low.x, high.x), ends(low.y, high.y)];
    const points: number[] = [];
    const z = low.z - 0.012 * this.across();
    for (let x = x0; x < x1 + cell / 2; x += cell) points.push(x, y0, z, x, y1, z);
    for (let y = y0; y < y1 + cell / 2; y += cell) points.push(x0, y, z, x1, y, z);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
    return geometry;
  }

  /** A plate under a clamped body, if its lowest surface is the fixed one. */
  private plate(): Mesh {
    const thickness = 0.008 * this.across();
    const span = new Vector3().subVectors(this.high, this.low);
    const box = new BoxGeometry(1.02 * span.x, 1.02 * span.y, thickness);
    const mesh = new Mesh(box, new MeshLambertMaterial({ color: css("--wall") }));
    mesh.position.copy(this.low).addScaledVector(span, 0.5).setZ(this.low.z - thickness);
    mesh.visible = this.standsOnFixed();
    return mesh;
  }

  private standsOnFixed(): boolean {
    const { fixed, rest } = this.surface;
    const near = 1e-3 * this.across();
    return fixed.length > 0 && Array.from(fixed).every((i) => rest[3 * i + 2]! - this.low.z < near);
  }
}

/** True for a surface without a border; its inside, which nobody sees, would otherwise shine through in dark dots at its outline. */
function closed(points: ArrayLike<number>, triangles: Uint32Array): boolean {
  const sum = new Vector3();
  let all = 0;
  const corner = (i: number): Vector3 => new Vector3(points[3 * i]!, points[3 * i + 1]!, points[3 * i + 2]!);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => corner(triangles[t + k]!)) as [Vector3, Vector3, Vector3];
    const area = b.sub(a).cross(c.sub(a));
    sum.add(area);
    all += area.length();
  }
  return sum.length() < OPEN * all; // areas of a closed surface add up to nothing
}

/** Colours as red, green, blue, one after the other. */
function numbers(colours: Color[]): Float32Array {
  return Float32Array.from(colours.flatMap(({ r, g, b }) => [r, g, b]));
}

/** Mark the pixels that a material draws. */
function outlined(material: MeshBasicMaterial | MeshPhongMaterial): void {
  [material.stencilWrite, material.stencilRef, material.stencilZPass] = [true, 1, ReplaceStencilOp];
}

/** The shape at rest, seen beside the body alone, where it has drawn back: on the body itself it would be a stain. */
function ghostMaterial(): MeshBasicMaterial {
  const material = new MeshBasicMaterial({ transparent: true, opacity: 0.16, depthWrite: false });
  outlined(material); // so that what lies behind another part of it is not drawn twice
  material.stencilFunc = NotEqualStencilFunc;
  return material;
}
