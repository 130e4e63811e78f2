// The three ways in which a touched body is drawn and held: a line, a surface that is pressed, a patch that is held.

import type { Arrow } from "./arrow";
import type { Connection } from "./connection";
import { Field, Indentation } from "./field";
import { PullHand } from "./hand";
import type { Hand } from "./hand";
import { choices, largest, legend, nothing, shares } from "./legend";
import { LineView } from "./line_view";
import { decodeModes, decodeSurface } from "./messages";
import type { FieldInfo, Frame, Hello, Surface } from "./messages";
import { Panel } from "./panel";
import { PressHand } from "./press";
import { PadView, PressView } from "./touch_view";
import { element, fixed, input, measured } from "./units";
import type { View } from "./view";
import type { Vector3 } from "three";

const WORDS = ["title", "tools", "scale-notes", "legend"];

/** A body on the page, with the hand that touches it. */
export interface Body {
  readonly hand: Hand;
  /** null until `open` is done, or where the browser offers no WebGL */
  readonly view: (View & { arrow: Arrow; grip: Vector3 }) | null;
  open(): Promise<void>;
  show(frame: Frame): void;
  /** Notes on how it is drawn. */
  notes(): string[];
  /** Publish where the hand's place is, for programs that drive the page. */
  place(): void;
}

export function bodyOf(hello: Hello, canvas: HTMLCanvasElement, connection: Connection, panel: Panel): Body {
  if (hello.line) return new LineBody(hello, canvas, connection);
  return hello.holds ? new PadBody(hello, canvas, connection) : new PressedBody(hello, canvas, connection, panel);
}

class LineBody implements Body {
  readonly hand: PullHand;
  view: LineView | null = null;

  constructor(
    private readonly hello: Hello,
    private readonly canvas: HTMLCanvasElement,
    connection: Connection,
  ) {
    this.hand = new PullHand(canvas, connection, hello);
  }

  async open(): Promise<void> {
    legend({ name: "displacement", unit: "m", low: 0, high: this.hello.deepest, components: 3, modes: 0 });
    this.view = new LineView(this.canvas, this.hello, WORDS.map(element));
    this.hand.attach(this.view);
    element("true-scale").hidden = this.view.enlargement === 1;
  }

  show(frame: Frame): void {
    this.view?.show(frame);
  }

  notes(): string[] {
    return this.view!.notes();
  }

  place(): void {
    mark("tip", this.view!.project(this.view!.grip), this.canvas);
  }
}

class PressedBody implements Body {
  readonly hand: PressHand;
  view: PressView | null = null;
  private fields: Field[] = [];
  private indentation: Indentation | null = null;
  private still = new Float32Array();
  private chosen = 0;
  private latest: Frame | null = null;

  constructor(
    private readonly hello: Hello,
    private readonly canvas: HTMLCanvasElement,
    connection: Connection,
    panel: Panel,
  ) {
    this.hand = new PressHand(canvas, connection, hello);
    [this.hand.wanted, this.hand.most] = Panel.depths(hello);
    this.hand.radius = hello.radius;
    this.hand.deepened = (depth) => panel.depth(depth);
  }

  async open(): Promise<void> {
    const infos = this.hello.fields;
    const surface = decodeSurface(await get("surface"));
    const modes = await Promise.all(infos.map(async (_, i) => decodeModes(await get(`fields/${i}`))));
    this.fields = infos.map((info, i) => new Field(info, modes[i]!, surface.rest));
    this.still = new Float32Array(surface.rest.length);
    this.indentation = new Indentation(surface);
    choices(infos, (index) => {
      this.chosen = index;
      legend(this.info);
      this.view?.neutral(nothing(this.info!));
      this.draw();
    });
    legend(this.info);
    this.view = new PressView(this.canvas, surface, this.hello, WORDS.map(element));
    if (this.info) this.view.neutral(nothing(this.info));
    this.hand.attach(this.view);
    for (const id of ["show-ghost", "show-mesh"]) input(id).addEventListener("input", () => this.draw());
  }

  show(frame: Frame): void {
    this.latest = frame;
    const { radius_parameter: own, radius } = this.hello;
    if (own >= 0) this.hand.radius = frame.parameters[own] ?? radius;
    this.draw();
  }

  notes(): string[] {
    const first = this.hello.fields[0];
    const words = first
      ? [first.components === 3 ? "displacement to scale" : "the surface is drawn at rest"]
      : ["no field in this file: the surface is drawn at rest,", "from its distance, and does not move"];
    return [...words, `grid ${measured(this.view!.cell, "m")}`];
  }

  place(): void {
    mark("middle", this.view!.middle(this.hello.centre), this.canvas);
  }

  private get info(): FieldInfo | null {
    return this.hello.fields[this.chosen] ?? null;
  }

  private draw(): void {
    const { latest, view, fields, info } = this;
    if (!latest || !view) return;
    const began = performance.now();
    let at = 0;
    fields.forEach((field, i) => {
      const numbers = latest.coefficients.subarray(at, (at += field.count));
      // the first moves the surface, the chosen one colours it
      if (i === 0 || i === this.chosen) field.update(numbers, latest.contact);
    });
    const first = fields[0];
    if (first?.info.components !== 3) this.still.fill(0);
    const moved = first?.info.components === 3 ? first.values : this.still;
    this.indentation?.into(moved, latest.indentation);
    const values = fields[this.chosen]?.sizes() ?? this.still;
    const colours = info ? shares(info, values) : plain(this.still.length);
    document.documentElement.dataset["summed"] = String(performance.now() - began); // ms
    const layers = { ghost: input("show-ghost").checked, mesh: input("show-mesh").checked };
    view.touch(latest, this.hand.radius, moved, colours, layers);
    const most = largest(info, values);
    element("largest-note").textContent = this.chosen === 0 && latest.grabbed ? remainder(latest.depth, most) : "";
  }
}

class PadBody implements Body {
  readonly hand: PullHand;
  view: PadView | null = null;
  private surface: Surface | null = null;

  constructor(
    private readonly hello: Hello,
    private readonly canvas: HTMLCanvasElement,
    connection: Connection,
  ) {
    this.hand = new PullHand(canvas, connection, hello);
  }

  async open(): Promise<void> {
    this.surface = decodeSurface(await get("surface"));
    this.view = new PadView(this.canvas, this.surface, this.hello, WORDS.map(element));
    this.hand.attach(this.view);
  }

  show(frame: Frame): void {
    this.view?.hold(frame, plain(this.surface!.rest.length));
  }

  notes(): string[] {
    return ["the face around the pad is drawn at rest", `grid ${measured(this.view!.cell, "m")}`];
  }

  place(): void {
    mark("tip", this.view!.project(this.view!.grip), this.canvas);
  }
}

/** Where the part of a press goes that does not move the body: the probe is a rigid ball with a soft pad. */
function remainder(depth: number, most: number): string {
  const rest = 1000 * (depth - most);
  if (rest < 0.005) return "";
  const deep = fixed(1000 * depth, 2);
  return `The probe is ${deep} mm deep: the soft pad around it takes the other ${fixed(rest, 2)} mm.`;
}

async function get(path: string): Promise<ArrayBuffer> {
  const answer = await fetch(`./${path}`);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.arrayBuffer();
}

function plain(numbers: number): Float32Array {
  return new Float32Array(numbers / 3);
}

/** For programs that drive the page: where a place is, in pixels of the window. */
function mark(name: string, at: { x: number; y: number }, canvas: HTMLCanvasElement): void {
  const box = canvas.getBoundingClientRect();
  document.documentElement.dataset[name] = `${at.x + box.left} ${at.y + box.top}`;
}
