// The page of a solved body: one of its states at a time, fetched when it is wanted.

import { gradient } from "./colour";
import { decodeStep, decodeSurface, isShown, PROTOCOL } from "./messages";
import type { FieldInfo, Shown, Step } from "./messages";
import { SolidView } from "./solid";
import { measured, multiple, tidy } from "./units";

const KEPT = 64; // states kept in memory
const FRAME = 120; // ms between states while playing
const FACTORS = [0, 1, 2, 5, 10, 20, 50];

const element = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;
const input = (id: string): HTMLInputElement => element<HTMLInputElement>(id);
const canvas = element<HTMLCanvasElement>("view");
const steps = new Map<number, Promise<Step>>();
const data = document.documentElement.dataset;

let shown: Shown;
let view: SolidView;
let current: Step | null = null;
let field = 0;
let wanted = 0;
let playing = 0;

async function open(): Promise<void> {
  const message = (await (await get("shown")).json()) as { kind: string };
  if (!isShown(message)) throw new Error("the server speaks of something else");
  if (message.protocol !== PROTOCOL) {
    location.reload(); // the server is of another version than this page
    return;
  }
  shown = message;
  document.title = `${shown.name} · palpate`;
  element("model-name").textContent = shown.name;
  const surface = decodeSurface(await (await get("surface")).arrayBuffer());
  element("model-line").textContent =
    `${shown.steps.length === 1 ? "one state" : `${shown.steps.length} states`}, ` +
    `${surface.triangles.length / 3} triangles`;
  element("legend-bar").style.background = gradient();
  choices();
  states();
  view = new SolidView(canvas, surface, ["title", "tools", "scale-notes", "legend"].map(element));
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
  wanted = Math.min(Math.max(index, 0), shown.steps.length - 1);
  input("state").valueAsNumber = wanted;
  const asked = wanted;
  const step = await fetched(asked);
  if (asked !== wanted) return;
  current = step;
  draw();
  if (asked + 1 < shown.steps.length) void fetched(asked + 1).catch(fail);
}

function draw(): void {
  if (!current) return;
  const info = shown.fields[field]!;
  const values = valuesOf(current, field);
  const factor = FACTORS[input("factor").valueAsNumber]!;
  const shares = values.map((v) => (v - info.low) / (info.high - info.low));
  view.show(current, factor, shares, {
    probe: input("show-probe").checked,
    ghost: input("show-ghost").checked,
    mesh: input("show-mesh").checked,
  });
  tell(info, values, factor);
}

/** Values of a field at the surface's points; the first field is the displacement's size. */
function valuesOf(step: Step, which: number): Float32Array {
  const u = step.displacement;
  const count = u.length / 3;
  if (which > 0) return step.values.subarray((which - 1) * count, which * count);
  return Float32Array.from({ length: count }, (_, i) => Math.hypot(u[3 * i]!, u[3 * i + 1]!, u[3 * i + 2]!));
}

function tell(info: FieldInfo, values: Float32Array, factor: number): void {
  const step = shown.steps[current!.index]!;
  const full = Math.max(Math.abs(info.low), Math.abs(info.high));
  const { size, unit } = multiple(full, info.unit);
  const largest = values.reduce((a, b) => Math.max(a, b), -Infinity);
  element("largest-title").textContent = `Largest ${info.name}`;
  element("largest").textContent = tidy(largest / size);
  element("largest-unit").textContent = unit;
  element("legend-title").textContent = unit ? `${info.name} (${unit})` : info.name;
  ticks(info.low / size, info.high / size);
  element("state-label").textContent = step.label;
  element("state-count").textContent = `${current!.index + 1} of ${shown.steps.length}`;
  element("factor-label").textContent = `× ${factor}`;
  const drawn = factor === 1 ? "displacement to scale" : `displacement drawn × ${factor}`;
  const cell = `grid ${measured(view.cell, "m")}`;
  element("scale-notes").replaceChildren(...[drawn, cell].map(line));
  element("figures-section").hidden = Object.keys(step.figures).length === 0;
  element("figures").replaceChildren(
    ...Object.entries(step.figures).flatMap(([name, words]) => [pair("dt", name), pair("dd", String(words))]),
  );
  // for programs that read the page
  data["step"] = String(current!.index);
  data["field"] = info.name;
  data["largest"] = String(largest);
  data["factor"] = String(factor);
}

function ticks(low: number, high: number): void {
  const marks = [0, 0.5, 1].map((t) => {
    const mark = document.createElement("span");
    mark.textContent = tidy(low + t * (high - low));
    return mark;
  });
  element("legend-ticks").replaceChildren(...marks);
}

function line(words: string): HTMLElement {
  const row = document.createElement("div");
  row.textContent = words;
  return row;
}

function pair(tag: "dt" | "dd", words: string): HTMLElement {
  const cell = document.createElement(tag);
  cell.textContent = words;
  return cell;
}

/** A button for each field. */
function choices(): void {
  element("colours").hidden = shown.fields.length < 2;
  const buttons = shown.fields.map((info, i) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = info.name;
    button.setAttribute("aria-pressed", String(i === field));
    button.addEventListener("click", () => {
      field = i;
      buttons.forEach((other, j) => other.setAttribute("aria-pressed", String(j === i)));
      draw();
    });
    return button;
  });
  element("fields").replaceChildren(...buttons);
}

function states(): void {
  element("states").hidden = shown.steps.length < 2;
  input("state").max = String(shown.steps.length - 1);
}

function play(on: boolean): void {
  clearInterval(playing);
  element("play").setAttribute("aria-pressed", String(on));
  element("play").textContent = on ? "pause" : "play";
  playing = on ? window.setInterval(() => void move((wanted + 1) % shown.steps.length), FRAME) : 0;
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
  canvas.addEventListener("dblclick", () => view.look());
  element("reset-view").addEventListener("click", () => view.look());
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => view.recolour());
  new ResizeObserver(() => {
    view.resize();
    view.look();
  }).observe(canvas);
}

function picture(): void {
  requestAnimationFrame(picture);
  if (!document.hidden && view.render() && current) data["drawn"] = String(current.index);
}

function fail(error: unknown): void {
  play(false);
  const banner = element("banner");
  banner.textContent = `The body can't be shown: ${String(error)}.`;
  banner.hidden = false;
}

open().catch(fail);
