// Where the camera stands: as near as all that must be seen allows.

import { Vector2, Vector3 } from "three";
import type { PerspectiveCamera } from "three";
import { WALL, WALL_DEPTH } from "./surroundings";
import type { Extent } from "./surroundings";

const GAP = 8; // px between the picture and the words around it
const ROUNDS = 9; // each leaves a small part of the misfit of the one before

export type Size = readonly [width: number, height: number]; // CSS pixels

/** The part of a canvas that no words take, CSS pixels. */
export interface Free {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

/** The part of a canvas that the elements above and below its middle leave free. */
export function free(canvas: HTMLCanvasElement, words: Iterable<Element>): Free {
  const box = canvas.getBoundingClientRect();
  let [top, bottom] = [0, box.height];
  for (const element of words) {
    const { top: above, bottom: below } = element.getBoundingClientRect();
    if (above + below < box.top + box.bottom) top = Math.max(top, below - box.top);
    else bottom = Math.min(bottom, above - box.top);
  }
  return { left: 2 * GAP, right: box.width - 2 * GAP, top: top + GAP, bottom: bottom - GAP };
}

/** Points that must be seen: floor and wall, and the corners of the box that the held node moves in. */
export function outline(extent: Extent, low: Vector3, high: Vector3): Vector3[] {
  const { root, length, floor, depth } = extent;
  const points: Vector3[] = [];
  for (const x of [root - 0.04 * length, root + 1.1 * length]) {
    for (const z of [-depth, depth + 0.05 * length]) points.push(new Vector3(x, floor, z));
  }
  for (const x of [low.x, high.x]) {
    for (const y of [low.y, high.y]) points.push(new Vector3(x, y, 0));
  }
  for (const z of [-0.5, 0.5]) points.push(new Vector3(root, WALL * length, z * WALL_DEPTH * length));
  return points;
}

/** Place the camera in direction `from` so that the points fill the free part of the canvas; where it looks. */
export function fit(
  camera: PerspectiveCamera,
  size: Size,
  room: Free,
  points: Vector3[],
  from: Vector3,
): { centre: Vector3; distance: number } {
  const centre = points.reduce((sum, p) => sum.add(p), new Vector3()).divideScalar(points.length);
  let distance = 3 * Math.max(...points.map((p) => p.distanceTo(centre)));
  const look = (): Free => {
    camera.position.copy(centre).addScaledVector(from, distance);
    camera.lookAt(centre);
    camera.updateMatrixWorld();
    return around(points.map((point) => project(camera, size, point)));
  };
  for (let round = 0; round < ROUNDS; round++) {
    const [seen, scale] = [look(), distance * pixel(camera, size)];
    centre.x += ((seen.left + seen.right - room.left - room.right) / 2) * scale;
    centre.y -= ((seen.top + seen.bottom - room.top - room.bottom) / 2) * scale;
    const [wide, high] = [seen.right - seen.left, seen.bottom - seen.top];
    distance *= Math.max(wide / (room.right - room.left), high / Math.max(room.bottom - room.top, 1));
  }
  look();
  return { centre, distance };
}

/** Where a point of the scene is on the canvas, CSS pixels. */
export function project(camera: PerspectiveCamera, [width, height]: Size, point: Vector3): Vector2 {
  const p = point.clone().project(camera);
  return new Vector2(((p.x + 1) / 2) * width, ((1 - p.y) / 2) * height);
}

/** A pixel's size at distance 1 from the camera. */
export function pixel(camera: PerspectiveCamera, [, height]: Size): number {
  return (2 * Math.tan((camera.fov * Math.PI) / 360)) / height;
}

/** The smallest rectangle around points. */
function around(points: Vector2[]): Free {
  const [xs, ys] = [points.map((p) => p.x), points.map((p) => p.y)];
  return { left: Math.min(...xs), right: Math.max(...xs), top: Math.min(...ys), bottom: Math.max(...ys) };
}
