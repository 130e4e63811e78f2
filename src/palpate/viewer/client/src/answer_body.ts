// The body of a page of answers: which field colours it, how far it is moved, and the value at a place that was clicked.

import type { AnswerParts, FieldFacts, Scale } from "./answer_facts";
import { Modes } from "./answer_modes";
import { AnswerView } from "./answer_view";
import type { Place } from "./answer_view";
import { choices, largest, legend, nothing, shares } from "./legend";
import type { FieldInfo, Surface, Vec3 } from "./messages";
import { watch } from "./skeleton";
import { element, input, measured, multiple, round125, tidy, worded } from "./units";

const CLICK = 5; // px, that the mouse may move between press and release
const SEEN = 0.05; // of the body's size, that the largest displacement is drawn as at first

interface Choice {
  field: number;
  scale: Scale;
  info: FieldInfo;
}

export class AnswerBody {
  readonly fields: { facts: FieldFacts; modes: Modes }[];
  private readonly choices: Choice[];
  private readonly surfaces: { surface: Surface; source: Int32Array; moved: Int32Array }[];
  private readonly factors: number[];
  private readonly canvas = element<HTMLCanvasElement>("view");
  private chosen: number;
  private view: AnswerView;
  private solve: number | null = null; // number of the solve that is drawn beside
  private probed: { place: Place; mesh: number; kind: string } | null = null;

  constructor(parts: AnswerParts, wanted: string | null, changed: () => void) {
    this.fields = parts.facts.fields.map((facts) => ({ facts, modes: new Modes(parts, facts) }));
    this.surfaces = parts.facts.fields.map(({ drawing }) => ({
      surface: surfaceOf(parts, drawing),
      source: parts.numbers(drawing.source) as Int32Array,
      moved: parts.numbers(drawing.moved) as Int32Array,
    }));
    this.choices = parts.facts.fields.flatMap((facts, field) =>
      facts.scales.map((scale) => {
        const { name, low, high } = scale;
        return { field, scale, info: { name, unit: facts.unit, low, high, components: 1, modes: 0 } };
      }),
    );
    this.chosen = Math.max(0, this.choices.findIndex(({ info }) => info.name === wanted));
    this.view = this.made(null);
    choices(
      this.choices.map(({ info }) => info),
      (index) => {
        const before = this.now.field;
        this.chosen = index;
        if (this.now.field !== before) this.view = this.made(this.view);
        this.view.neutral(nothing(this.now.info));
        this.draw();
        changed();
      },
      this.chosen,
    );
    this.factors = this.offered();
    this.offerFactors();
    this.listen();
    requestAnimationFrame(() => this.picture());
  }

  /** Name of what colours the body. */
  get colouring(): string {
    return this.now.info.name;
  }

  /** Answer other inputs, with a solve beside, by its number, where one is to be drawn. */
  ask(x: readonly number[], solve: number | null): void {
    for (const { modes } of this.fields) modes.ask(x);
    this.solve = solve;
    this.draw();
  }

  /** Whether the solves that the fields were learnt from can be drawn. */
  get hasSolves(): boolean {
    return this.fields.every(({ modes }) => modes.hasSolves);
  }

  look(): void {
    this.view.look();
  }

  private get now(): Choice {
    return this.choices[this.chosen]!;
  }

  private get mover(): { facts: FieldFacts; modes: Modes } | undefined {
    const { mesh } = this.fields[this.now.field]!.facts;
    return this.fields.find(({ facts }) => facts.moves && facts.mesh === mesh);
  }

  private made(before: AnswerView | null): AnswerView {
    before?.clear();
    const words = ["title", "tools", "scale-notes", "legend"].map(element);
    const view = new AnswerView(this.canvas, this.surfaces[this.now.field]!.surface, words, before);
    view.neutral(nothing(this.now.info));
    return view;
  }

  /** Factors of the displacement: none, true scale, and so many that it is seen. */
  private offered(): number[] {
    const most = Math.max(0, ...this.fields.flatMap(({ facts }) => (facts.moves ? [facts.scales[0]!.high] : [])));
    if (most === 0) return [0];
    const seen = (SEEN * this.view.extent) / most;
    return seen > 1 ? [0, 1, round125(seen)] : [0, 1];
  }

  private offerFactors(): void {
    element("drawn-section").hidden = this.factors.length < 2;
    input("answer-factor").max = String(this.factors.length - 1);
    input("answer-factor").valueAsNumber = this.factors.length - 1;
    input("answer-factor").addEventListener("input", () => this.draw());
  }

  private draw(): void {
    const { field, scale, info } = this.now;
    const { surface, source, moved } = this.surfaces[field]!;
    const { modes } = this.fields[field]!;
    const { mover, solve } = this;
    const displaced = (all: Float64Array | undefined): Float32Array => {
      const displacement = new Float32Array(surface.rest.length);
      if (!mover || !all) return displacement;
      const { columns } = mover.modes;
      moved.forEach((row, i) => {
        for (let k = 0; k < columns; k++) displacement[3 * i + k] = all[row * columns + k]!;
      });
      return displacement;
    };
    const values = Float32Array.from(source, (row) => modes.at(row, scale.component));
    const factor = mover ? this.factors[input("answer-factor").valueAsNumber]! : 0;
    this.view.deform(displaced(mover?.modes.values), factor, shares(info, values), null, { ghost: factor > 0, mesh: false });
    if (solve === null) this.view.beside(null);
    else {
      const solved = modes.solve(solve);
      const theirs = Float32Array.from(source, (row) => modes.at(row, scale.component, solved));
      this.view.beside({ displacement: displaced(mover?.modes.solve(solve)), factor, shares: shares(info, theirs) });
    }
    legend(info);
    largest(info, values);
    element("answer-factor-label").textContent = `× ${tidy(factor)}`;
    const right = solve === null ? "" : "right: the nearest solve, left: the model";
    const drawn = !mover ? "" : factor === 1 ? "displacement to scale" : `displacement drawn × ${tidy(factor)}`;
    element("scale-notes").replaceChildren(
      ...[right, drawn, `grid ${measured(this.view.cell, "m")}`].filter(Boolean).map((words) => worded("div", words)),
    );
    this.read();
  }

  /** Say the value at the place that was clicked. */
  private read(): void {
    element("reading-section").hidden = false;
    const { field, scale, info } = this.now;
    const { facts, modes } = this.fields[field]!;
    const { probed } = this;
    if (!probed || probed.mesh !== facts.mesh || probed.kind !== facts.kind) {
      element("reading").textContent = "Click or tap the body to read the value there.";
      this.view.mark([]);
      return;
    }
    const rows = probed.place.corners.map((i) => this.surfaces[field]!.source[i]!) as Vec3;
    const parts = probed.place.shares;
    const value = rows.reduce((sum, row, j) => sum + parts[j]! * modes.at(row, scale.component), 0);
    const nearest = rows[parts.indexOf(Math.max(...parts))]!;
    const half = scale.component < 0 ? NaN : modes.group.factor * modes.deviation(nearest, scale.component);
    const { size, unit } = multiple(value, info.unit);
    const spread = Number.isFinite(half) ? ` ± ${tidy(half / size, 2)}` : "";
    const place = this.view.placeAtRest(probed.place);
    const where = place.map((v) => tidy(1000 * v)).join(", ");
    element("reading").textContent = `${info.name} ${tidy(value / size, 4)}${spread} ${unit} at (${where}) mm`;
    this.view.mark([place]);
    element("reading").dataset["value"] = String(value); // for programs that read the page
  }

  private listen(): void {
    watch(
      () => this.view,
      () => this.draw(),
    );
    const { canvas } = this;
    let pressed: [number, number] | null = null;
    canvas.addEventListener("pointerdown", (e) => (pressed = [e.offsetX, e.offsetY]));
    canvas.addEventListener("pointerup", (e) => {
      if (!pressed || Math.hypot(e.offsetX - pressed[0], e.offsetY - pressed[1]) > CLICK) return;
      const [place, { facts }] = [this.view.place(e.offsetX, e.offsetY), this.fields[this.now.field]!];
      this.probed = place && { place, mesh: facts.mesh, kind: facts.kind };
      this.read();
    });
  }

  private picture(): void {
    requestAnimationFrame(() => this.picture());
    if (!document.hidden && this.view.render()) document.documentElement.dataset["drawn"] = this.colouring;
  }
}

function surfaceOf(parts: AnswerParts, drawing: FieldFacts["drawing"]): Surface {
  const none = new Float32Array(0);
  return {
    rest: parts.numbers(drawing.rest) as Float32Array,
    triangles: Float32Array.from(parts.numbers(drawing.triangles)),
    creases: Float32Array.from(parts.numbers(drawing.creases)),
    fixed: none,
    touchable: none,
    yielding: none,
    normals: none,
  };
}
