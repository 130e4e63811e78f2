// The page of a body that is pressed anywhere: joins the connection, the hand, the view and the panel.

import { gradient } from "./colour";
import { Connection } from "./connection";
import { Field } from "./field";
import { Finger } from "./finger";
import { decodeModes, decodePress, decodeSkin, isTouched } from "./messages";
import type { Look, Press, Touched } from "./messages";
import { PressPanel } from "./presspanel";
import { PressView } from "./pressview";
import { Prints } from "./prints";
import { element } from "./readings";
import { describe, say, status, warn } from "./telling";
import { fixed, measured, multiple, tidy } from "./units";

const SILENT = 1500; // ms without a picture until the page says so
const PLAIN = 0.35; // share of the colour scale that a body without a field has

const canvas = element<HTMLCanvasElement>("view");
const input = (id: string): HTMLInputElement => element<HTMLInputElement>(id);
const data = document.documentElement.dataset;
const panel = new PressPanel();
let view: PressView | null = null;
let hello: Touched | null = null;
let fields: Field[] = [];
let prints: Prints | null = null;
let chosen = 0;
let latest: Press | null = null;
let drawn: Press | null = null;
let lastFrame = 0;
let still: Float32Array = new Float32Array();

const connection = new Connection<Touched, Press>({ isHello: isTouched, decode: decodePress }, { hello: start, notice: warn, lost });
const finger = new Finger(canvas, connection);
finger.deepened = (depth) => panel.depth(depth);

function start(told: Touched): void {
  if (hello && JSON.stringify(hello) !== JSON.stringify(told)) {
    location.reload(); // the server is back with another body: a fresh page is simpler than a changed one
    return;
  }
  element("banner").hidden = true;
  panel.start(told, {
    moved: (i, value) => {
      const values = Float32Array.from(latest?.parameters ?? []);
      values[i] = value;
      finger.parameters = values;
      finger.send();
    },
    deeper: (depth) => (finger.wanted = depth),
  });
  [finger.wanted, finger.most, finger.radius] = [panel.start_depth, panel.most, told.radius];
  lastFrame = performance.now();
  if (!hello) open(told).catch((error: unknown) => say(`The body can't be shown: ${String(error)}.`, "calm"));
  hello = told;
}

async function open(told: Touched): Promise<void> {
  const get = async (path: string): Promise<ArrayBuffer> => {
    const answer = await fetch(`./${path}`);
    if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
    return answer.arrayBuffer();
  };
  const skin = decodeSkin(await get("skin"));
  const modes = await Promise.all(told.fields.map(async (_, i) => decodeModes(await get(`fields/${i}`))));
  fields = told.fields.map((look, i) => new Field(look, modes[i]!, skin.rest));
  still = new Float32Array(skin.rest.length);
  prints = new Prints(skin);
  element("legend-bar").style.background = gradient();
  choices(told.fields);
  legend();
  view = new PressView(canvas, skin, told, ["title", "tools", "scale-notes", "legend"].map(element));
  finger.attach(view, told);
  notes(view);
  view.look(); // now that the words stand where they will
  show();
}

function notes(of: PressView): void {
  const first = hello!.fields[0];
  const words = first
    ? [first.components === 3 ? "displacement to scale" : "the surface is drawn at rest"]
    : ["no field in this file: the surface is drawn at rest,", "from its distance, and does not move"];
  element("scale-notes").replaceChildren(
    ...[...words, `grid ${measured(of.cell, "m")}`].map((line) => {
      const row = document.createElement("div");
      row.textContent = line;
      return row;
    }),
  );
}

function choices(looks: Look[]): void {
  element("colours").hidden = looks.length < 2;
  const buttons = looks.map((look, i) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = look.name;
    button.setAttribute("aria-pressed", String(i === chosen));
    button.addEventListener("click", () => {
      chosen = i;
      buttons.forEach((other, j) => other.setAttribute("aria-pressed", String(j === i)));
      legend();
      show();
    });
    return button;
  });
  element("fields").replaceChildren(...buttons);
}

function legend(): void {
  const look = fields[chosen]?.look;
  element("legend").hidden = !look;
  if (!look) return;
  const { size, unit } = multiple(Math.max(Math.abs(look.low), Math.abs(look.high)), look.unit);
  element("legend-title").textContent = unit ? `${look.name} (${unit})` : look.name;
  element("legend-ticks").replaceChildren(
    ...[0, 0.5, 1].map((t) => {
      const mark = document.createElement("span");
      mark.textContent = tidy((look.low + t * (look.high - look.low)) / size);
      return mark;
    }),
  );
}

/** Draw the latest picture. */
function show(): void {
  if (!view || !latest || !hello) return;
  let at = 0;
  const began = performance.now();
  fields.forEach((field, i) => {
    const numbers = latest!.coefficients.subarray(at, (at += field.count));
    // the first moves the surface, the chosen one colours it
    if (i === 0 || i === chosen) field.update(numbers, latest!.foot);
  });
  const first = fields[0];
  if (first?.look.components !== 3) still.fill(0);
  const moved = first?.look.components === 3 ? first.values : still;
  prints?.into(moved, latest.prints);
  const field = fields[chosen];
  const values = field?.sizes();
  const span = field ? field.look.high - field.look.low : 1;
  const shares = values?.map((v) => (v - field!.look.low) / span) ?? new Float32Array(still.length / 3).fill(PLAIN);
  data["summed"] = String(performance.now() - began); // ms
  const layers = { ghost: input("show-ghost").checked, mesh: input("show-mesh").checked };
  view.press(latest, finger.radius, moved, shares, layers);
  panel.largest(field?.look ?? null, values ?? still);
  drawn = latest;
}

function lost(): void {
  latest = drawn = null;
  finger.release();
  panel.lost();
  element("arrow-label").hidden = true;
  status("lost", "disconnected, trying again");
  say("Disconnected from palpate. This page connects again as soon as the server is back.", "bad");
}

function picture(): void {
  requestAnimationFrame(picture);
  if (document.hidden) return; // grants no credit, so nothing is sent either
  finger.tick();
  const frame = connection.take();
  const now = performance.now();
  if (frame) {
    [latest, lastFrame] = [frame, now];
    if (hello && hello.radius_parameter >= 0) finger.radius = frame.parameters[hello.radius_parameter] ?? hello.radius;
    describe(frame);
    if (changed(frame, drawn)) show();
    panel.update(frame);
  } else if (connection.connected && latest && now - lastFrame > SILENT) {
    status("warn", "no pictures from the server");
  }
  if (view?.render() && latest) where(view, latest);
}

/** Put on the page what follows the probe. */
function where(of: PressView, frame: Press): void {
  const label = element("arrow-label");
  label.hidden = !of.arrow.group.visible;
  if (!label.hidden) {
    label.textContent = `${fixed(Math.hypot(...frame.force), 2)} N`;
    const at = of.project(of.arrow.end);
    const x = Math.min(Math.max(at.x + 12, 4), canvas.clientWidth - label.offsetWidth - 4);
    label.style.transform = `translate(${x}px, ${Math.max(at.y - 12, 4)}px)`;
  }
  // for programs that drive the page: where the middle of the touched place is, in pixels of the window
  const [middle, box] = [of.middle(hello!.centre), canvas.getBoundingClientRect()];
  data["middle"] = `${middle.x + box.left} ${middle.y + box.top}`;
}

/** Whether two frames look different: a body at rest is not drawn again. */
function changed(a: Press, b: Press | null): boolean {
  if (!b || a.grabbed !== b.grabbed) return true;
  const differ = (p: ArrayLike<number>, q: ArrayLike<number>): boolean =>
    p.length !== q.length || Array.from(p).some((x, i) => Math.abs(x - q[i]!) > 1e-9);
  return (
    differ(a.coefficients, b.coefficients) ||
    differ(a.prints, b.prints) ||
    differ(a.foot, b.foot) ||
    differ(a.force, b.force) ||
    differ(a.position, b.position) ||
    differ(a.parameters, b.parameters)
  );
}

function recolour(): void {
  view?.recolour();
  panel.recolour();
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolour);
new ResizeObserver(() => {
  view?.resize();
  view?.look();
}).observe(canvas);
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) return;
  panel.hidden();
  status("warn", "in the background");
});
for (const id of ["show-ghost", "show-mesh"]) input(id).addEventListener("input", show);
canvas.addEventListener("dblclick", () => view?.look());
element("reset-view").addEventListener("click", () => view?.look());
requestAnimationFrame(picture);
