// A picture in three dimensions, rendered only when something has changed: camera, lights, how to look and to turn.

import {
  Color,
  DirectionalLight,
  HemisphereLight,
  LineSegments,
  Mesh,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { fit, free, project } from "./framing";
import type { Size } from "./framing";
import { Resolution } from "./resolution";
import { tidy } from "./units";

/** First view and light of a kind of body. */
export interface Stance {
  up: Vector3;
  from: Vector3; // direction of the camera at first
  sky: number;
  sun: number;
  sunFrom: Vector3;
}

export abstract class View {
  protected readonly scene = new Scene();
  protected readonly camera: PerspectiveCamera;
  protected readonly controls: OrbitControls;
  protected dirty = true;
  private readonly renderer: WebGLRenderer;
  private readonly resolution: Resolution;
  private readonly caster = new Raycaster();
  private canvasSize: Size = [0, 0]; // asked for each picture, the canvas's size would make the browser lay out the page

  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly words: readonly Element[], // that stand in front of the canvas
    private readonly stance: Stance,
    before: View | null = null, // whose place it takes, on the same canvas and with the same camera
  ) {
    this.renderer = before?.renderer ?? new WebGLRenderer({ canvas, antialias: true, alpha: true, stencil: true });
    this.camera = before?.camera ?? new PerspectiveCamera(30, 1, 0.01, 100);
    this.resolution = before?.resolution ?? new Resolution();
    const sky = new HemisphereLight(new Color(0xffffff), new Color(0xb9c4cc), stance.sky);
    sky.position.copy(stance.up);
    const sun = new DirectionalLight(0xffffff, stance.sun);
    sun.position.copy(stance.sunFrom);
    this.scene.add(sky, sun);
    this.camera.up.copy(stance.up);
    this.controls = before?.controls ?? new OrbitControls(this.camera, canvas);
    canvas.style.cursor = ""; // the controls set one, which would hide the style sheet's
    this.controls.addEventListener("change", () => (this.dirty = true));
  }

  /** Points that the first view must have in it. */
  protected abstract outline(): Vector3[];

  /** Take the theme's colours. */
  abstract recolour(): void;

  /** Render if anything changed since; called for every display frame. */
  render(): boolean {
    const { resolution } = this;
    if (!resolution.due(performance.now(), this.dirty)) return false;
    this.dirty = false;
    const ratio = resolution.share * Math.min(devicePixelRatio, 2);
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    this.renderer.render(this.scene, this.camera);
    this.canvas.dataset["camera"] = this.camera.position.toArray().map((at) => tidy(at, 4)).join(" "); // for programs that read the page
    return true;
  }

  /** Resolution of the latest picture, of the display's. */
  get sharpness(): number {
    return this.resolution.share;
  }

  /** Where a point of the scene is on the canvas, CSS pixels. */
  project(point: Vector3): Vector2 {
    return project(this.camera, this.size(), point);
  }

  resize(): void {
    const [width, height] = (this.canvasSize = [this.canvas.clientWidth, this.canvas.clientHeight]);
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Look as at first, with all of the outline in the picture. */
  look(): void {
    const room = free(this.canvas, this.words);
    const { centre, distance } = fit(this.camera, this.size(), room, this.outline(), this.stance.from);
    this.controls.target.copy(centre);
    [this.camera.near, this.camera.far] = [distance / 50, distance * 20];
    [this.controls.minDistance, this.controls.maxDistance] = [0.1 * distance, 4 * distance];
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.dirty = true;
  }

  /** Look from where another view of the same body looks. */
  stand(before: View): void {
    const { camera, controls } = before;
    this.camera.position.copy(camera.position);
    this.camera.quaternion.copy(camera.quaternion);
    this.controls.target.copy(controls.target);
    [this.camera.near, this.camera.far] = [camera.near, camera.far];
    [this.controls.minDistance, this.controls.maxDistance] = [controls.minDistance, controls.maxDistance];
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.dirty = true;
  }

  /** Free what is drawn; another view has taken the place. */
  clear(): void {
    this.scene.traverse((part) => {
      if (part instanceof Mesh || part instanceof LineSegments) part.geometry.dispose();
    });
    this.scene.clear();
  }

  /** Free all that the browser holds for this view, which is not used any more. */
  dispose(): void {
    this.clear();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** True while the mouse and fingers turn the view. */
  set turnable(on: boolean) {
    this.controls.enabled = on;
  }

  /** The ray through a point of the canvas, CSS pixels. */
  protected ray(x: number, y: number): Raycaster {
    const [width, height] = this.size();
    const at = new Vector2((2 * x) / width - 1, 1 - (2 * y) / height);
    this.caster.setFromCamera(at, this.camera);
    return this.caster;
  }

  size(): Size {
    if (!this.canvasSize[0]) this.canvasSize = [this.canvas.clientWidth, this.canvas.clientHeight];
    return [this.canvasSize[0] || 1, this.canvasSize[1] || 1];
  }
}
