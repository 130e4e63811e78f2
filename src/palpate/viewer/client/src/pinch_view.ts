// A body between two jaws: they are seen before they are held, too, where a hand would take them.

import { GreaterDepth, Mesh, MeshBasicMaterial, Plane, SphereGeometry, Vector3 } from "three";
import type { BufferGeometry } from "three";
import type { Frame, Hello, Surface, Vec3 } from "./messages";
import type { Layers } from "./surface_view";
import type { ToolShape } from "./tool_shape";
import { PressView } from "./touch_view";
import { css } from "./units";

const BALL = 0.012; // of the body's size, radius of the ball between the jaws
const HELD = 0.7; // opacity of jaws that are held
const FREE = 0.3;
const LIT = 0.45; // that a hand would take
const HIDDEN = 0.2; // of what the body hides of them

export class PinchView extends PressView {
  private readonly ball: Mesh<SphereGeometry, MeshBasicMaterial>;
  private readonly hidden: Mesh<BufferGeometry, MeshBasicMaterial>; // jaws as far as the body hides them
  private readonly centre: Vector3; // of the device, m
  private held = false;

  constructor(canvas: HTMLCanvasElement, surface: Surface, hello: Hello, words: readonly Element[], shape: ToolShape) {
    super(canvas, surface, hello, words, shape);
    this.centre = new Vector3(...hello.centre);
    this.grip.copy(this.centre);
    // seen through the body
    this.ball = new Mesh(new SphereGeometry(BALL * this.across(), 24, 16), new MeshBasicMaterial({ depthTest: false }));
    this.ball.renderOrder = 2;
    const faint = { transparent: true, opacity: HIDDEN, depthWrite: false, depthFunc: GreaterDepth };
    this.hidden = new Mesh(this.probe.geometry, new MeshBasicMaterial(faint));
    this.scene.add(this.ball, this.hidden);
    this.recolour();
  }

  override touch(frame: Frame, shape: ToolShape, moved: Float32Array, shares: ArrayLike<number>, layers: Layers): void {
    this.held = frame.grabbed || this.hello.device !== "";
    if (this.held) this.grip.set(...frame.position);
    this.deform(moved, 1, shares, { centre: this.grip.toArray() as Vec3, shape }, layers);
    for (const part of [this.ball, this.hidden]) part.position.copy(this.grip);
    this.arrow.update(this.grip, this.held ? frame.force : [0, 0, 0]);
    this.highlight(false);
  }

  /** True where a point of the canvas (CSS pixels) lies on a jaw. */
  meets(x: number, y: number): boolean {
    return this.ray(x, y).intersectObject(this.probe).length > 0;
  }

  /** The way (m) from the device's centre to a canvas point, in the plane through the middle that faces the camera. */
  offsetAt(x: number, y: number): Vec3 | null {
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.camera.getWorldDirection(new Vector3()), this.grip);
    const hit = this.ray(x, y).ray.intersectPlane(plane, new Vector3());
    return hit ? (hit.sub(this.centre).toArray() as Vec3) : null;
  }

  /** The way (m) from the device's centre to the middle between the jaws as they are drawn. */
  offset(): Vec3 {
    return this.grip.clone().sub(this.centre).toArray() as Vec3;
  }

  /** Make the jaws answer the pointer. */
  highlight(on: boolean): void {
    const opacity = this.held ? HELD : on ? LIT : FREE;
    if (this.probe.material.opacity === opacity) return;
    this.probe.material.opacity = opacity;
    this.dirty = true;
  }

  override recolour(): void {
    super.recolour();
    for (const part of [this.ball, this.hidden]) part?.material.color.set(css("--accent")); // not there yet while the base class is made
  }
}
