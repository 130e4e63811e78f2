// What stands around the body: the wall that clamps it, and a floor with a scale in metres.

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
} from "three";
import { css, tidy } from "./units";

const LABEL_HEIGHT = 0.052; // of the body's length

export interface Extent {
  root: number; // x of the clamped end, m
  length: number; // m
  floor: number; // y, m
  cell: number; // m, spacing of the grid
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

function grid({ root, length, floor, cell }: Extent): LineSegments {
  const half = Math.round((0.3 * length) / cell) * cell;
  const points: number[] = [];
  const end = root + cellsAlong({ root, length, floor, cell }) * cell;
  for (let x = root; x < end + cell / 2; x += cell) points.push(x, floor, -half, x, floor, half);
  for (let z = -half; z < half + cell / 2; z += cell) points.push(root, floor, z, end, floor, z);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: css("--grid") }));
}

function wall({ root, length, floor }: Extent): Group {
  const thickness = 0.03 * length;
  const [top, bottom] = [0.16 * length, floor];
  const box = new BoxGeometry(thickness, top - bottom, 0.3 * length);
  const group = new Group();
  const mesh = new Mesh(box, new MeshLambertMaterial({ color: css("--wall") }));
  mesh.position.set(root - thickness / 2, (top + bottom) / 2, 0);
  group.add(mesh);
  return group;
}

function* labels(extent: Extent): Generator<Sprite> {
  const { root, length, floor, cell } = extent;
  const half = Math.round((0.3 * length) / cell) * cell;
  for (let i = 0; i <= cellsAlong(extent); i += 2) {
    const last = i + 2 > cellsAlong(extent);
    const sprite = text(`${tidy(i * cell)}${last ? " m" : ""}`, LABEL_HEIGHT * length);
    sprite.position.set(root + i * cell, floor, half + 0.05 * length);
    yield sprite;
  }
}

function text(words: string, height: number): Sprite {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [128, 48];
  const pen = canvas.getContext("2d")!;
  pen.font = "34px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = css("--soft");
  pen.fillText(words, 64, 25);
  const material = new SpriteMaterial({ map: new CanvasTexture(canvas), transparent: true, depthWrite: false });
  const sprite = new Sprite(material);
  sprite.scale.set((height * 128) / 48, height, 1);
  return sprite;
}
