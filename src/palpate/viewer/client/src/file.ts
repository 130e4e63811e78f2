// The entry of a page that is one file: everything is in it, and nothing is fetched. `palpate export html` writes the file's parts
// (palpate/viewer/file_page.py) as scripts of other types, packed by gzip.

import { answers } from "./answers";
import { DepthCurve } from "./depth_curve";
import { Evaluator } from "./evaluator";
import { say } from "./flags";
import { FileConnection } from "./file_connection";
import { json, part, words } from "./file_parts";
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
if (document.documentElement.dataset["mode"] === "answers") answers();
else open().catch((error: unknown) => say(String(error), "bad"));
