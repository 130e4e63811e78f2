// What stays pressed in a body that yields: depths along the normals of those points of the skin that may keep a print.

import type { Skin } from "./messages";

export class Prints {
  private readonly points: Int32Array;

  constructor(private readonly skin: Skin) {
    this.points = Int32Array.from(skin.printable);
  }

  /** Press displacements (x y z of each point, m) down by the depths (m) of a picture; empty where nothing stays. */
  into(moved: Float32Array, depths: Float32Array): void {
    const { normals } = this.skin;
    for (let k = 0; k < depths.length; k++) {
      const depth = depths[k]!;
      if (depth === 0) continue;
      for (let i = 0; i < 3; i++) moved[3 * this.points[k]! + i]! -= depth * normals[3 * k + i]!;
    }
  }
}
