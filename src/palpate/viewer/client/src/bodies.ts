// The ways in which a touched body is drawn and held: a line, a surface that is pressed or pinched, a patch that is held.

import type { Arrow } from "./arrow";
import { NO_NEUTRAL } from "./colour";
import type { Link } from "./connection";
import { Field, Indentation } from "./field";
import { PullHand } from "./hand";
import type { Hand } from "./hand";
import { pinches } from "./hand_words";
import { choices, largest, legend, nothing, shares, trusted } from "./legend";
import { LineView } from "./line_view";
import { decodeTrustMap } from "./messages";
import type { FieldInfo, Frame, Hello, Surface, TrustMap, Vec3 } from "./messages";
import { Panel } from "./panel";
import { PinchHand } from "./pinch";
import { PinchView } from "./pinch_view";
import { PressHand } from "./press";
import { get, parts } from "./resources";
import { ToolShape } from "./tool_shape";
import { PadView, PressView } from "./touch_view";
import { element, fixed, input, measured } from "./units";
import type { View } from "./view";
import type { Vector3 } from "three";

const WORDS = ["title", "tools", "scale-notes", "legend"];
const TRUST_NOTE = "One standard deviation, with the probe half as deep as it may go.";

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
  /** Get ready to show another surrogate of the same body; returns what shows it from then on. */
  renew?(hello: Hello): Promise<() => void>;
  /** Draw dots where solves are done, m. */
  mark?(places: readonly Vec3[]): void;
}

export function bodyOf(hello: Hello, canvas: HTMLCanvasElement, connection: Link, panel: Panel): Body {
  if (hello.line) return new LineBody(hello, canvas, connection);
  return hello.holds ? new PadBody(hello, canvas, connection) : new PressedBody(hello, canvas, connection, panel);
}

class LineBody implements Body {
  readonly hand: PullHand;
  view: LineView | null = null;

  constructor(
    private readonly hello: Hello,
    private readonly canvas: HTMLCanvasElement,
    connection: Link,
  ) {
    this.hand = new PullHand(canvas, connection, hello);
  }

  async open(): Promise<void> {
    legend({ name: "displacement", unit: "m", low: 0, high: this.hello.deepest, components: 3, modes: 0 });
    this.view = new LineView(this.canvas, this.hello, WORDS.map(element));
    this.hand.attach(this.view);
    element("true-scale").hidden = this.view.enlargement === 1;
    element("true-scale").setAttribute("aria-pressed", "false"); // a body of before may have been shown to scale
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
  readonly hand: PressHand | PinchHand;
  view: PressView | null = null;
  private readonly shape: ToolShape;
  private surface: Surface | null = null;
  private fields: Field[] = [];
  private trust: TrustMap | null = null;
  private infos: FieldInfo[] = [];
  private indentation: Indentation | null = null;
  private still = new Float32Array();
  private shares = new Float32Array();
  private places: readonly Vec3[] = [];
  private chosen = 0;
  private latest: Frame | null = null;

  constructor(
    private hello: Hello,
    private readonly canvas: HTMLCanvasElement,
    connection: Link,
    panel: Panel,
  ) {
    this.shape = new ToolShape(hello.tool, hello.radius);
    if (pinches(hello)) {
      this.hand = new PinchHand(canvas, connection, hello, this.shape);
      return;
    }
    this.hand = new PressHand(canvas, connection, hello, this.shape);
    [this.hand.wanted, this.hand.most] = Panel.depths(hello);
    this.hand.deepened = (depth) => panel.depth(depth);
  }

  async open(): Promise<void> {
    const [surface, fields, trust] = await this.load(this.hello);
    const words = WORDS.map(element);
    if (this.hand instanceof PinchHand) {
      const view = new PinchView(this.canvas, surface, this.hello, words, this.shape);
      this.hand.attach(view);
      this.view = view;
    } else {
      this.view = new PressView(this.canvas, surface, this.hello, words, this.shape);
      this.hand.attach(this.view);
    }
    this.take(surface, fields, trust);
    for (const id of ["show-ghost", "show-mesh"]) input(id).addEventListener("input", () => this.draw());
    input("show-solves").addEventListener("input", () => this.mark(this.places));
  }

  async renew(hello: Hello): Promise<() => void> {
    const [surface, fields, trust] = await this.load(hello);
    return () => {
      this.hello = hello;
      if (!same(surface.rest, this.surface!.rest) || !same(surface.triangles, this.surface!.triangles)) {
        const before = this.view!; // of another mesh
        this.view = new PressView(this.canvas, surface, hello, WORDS.map(element), this.shape, before);
        before.clear();
        if (this.hand instanceof PressHand) this.hand.change(this.view); // no part is learnt between jaws
        this.mark(this.places);
      }
      this.take(surface, fields, trust);
      this.draw();
    };
  }

  mark(places: readonly Vec3[]): void {
    this.places = places;
    this.view?.mark(input("show-solves").checked ? places : []);
  }

  /** Fetch a version of the body. */
  private async load(hello: Hello): Promise<[Surface, Field[], TrustMap | null]> {
    const { version } = hello;
    const learnt = "learning" in document.documentElement.dataset;
    const [surface, trust, ...modes] = await Promise.all([
      parts().surface(version),
      learnt ? get(`trust?version=${version}`).then(decodeTrustMap) : null,
      ...hello.fields.map((_, i) => parts().modes(i, version)),
    ]);
    return [surface, hello.fields.map((info, i) => new Field(info, modes[i]!, surface.rest)), trust];
  }

  /** Draw from now on with this surface, these fields and this map. */
  private take(surface: Surface, fields: Field[], trust: TrustMap | null): void {
    [this.surface, this.fields] = [surface, fields];
    this.still = new Float32Array(surface.rest.length);
    this.shares = new Float32Array(surface.rest.length / 3);
    this.indentation = new Indentation(surface);
    const first = this.infos.length === 0;
    this.trust = trust;
    this.infos = [...fields.map((field) => field.info), ...(trust ? [trusted(trust)] : [])];
    const last = Math.max(this.infos.length - 1, 0);
    this.choose(first && trust ? last : Math.min(this.chosen, last));
    // between the map of trust and the displacement
    element("trust-toggle").onclick = () => this.choose(this.trusting ? 0 : last);
  }

  private choose(index: number): void {
    this.chosen = index;
    choices(this.infos, (other) => this.choose(other), index);
    element("trust-toggle").setAttribute("aria-pressed", String(this.trusting));
    element("legend-note").hidden = !this.trusting;
    // where the force is known well is no place without anything to show
    const none = this.trusting || !this.info ? NO_NEUTRAL : nothing(this.info);
    legend(this.info, none);
    if (this.info) this.view!.neutral(none);
    this.draw();
  }

  show(frame: Frame): void {
    this.latest = frame;
    const { radius_parameter: own, radius } = this.hello;
    if (own >= 0) this.shape.radius = frame.parameters[own] ?? radius;
    this.shape.follow(frame.parameters);
    this.hand.inForce = frame.parameters;
    this.draw();
  }

  notes(): string[] {
    const first = this.hello.fields[0];
    const words = first
      ? [first.components === 3 ? "displacement to scale" : "the surface is drawn at rest"]
      : ["no field in this file: the surface is drawn at rest,", pinches(this.hello) ? "and does not move" : "from its distance, and does not move"];
    return [...words, `grid ${measured(this.view!.cell, "m")}`];
  }

  place(): void {
    const { view, hello } = this;
    mark("middle", pinches(hello) ? view!.project(view!.grip) : view!.middle(hello.centre), this.canvas);
  }

  /** True where the colours show how well the force is known. */
  private get trusting(): boolean {
    return this.trust !== null && this.chosen === this.fields.length;
  }

  private get info(): FieldInfo | null {
    return this.infos[this.chosen] ?? null;
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
    const values = fields[this.chosen]?.sizes() ?? (this.trust ? deviations(this.trust) : this.still);
    const colours = this.trusting ? certainty(this.trust!) : info ? shares(info, values, this.shares) : plain(this.still.length);
    document.documentElement.dataset["summed"] = String(performance.now() - began); // ms
    const layers = { ghost: input("show-ghost").checked, mesh: input("show-mesh").checked };
    view.touch(latest, this.shape, moved, colours, layers);
    const most = largest(info, values);
    element("largest-note").textContent = this.trusting ? TRUST_NOTE : this.chosen === 0 && latest.grabbed ? remainder(latest.depth, most, this.hello) : "";
  }
}

class PadBody implements Body {
  readonly hand: PullHand;
  view: PadView | null = null;
  private surface: Surface | null = null;

  constructor(
    private readonly hello: Hello,
    private readonly canvas: HTMLCanvasElement,
    connection: Link,
  ) {
    this.hand = new PullHand(canvas, connection, hello);
  }

  async open(): Promise<void> {
    this.surface = await parts().surface(this.hello.version);
    this.view = new PadView(this.canvas, this.surface, this.hello, WORDS.map(element));
    this.hand.attach(this.view);
    legend({ name: "displacement", unit: "m", low: 0, high: this.hello.deepest, components: 3, modes: 0 });
  }

  show(frame: Frame): void {
    this.view?.hold(frame, plain(this.surface!.rest.length));
  }

  notes(): string[] {
    return ["the tissue follows the pad as a half-space follows a rigid disc", `grid ${measured(this.view!.cell, "m")}`];
  }

  place(): void {
    mark("tip", this.view!.project(this.view!.grip), this.canvas);
  }
}

/** Where the part of a press goes that does not move the body: the probe is a rigid ball or tool with a soft pad. */
function remainder(depth: number, most: number, hello: Hello): string {
  const rest = 1000 * (depth - most);
  if (rest < 0.005) return "";
  const deep = fixed(1000 * depth, 2);
  const name = pinches(hello) ? "deeper jaw" : hello.tool ? "tool" : "probe";
  return `The ${name} is ${deep} mm deep: the soft pad around it takes the other ${fixed(rest, 2)} mm.`;
}

/** Deviations of a map in per cent; 0 where there is none. */
function deviations({ values }: TrustMap): Float32Array {
  return values.map((v) => 100 * Math.max(v, 0));
}

/** Shares of the colour scale of a map: -1 where nothing was trained, -2 where nobody touches. */
function certainty({ values, high }: TrustMap): Float32Array {
  return values.map((v) => (v >= 0 ? v / high : v < -1.5 ? -1 : -2));
}

function same(a: Float32Array, b: Float32Array): boolean {
  return a.length === b.length && a.every((x, i) => x === b[i]);
}

function plain(numbers: number): Float32Array {
  return new Float32Array(numbers / 3);
}

let corner: DOMRect | null = null; // of the canvas in the window; asked for each picture, it would make the browser lay out the page
for (const event of ["resize", "scroll"]) addEventListener(event, () => (corner = null), { capture: true, passive: true });

/** For programs that drive the page: where a place is, in pixels of the window. */
function mark(name: string, at: { x: number; y: number }, canvas: HTMLCanvasElement): void {
  corner ??= canvas.getBoundingClientRect();
  document.documentElement.dataset[name] = `${at.x + corner.left} ${at.y + corner.top}`;
}
