// A solid body in three dimensions, z up: its deformed surface, its outline at rest, the probe, a floor with a scale.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  Float32BufferAttribute,
  HemisphereLight,
  LessDepth,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshPhongMaterial,
  PerspectiveCamera,
  Scene,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { shade } from "./colour";
import { fit, free, project } from "./framing";
import type { Size } from "./framing";
import type { Step, Surface } from "./messages";
import { css, round125 } from "./units";

const ABOVE = new Vector3(0.62, -1, 0.72).normalize(); // where the camera stands at first
const PALETTE = Array.from({ length: 256 }, (_, i) => new Color().setRGB(...shade(i / 255), SRGBColorSpace));

export interface Layers {
  probe: boolean;
  ghost: boolean;
  mesh: boolean;
}

export class SolidView {
  readonly cell: number; // m, spacing of the floor's grid

  private readonly renderer: WebGLRenderer;
  protected readonly scene = new Scene();
  protected readonly camera = new PerspectiveCamera(30, 1, 0.01, 100);
  protected readonly controls: OrbitControls;
  private readonly geometry = new BufferGeometry();
  private readonly position: BufferAttribute;
  private readonly colour: BufferAttribute;
  protected readonly body: Mesh<BufferGeometry, MeshPhongMaterial>;
  protected readonly wires: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly creases: LineSegments<BufferGeometry, LineBasicMaterial>;
  protected readonly ghost: LineSegments<BufferGeometry, LineBasicMaterial>;
  protected readonly shade: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly held: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly floor: LineSegments<BufferGeometry, LineBasicMaterial>;
  protected readonly probe: Mesh<SphereGeometry, MeshLambertMaterial>;
  private readonly low = new Vector3();
  private readonly high = new Vector3();
  protected dirty = true;
  protected roof = 0; // m, room that a view leaves above the body

  constructor(
    readonly canvas: HTMLCanvasElement,
    protected readonly surface: Surface,
    private readonly words: readonly Element[], // that stand in front of the canvas
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    const { rest, triangles } = surface;
    this.position = new BufferAttribute(Float32Array.from(rest), 3);
    this.colour = new BufferAttribute(new Float32Array(rest.length), 3);
    this.geometry.setAttribute("position", this.position);
    this.geometry.setAttribute("color", this.colour);
    this.geometry.setIndex(Array.from(triangles));
    this.geometry.computeVertexNormals(); // a material that first sees a geometry without normals stays flat
    this.body = new Mesh(
      this.geometry,
      new MeshPhongMaterial({ vertexColors: true, side: DoubleSide, shininess: 24, specular: 0x1c1c1c }),
    );
    // pulled a little towards the camera, so that the lines on the surface are not half lost in it
    this.body.material.polygonOffset = true;
    [this.body.material.polygonOffsetFactor, this.body.material.polygonOffsetUnits] = [1, 1];
    this.wires = new Mesh(this.geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.22 }));
    this.creases = this.lines(surface.creases, this.position);
    const still = new BufferAttribute(rest, 3);
    this.ghost = this.lines(surface.creases, still);
    // where the body did not move, its own edges win
    [this.ghost.material.transparent, this.ghost.material.depthFunc] = [true, LessDepth];
    this.held = this.lines(surface.fixed, this.position);
    this.shade = new Mesh(this.still(still), ghostMaterial());
    this.probe = new Mesh(
      new SphereGeometry(1, 48, 32),
      new MeshLambertMaterial({ transparent: true, opacity: 0.5, depthWrite: false }),
    );
    this.measure();
    this.roof = 0.08 * this.size3();
    this.cell = round125(this.size3() / 14);
    this.floor = new LineSegments(this.grid(), new LineBasicMaterial());
    this.assemble();
    this.controls = this.orbit();
    this.recolour();
    this.resize();
    this.look();
  }

  /** Take over one state: displacements at `factor` times their size, colours by each point's share of the scale. */
  show(step: Step, factor: number, shares: ArrayLike<number>, layers: Layers): void {
    const { rest } = this.surface;
    const at = this.position.array as Float32Array;
    for (let i = 0; i < at.length; i++) at[i] = rest[i]! + factor * step.displacement[i]!;
    for (let i = 0; i < shares.length; i++) {
      const tint = PALETTE[Math.round(255 * Math.min(Math.max(shares[i]!, 0), 1))]!;
      this.colour.setXYZ(i, tint.r, tint.g, tint.b);
    }
    this.position.needsUpdate = this.colour.needsUpdate = true;
    this.geometry.computeVertexNormals();
    this.geometry.computeBoundingSphere();
    this.probe.visible = layers.probe && step.probed;
    this.probe.position.set(...step.centre);
    this.probe.scale.setScalar(Math.max(step.radius, 1e-9));
    this.wires.visible = layers.mesh;
    this.ghost.visible = this.shade.visible = layers.ghost;
    this.dirty = true;
  }

  /** Render if anything changed since. */
  render(): boolean {
    if (!this.dirty) return false;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
    return true;
  }

  /** Where a point of the surface is drawn, CSS pixels of the canvas. */
  where(point: number): { x: number; y: number } {
    return project(this.camera, this.size(), new Vector3().fromBufferAttribute(this.position, point));
  }

  resize(): void {
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Look from the front, somewhat from above, with the whole body in the picture. */
  look(): void {
    const room = free(this.canvas, this.words);
    const { centre, distance } = fit(this.camera, this.size(), room, this.corners(), ABOVE);
    this.controls.target.copy(centre);
    [this.camera.near, this.camera.far] = [distance / 50, distance * 20];
    [this.controls.minDistance, this.controls.maxDistance] = [0.1 * distance, 4 * distance];
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.dirty = true;
  }

  /** Take the theme's colours. */
  recolour(): void {
    this.wires.material.color.set(css("--ink"));
    this.creases.material.color.set(css("--ink"));
    this.ghost.material.color.set(css("--soft"));
    this.shade.material.color.set(css("--soft"));
    this.held.material.color.set(css("--accent-2"));
    this.floor.material.color.set(css("--grid"));
    this.probe.material.color.set(css("--accent"));
    this.probe.material.emissive.set(css("--accent")).multiplyScalar(0.25);
    this.dirty = true;
  }

  private assemble(): void {
    this.scene.add(this.floor, this.shade, this.body, this.wires, this.creases, this.ghost, this.held, this.probe);
    this.scene.add(this.plate());
    for (const one of [this.body, this.wires, this.creases, this.held]) one.frustumCulled = false;
    const sky = new HemisphereLight(new Color(0xffffff), new Color(0xb9c4cc), 2.1);
    sky.position.set(0, 0, 1);
    this.scene.add(sky);
    const sun = new DirectionalLight(0xffffff, 1.7);
    sun.position.set(-0.4, -0.9, 1.6);
    this.scene.add(sun);
  }

  private orbit(): OrbitControls {
    this.camera.up.set(0, 0, 1);
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.addEventListener("change", () => (this.dirty = true));
    return controls;
  }

  private lines(ends: Float32Array, position: BufferAttribute): LineSegments<BufferGeometry, LineBasicMaterial> {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", position);
    geometry.setIndex(Array.from(ends));
    return new LineSegments(geometry, new LineBasicMaterial());
  }

  private still(rest: BufferAttribute): BufferGeometry {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", rest);
    geometry.setIndex(Array.from(this.surface.triangles));
    return geometry;
  }

  private measure(): void {
    const { rest } = this.surface;
    this.low.setScalar(Infinity);
    this.high.setScalar(-Infinity);
    const at = new Vector3();
    for (let i = 0; i < rest.length; i += 3) {
      at.set(rest[i]!, rest[i + 1]!, rest[i + 2]!);
      this.low.min(at);
      this.high.max(at);
    }
  }

  protected size3(): number {
    return this.low.distanceTo(this.high);
  }

  private corners(): Vector3[] {
    const all: Vector3[] = [];
    for (const x of [this.low.x, this.high.x]) {
      for (const y of [this.low.y, this.high.y]) {
        for (const z of [this.low.z - 0.03 * this.size3(), this.high.z + this.roof]) all.push(new Vector3(x, y, z));
      }
    }
    return all;
  }

  /** Height of the floor: just below the body, so that the two don't fight for the same pixels. */
  private ground(): number {
    return this.low.z - 0.012 * this.size3();
  }

  private grid(): BufferGeometry {
    const { low, high, cell } = this;
    const ends = (a: number, b: number): [number, number] => [
      (Math.floor(a / cell) - 2) * cell,
      (Math.ceil(b / cell) + 2) * cell,
    ];
    const [[x0, x1], [y0, y1]] = [ends(low.x, high.x), ends(low.y, high.y)];
    const points: number[] = [];
    const z = this.ground();
    for (let x = x0; x < x1 + cell / 2; x += cell) points.push(x, y0, z, x, y1, z);
    for (let y = y0; y < y1 + cell / 2; y += cell) points.push(x0, y, z, x1, y, z);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
    return geometry;
  }

  /** What a clamped body stands on, if its lowest surface is the fixed one. */
  private plate(): Mesh {
    const thickness = 0.008 * this.size3();
    const span = new Vector3().subVectors(this.high, this.low);
    const box = new BoxGeometry(1.02 * span.x, 1.02 * span.y, thickness);
    const mesh = new Mesh(box, new MeshLambertMaterial({ color: css("--wall") }));
    mesh.position.copy(this.low).addScaledVector(span, 0.5).setZ(this.low.z - thickness);
    mesh.visible = this.standsOnFixed();
    return mesh;
  }

  private standsOnFixed(): boolean {
    const { fixed, rest } = this.surface;
    const near = 1e-3 * this.size3();
    return fixed.length > 0 && Array.from(fixed).every((i) => rest[3 * i + 2]! - this.low.z < near);
  }

  protected size(): Size {
    return [this.canvas.clientWidth || 1, this.canvas.clientHeight || 1];
  }
}

function ghostMaterial(): MeshBasicMaterial {
  return new MeshBasicMaterial({ transparent: true, opacity: 0.1, depthWrite: false });
}
