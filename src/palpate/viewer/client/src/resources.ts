// Where the parts of a body come from: the server, or the file that the page is.

import { decodeModes, decodeSurface } from "./messages";
import type { Modes, Surface } from "./messages";

/** Gives the surface of a body, and the modes of its fields by their numbers. */
interface Source {
  surface(version: number): Promise<Surface>;
  modes(field: number, version: number): Promise<Modes>;
}

/** Fetch a part of the body from the server. */
export async function get(path: string): Promise<ArrayBuffer> {
  const answer = await fetch(`./${path}`);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.arrayBuffer();
}

let source: Source = {
  surface: async (version) => decodeSurface(await get(`surface?version=${version}`)),
  modes: async (field, version) => decodeModes(await get(`fields/${field}?version=${version}`)),
};

/** Whoever gives the parts of the body. */
export function parts(): Source {
  return source;
}

/** Take parts from elsewhere from now on. */
export function provide(other: Source): void {
  source = other;
}
