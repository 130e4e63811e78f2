// The entry of a page that is one file: everything is in it, and nothing is fetched. `palpate export html` writes the file's parts
// (palpate/export/html_page.py) as scripts of other types, packed by gzip.

import { DepthCurve } from "./depth_curve";
import { Evaluator } from "./evaluator";
import { say } from "./flags";
import { FileConnection } from "./file_connection";
import { encodeModes, encodeSurface } from "./messages";
import type { Hello } from "./messages";
import { provide } from "./resources";
import { touch } from "./touch";

/** A surface and the modes of its field, as whole numbers of two bytes. */
interface Parts {
  points: number;
  triangles: number;
  creases: number;
  modes: number; // -1 where there is no field
  reach: number;
  rows: number;
  touched: number;
}

async function part(name: string): Promise<ArrayBuffer> {
  const text = document.getElementById(`palpate-${name}`)!.textContent!.trim();
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

async function json<Type>(name: string): Promise<Type> {
  return JSON.parse(new TextDecoder().decode(await part(name))) as Type;
}

/** Lists of the surface and of its field, one after the other. */
function lists(sizes: Parts, buffer: ArrayBuffer): { surface: ArrayBuffer; modes: ArrayBuffer | null } {
  let at = 0;
  const take = <List>(make: (buffer: ArrayBuffer, at: number, count: number) => List, bytes: number, count: number): List => {
    const list = make(buffer, at, count);
    at += Math.ceil((bytes * count) / 8) * 8;
    return list;
  };
  const floats = (count: number): Float32Array => take((b, i, n) => new Float32Array(b, i, n), 4, count);
  const wholes = (count: number): Float32Array => Float32Array.from(take((b, i, n) => new Uint32Array(b, i, n), 4, count));
  const surface = encodeSurface({
    rest: floats(3 * sizes.points),
    triangles: wholes(3 * sizes.triangles),
    creases: wholes(2 * sizes.creases),
    fixed: new Float32Array(),
    touchable: Float32Array.from(take((b, i, n) => new Uint8Array(b, i, n), 1, sizes.triangles)),
    yielding: new Float32Array(),
    normals: new Float32Array(),
  });
  if (sizes.modes < 0) return { surface, modes: null };
  const scales = take((b, i, n) => new Float64Array(b, i, n), 8, 1 + sizes.modes);
  const row = 3 * sizes.points;
  const rows = Array.from(scales, (scale) => {
    const small = take((b, i, n) => new Int16Array(b, i, n), 2, row);
    return Float32Array.from(small, (v) => scale * v);
  });
  const every = new Float32Array(row * sizes.modes);
  rows.slice(1).forEach((values, k) => every.set(values, k * row));
  const touched = wholes(sizes.touched);
  return { surface, modes: encodeModes({ reach: sizes.reach, rows: sizes.rows, rest: rows[0]!, modes: every, touched }) };
}

/** Words of eight bytes, whose bytes of equal weight stand together. */
function words(bytes: Uint8Array): Uint8Array {
  const count = bytes.length / 8;
  const out = new Uint8Array(bytes.length);
  for (let b = 0; b < 8; b++) for (let i = 0; i < count; i++) out[8 * i + b] = bytes[b * count + i]!;
  return out;
}

async function open(): Promise<void> {
  const [hello, sizes, numbers, module, block] = await Promise.all([
    json<Hello>("hello"),
    json<Parts>("sizes"),
    part("surface"),
    part("core"),
    part("weights"),
  ]);
  const { surface, modes } = lists(sizes, numbers);
  provide((path) => Promise.resolve(path.startsWith("surface") ? surface : modes!));
  const evaluator = await Evaluator.of(module, words(new Uint8Array(block)));
  const curve = new DepthCurve(hello, evaluator);
  touch({
    connect: (listener) => new FileConnection(listener, hello, evaluator),
    seen: (frame) => curve.update(frame),
  });
  // for programs that drive the page, and for whoever wants to ask the body
  Object.assign(window, { palpate: { hello, evaluator } });
}

document.documentElement.dataset["file"] = "";
open().catch((error: unknown) => say(String(error), "bad"));
