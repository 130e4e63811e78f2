// Surroundings of a line: the wall that clamps it, and a floor with a scale in metres.

import {
  BoxGeometry,
  BufferGeometry,
  CanvasTexture,
  Float32BufferAttribute,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshLambertMaterial,
  Sprite,
  SpriteMaterial,
  SRGBColorSpace,
} from "three";
import { css, tidy } from "./units";

export const WALL = 0.16; // of the body's length, height of the wall above the axis
export const WALL_DEPTH = 0.3;
const LABEL = 18; // px, height of a label's box, letters being two thirds of it

export interface Extent {
  root: number; // x of the clamped end, m
  length: number; // m
  floor: number; // y, m
  cell: number; // m, spacing of the grid
  depth: number; // m, the grid to either side of the body
}

/** Everything that doesn't move, in the colours of the current theme. */
export function surroundings(extent: Extent): Group {
  const group = new Group();
  group.add(grid(extent), wall(extent));
  for (const label of labels(extent)) group.add(label);
  return group;
}

function cellsAlong(extent: Extent): number {
  return Math.ceil((1.1 * extent.length) / extent.cell - 1e-9);
}

function grid(extent: Extent): LineSegments {
  const { root, floor, cell, depth: half } = extent;
  const points: number[] = [];
  const end = root + cellsAlong(extent) * cell;
  for (let x = root; x < end + cell / 2; x += cell) points.push(x, floor, -half, x, floor, half);
  for (let z = -half; z < half + cell / 2; z += cell) points.push(root, floor, z, end, floor, z);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: css("--grid") }));
}

function wall({ root, length, floor }: Extent): Group {
  const thickness = 0.03 * length;
  const [top, bottom] = [WALL * length, floor];
  const box = new BoxGeometry(thickness, top - bottom, WALL_DEPTH * length);
  const group = new Group();
  const mesh = new Mesh(box, new MeshLambertMaterial({ color: css("--wall") }));
  mesh.position.set(root - thickness / 2, (top + bottom) / 2, 0);
  group.add(mesh);
  return group;
}

/** Keep the labels at one size on the screen; `pixel`: a pixel's size at distance 1 from the camera. */
export function sizeLabels(group: Group, pixel: number): void {
  for (const child of group.children) {
    if (child instanceof Sprite) child.scale.set((LABEL * pixel * 128) / 48, LABEL * pixel, 1);
  }
}

function* labels(extent: Extent): Generator<Sprite> {
  const { root, length, floor, cell, depth } = extent;
  for (let i = 0; i <= cellsAlong(extent); i += 2) {
    const last = i + 2 > cellsAlong(extent);
    const sprite = text(`${tidy(i * cell)}${last ? " m" : ""}`);
    sprite.position.set(root + i * cell, floor, depth + 0.05 * length);
    yield sprite;
  }
}

function text(words: string): Sprite {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [128, 48];
  const pen = canvas.getContext("2d")!;
  pen.font = "34px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = css("--soft");
  pen.fillText(words, 64, 25);
  const map = new CanvasTexture(canvas);
  map.colorSpace = SRGBColorSpace;
  return new Sprite(new SpriteMaterial({ map, transparent: true, depthWrite: false, sizeAttenuation: false }));
}
