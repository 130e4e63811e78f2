// The entry of a page that is one file: everything is in it, and nothing is fetched. `palpate export html` writes the file's parts
// (palpate/viewer/file_page.py) as scripts of other types, packed by gzip.

import { DepthCurve } from "./depth_curve";
import { Evaluator } from "./evaluator";
import { say } from "./flags";
import { FileConnection } from "./file_connection";
import { IndentationDrawing } from "./indentation_drawing";
import { LineShape } from "./line_shape";
import type { LineFacts } from "./line_shape";
import type { Places } from "./indentation_drawing";
import type { Hello } from "./messages";
import { Binding, PackedSurface } from "./packed";
import type { BindingFacts, FieldFacts, SurfaceFacts } from "./packed";
import { MovingRest } from "./moving_rest";
import { provide } from "./resources";
import { touch } from "./touch";
import { element } from "./units";

interface Facts {
  places: Places | null; // where indentations stay
  surface: SurfaceFacts | null; // none of a body drawn as a line
  drawn: { surface: SurfaceFacts; binding: BindingFacts } | null; // the body's own surface, which the other carries
  fields: FieldFacts[];
  line: LineFacts | null;
}

/** Bytes from base64. */
function bytes(text: string): Uint8Array<ArrayBuffer> {
  const own = Uint8Array as unknown as { fromBase64?: (text: string) => Uint8Array<ArrayBuffer> }; // of newer browsers
  if (own.fromBase64) return own.fromBase64(text);
  const decoded = atob(text);
  const out = new Uint8Array(decoded.length);
  for (let i = 0; i < decoded.length; i++) out[i] = decoded.charCodeAt(i);
  return out;
}

async function part(name: string): Promise<Uint8Array<ArrayBuffer>> {
  const stream = new Blob([bytes(document.getElementById(`palpate-${name}`)!.textContent!)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function json<Type>(name: string): Promise<Type> {
  return JSON.parse(new TextDecoder().decode(await part(name))) as Type;
}

/** Words of eight bytes, whose bytes of equal weight stand together. */
function words(bytes: Uint8Array): Uint8Array {
  const count = bytes.length / 8;
  const out = new Uint8Array(bytes.length);
  for (let i = 0; i < count; i++) for (let b = 0; b < 8; b++) out[8 * i + b] = bytes[b * count + i]!;
  return out;
}

async function open(): Promise<void> {
  const [hello, facts] = await Promise.all([json<Hello>("hello"), json<Facts>("facts")]);
  const each = (name: string, count: number): Promise<Uint8Array<ArrayBuffer>[]> =>
    Promise.all(Array.from({ length: count }, (_, i) => part(`${name}-${i}`)));
  const [mesh, nodes, module, blocks, modes] = await Promise.all([
    facts.surface ? part("surface") : null,
    facts.line ? part("line") : null,
    part("core"),
    each("weights", Math.max(1, facts.fields.length)),
    each("field", facts.fields.length),
  ]);
  const packed = facts.surface && new PackedSurface(facts.surface, mesh!);
  let fields = facts.fields.map((own, i) => packed!.field(own, modes[i]!));
  let surface = packed?.surface;
  if (facts.drawn) {
    const binding = new Binding(facts.drawn.binding, await part("binding"), surface!);
    fields = fields.map((field, i) => binding.carry(field, hello.fields[i]!.components));
    ({ surface } = new PackedSurface(facts.drawn.surface, await part("drawn")));
  }
  provide({ surface: async () => surface!, modes: async (field) => fields[field]! });
  const evaluator = await Evaluator.of(module, blocks.map(words), facts.places?.points.length, nodes && words(nodes));
  const kept = facts.places && new IndentationDrawing(evaluator, hello, surface!, facts.places);
  const line = facts.line && new LineShape(evaluator, facts.line, hello.line!.rest.length);
  const rest = facts.line?.stays ? new MovingRest(evaluator, facts.line.directions[0]!) : null;
  if (rest) offerStraightening(rest);
  const curve = new DepthCurve(hello, evaluator);
  touch({
    connect: (listener) => new FileConnection(listener, hello, evaluator, kept, line, rest),
    seen: (frame) => curve.update(frame),
  });
  // for programs that drive the page, and for whoever wants to ask the body
  Object.assign(window, { palpate: { hello, evaluator, surface, fields, kept, line, rest } });
}

function offerStraightening(rest: MovingRest): void {
  const button = element("straighten");
  button.hidden = false;
  button.addEventListener("click", () => rest.straighten());
}

document.documentElement.dataset["file"] = "";
open().catch((error: unknown) => say(String(error), "bad"));
