// The page of a solved body: one of its states at a time, fetched when it is wanted.

import { say } from "./flags";
import { choices, largest, legend, nothing, shares } from "./legend";
import { decodeStep, decodeSurface, isShown, PROTOCOL } from "./messages";
import type { FieldInfo, Shown, Step } from "./messages";
import { mode, watch } from "./skeleton";
import { SurfaceView } from "./surface_view";
import { ToolShape } from "./tool_shape";
import { element, input, measured, worded } from "./units";

const KEPT = 64; // states kept in memory
const FRAME = 120; // ms between states while playing
const FACTORS = [0, 1, 2, 5, 10, 20, 50];

const canvas = element<HTMLCanvasElement>("view");
const steps = new Map<number, Promise<Step>>();
const data = document.documentElement.dataset;

let facts: Shown;
let view: SurfaceView;
let shape: ToolShape;
let current: Step | null = null;
let field = 0;
let wanted = 0;
let playing = 0;

export function shown(): void {
  mode("shown");
  element("status").hidden = true; // nothing is connected
  open().catch(fail);
}

async function open(): Promise<void> {
  const message = (await (await get("shown")).json()) as { kind: string };
  if (!isShown(message)) throw new Error("the server speaks of something else");
  if (message.protocol !== PROTOCOL) {
    location.reload(); // the server is of another version than this page
    return;
  }
  facts = message;
  document.title = `${facts.name} · palpate`;
  element("model-name").textContent = facts.name;
  const surface = decodeSurface(await (await get("surface")).arrayBuffer());
  element("model-line").textContent =
    `${facts.steps.length === 1 ? "one state" : `${facts.steps.length} states`}, ` +
    `${surface.triangles.length / 3} triangles`;
  choices(facts.fields, (index) => {
    field = index;
    view.neutral(nothing(facts.fields[field]!));
    draw();
  });
  element("states").hidden = facts.steps.length < 2;
  input("state").max = String(facts.steps.length - 1);
  shape = new ToolShape(facts.tool, 0);
  view = new SurfaceView(canvas, surface, ["title", "tools", "scale-notes", "legend"].map(element));
  view.shape(shape);
  view.neutral(nothing(facts.fields[field]!));
  listen();
  requestAnimationFrame(picture);
  await go(0);
  view.look(); // now that the words stand where they will
}

async function get(path: string): Promise<Response> {
  const answer = await fetch(`./${path}`);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer;
}

function fetched(index: number): Promise<Step> {
  let step = steps.get(index);
  if (!step) {
    step = get(`steps/${index}`).then(async (answer) => decodeStep(await answer.arrayBuffer()));
    steps.set(index, step);
    if (steps.size > KEPT) steps.delete(steps.keys().next().value!);
  }
  return step;
}

/** Show a state as soon as it is here, unless another has been asked for meanwhile. */
async function go(index: number): Promise<void> {
  wanted = Math.min(Math.max(index, 0), facts.steps.length - 1);
  input("state").valueAsNumber = wanted;
  const asked = wanted;
  const step = await fetched(asked);
  if (asked !== wanted) return;
  current = step;
  draw();
  if (asked + 1 < facts.steps.length) void fetched(asked + 1).catch(fail);
}

function draw(): void {
  if (!current) return;
  const info = facts.fields[field]!;
  const values = valuesOf(current, field);
  const factor = FACTORS[input("factor").valueAsNumber]!;
  const probe = current.probed && input("show-probe").checked ? { centre: current.centre, shape } : null;
  [shape.radius, shape.turn, shape.opening] = [current.radius, current.turn, current.opening];
  const layers = { ghost: input("show-ghost").checked, mesh: input("show-mesh").checked };
  view.deform(current.displacement, factor, shares(info, values), probe, layers);
  legend(info);
  largest(info, values);
  tell(info, factor);
}

/** Values of a field at the surface's points; the first field is the displacement's size. */
function valuesOf(step: Step, which: number): Float32Array {
  const u = step.displacement;
  const count = u.length / 3;
  if (which > 0) return step.values.subarray((which - 1) * count, which * count);
  return Float32Array.from({ length: count }, (_, i) => Math.hypot(u[3 * i]!, u[3 * i + 1]!, u[3 * i + 2]!));
}

function tell(info: FieldInfo, factor: number): void {
  const step = facts.steps[current!.index]!;
  element("state-label").textContent = step.label;
  element("state-count").textContent = `${current!.index + 1} of ${facts.steps.length}`;
  element("factor-label").textContent = `× ${factor}`;
  const drawn = factor === 1 ? "displacement to scale" : `displacement drawn × ${factor}`;
  const cell = `grid ${measured(view.cell, "m")}`;
  element("scale-notes").replaceChildren(...[drawn, cell].map((words) => worded("div", words)));
  element("figures-section").hidden = Object.keys(step.figures).length === 0;
  element("figures").replaceChildren(
    ...Object.entries(step.figures).flatMap(([name, words]) => [worded("dt", name), worded("dd", String(words))]),
  );
  // for programs that read the page
  data["step"] = String(current!.index);
  data["field"] = info.name;
  data["factor"] = String(factor);
}

function play(on: boolean): void {
  clearInterval(playing);
  element("play").setAttribute("aria-pressed", String(on));
  element("play").textContent = on ? "pause" : "play";
  playing = on ? window.setInterval(() => void move((wanted + 1) % facts.steps.length), FRAME) : 0;
}

function move(index: number): Promise<void> {
  return go(index).catch(fail);
}

function listen(): void {
  input("state").addEventListener("input", () => void move(input("state").valueAsNumber));
  element("back").addEventListener("click", () => void move(wanted - 1));
  element("forth").addEventListener("click", () => void move(wanted + 1));
  element("play").addEventListener("click", () => play(!playing));
  for (const id of ["factor", "show-probe", "show-ghost", "show-mesh"]) input(id).addEventListener("input", draw);
  canvas.addEventListener("keydown", (event) => {
    if (event.key === "ArrowRight") void move(wanted + 1);
    else if (event.key === "ArrowLeft") void move(wanted - 1);
  });
  watch(() => view);
}

function picture(): void {
  requestAnimationFrame(picture);
  if (!document.hidden && view.render() && current) data["drawn"] = String(current.index);
}

function fail(error: unknown): void {
  play(false);
  say(`The body can't be shown: ${String(error)}.`, "bad");
}
