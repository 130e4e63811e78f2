// The page of a surrogate that no hand feels: sliders for its inputs, its numbers with ±, fields on the body, curves, and how the
// numbers respond to one input. Its parts stand in the page; nothing is asked of a server.

import { about } from "./about";
import { AnswerBody } from "./answer_body";
import { AnswerParts } from "./answer_facts";
import type { CurveFacts, InputFacts, Named, Numbers } from "./answer_facts";
import { GraphSheet } from "./answer_graph";
import { Modes } from "./answer_modes";
import { Group } from "./answer_network";
import { say } from "./flags";
import { mode } from "./skeleton";
import { capital, element, multiple, rangeUnit, tidy, worded } from "./units";

const STEPS = 60; // intervals of a response
const SLIDER = 1000; // steps of a slider

/** Open the page. */
export function answers(): void {
  mode("answers");
  element("status").hidden = true; // nothing is connected
  AnswerParts.read()
    .then((parts) => new AnswerSheet(parts))
    .catch((error: unknown) => say(String(error), "bad"));
}

function named({ name, unit }: Named): string {
  return unit ? `${name} (${unit})` : name;
}

class AnswerSheet {
  private readonly inputs: InputFacts[];
  private readonly groups: Group[];
  private readonly curves: { facts: CurveFacts; modes: Modes; sheet: GraphSheet }[];
  private readonly body: AnswerBody | null;
  private readonly solves: Numbers | null;
  private readonly response = new GraphSheet(element<HTMLCanvasElement>("response"));
  private readonly sliders: HTMLInputElement[];
  private besides = false; // whether the nearest solve is drawn beside
  private x: number[];

  constructor(parts: AnswerParts) {
    const { facts } = parts;
    const data = document.documentElement.dataset;
    document.title = `${facts.name} · palpate`;
    element("model-name").textContent = facts.name;
    element("model-line").textContent = capital(facts.purpose);
    this.inputs = facts.inputs;
    this.groups = facts.groups.map((group) => new Group(parts, group));
    this.solves = facts.solves && parts.numbers(facts.solves);
    const wanted = new URLSearchParams(location.hash.slice(1));
    this.x = this.inputs.map((one) => startOf(one, wanted.get(one.name)));
    this.sliders = this.makeSliders();
    this.curves = facts.curves.map((curve) => ({ facts: curve, modes: new Modes(parts, curve), sheet: this.curveSheet(curve) }));
    data["body"] = facts.fields.length ? "" : "none";
    this.body = facts.fields.length ? new AnswerBody(parts, wanted.get("field"), () => this.keepLink()) : null;
    this.offer();
    about(facts, []);
    this.answer();
    this.body?.look(); // now that the words stand where they will
    window.addEventListener("hashchange", () => this.follow());
    data["ready"] = ""; // for programs that drive the page
    Object.assign(window, { palpate: { facts, ask: (x: number[]) => this.ask(x) } });
  }

  /** What the page computes at inputs: for programs that ask it. */
  private ask(x: number[]): unknown {
    const modal = (modes: Modes): unknown => {
      modes.ask(x);
      const [rows, columns] = [modes.values.length / modes.columns, modes.columns];
      const deviation = Array.from({ length: rows * columns }, (_, i) => modes.deviation(Math.floor(i / columns), i % columns));
      return { values: Array.from(modes.values), deviation, trusted: modes.group.trusted(x) };
    };
    const out = {
      numbers: this.groups.map((g) => ({ values: g.predict(x), deviation: g.deviation(x), trusted: g.trusted(x) })),
      fields: this.body?.fields.map(({ modes }) => modal(modes)) ?? [],
      nearest: this.body?.hasSolves ? this.body.fields.map(({ modes }) => Array.from(modes.solve(this.nearest(x)))) : [],
      curves: this.curves.map(({ modes }) => modal(modes)),
    };
    this.answer();
    return out;
  }

  private makeSliders(): HTMLInputElement[] {
    const made = this.inputs.map((one, i) => {
      const [label, slider, value] = [document.createElement("label"), document.createElement("input"), worded("output", "")];
      const { size, unit } = rangeUnit(one.low, one.high, one.unit);
      slider.type = "range";
      [slider.min, slider.max, slider.step] = [String(one.low), String(one.high), String((one.high - one.low) / SLIDER)];
      slider.valueAsNumber = this.x[i]!;
      slider.name = one.name;
      slider.setAttribute("aria-label", named(one));
      slider.addEventListener("input", () => {
        this.x[i] = slider.valueAsNumber;
        this.answer();
        this.keepLink();
      });
      const ends = document.createElement("small");
      ends.append(worded("span", tidy(one.low / size)), worded("span", `${tidy(one.high / size)} ${unit}`.trimEnd()));
      label.append(worded("span", one.name), value, slider, ends);
      element("answer-inputs").append(label);
      return slider;
    });
    return made;
  }

  private curveSheet(curve: CurveFacts): GraphSheet {
    const canvas = document.createElement("canvas");
    canvas.className = "graph";
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${curve.name} over ${curve.axis.name}`);
    element("curves").append(canvas);
    return new GraphSheet(canvas);
  }

  /** What there is to choose, and the buttons. */
  private offer(): void {
    const outputs = this.groups.flatMap((group) => group.outputs);
    const [which, over] = [element<HTMLSelectElement>("response-output"), element<HTMLSelectElement>("response-input")];
    which.append(...outputs.map(({ name }, i) => new Option(name, String(i))));
    over.append(...this.inputs.map(({ name }, i) => new Option(name, String(i))));
    for (const select of [which, over]) select.addEventListener("input", () => this.respond());
    element("numbers-section").hidden = element("response-section").hidden = outputs.length === 0;
    element("curves-section").hidden = this.curves.length === 0;
    element("solves-section").hidden = this.solves === null;
    element("to-nearest").addEventListener("click", () => this.go(this.solveAt(this.nearest(this.x))));
    element("beside").hidden = !(this.solves && this.body?.hasSolves);
    element("beside").addEventListener("click", () => {
      this.besides = !this.besides;
      element("beside").setAttribute("aria-pressed", String(this.besides));
      this.answer();
    });
    element("copy-link").addEventListener("click", () => {
      this.keepLink();
      const said = (words: string): void => void (element("copy-link").textContent = words);
      navigator.clipboard.writeText(location.href).then(
        () => said("copied"),
        () => said("copy the address of this page instead"),
      );
    });
  }

  /** Take the inputs of a changed address. */
  private follow(): void {
    const wanted = new URLSearchParams(location.hash.slice(1));
    this.go(this.inputs.map((one, i) => startOf(one, wanted.get(one.name), this.x[i])));
  }

  private go(x: number[]): void {
    this.x = x.map((v, i) => Math.min(Math.max(v, this.inputs[i]!.low), this.inputs[i]!.high));
    this.sliders.forEach((slider, i) => (slider.value = String(this.x[i])));
    this.answer();
    this.keepLink();
  }

  /** Keep the inputs in the address. */
  private keepLink(): void {
    const words = new URLSearchParams(this.inputs.map(({ name }, i) => [name, String(this.x[i])]));
    if (this.body) words.set("field", this.body.colouring);
    try {
      history.replaceState(null, "", `#${words.toString()}`);
    } catch (error) {
      if (!(error instanceof DOMException)) throw error; // a page inside of another one has no address of its own
    }
  }

  private answer(): void {
    const { x } = this;
    this.inputs.forEach((one, i) => {
      const { size, unit } = rangeUnit(one.low, one.high, one.unit);
      this.sliders[i]!.parentElement!.querySelector("output")!.textContent = `${tidy(x[i]! / size, 4)} ${unit}`.trimEnd();
    });
    this.body?.ask(x, this.besides ? this.nearest(x) : null);
    this.tellNumbers();
    this.tellRegion();
    for (const { facts, modes, sheet } of this.curves) {
      modes.ask(x);
      const rows = facts.axis.values.map((_, i) => i);
      const half = rows.map((i) => modes.group.factor * modes.deviation(i, 0));
      const y = rows.map((i) => modes.at(i, 0));
      sheet.show({ x: facts.axis.values, y, half, across: named(facts.axis), along: named(facts), mark: null });
    }
    this.respond();
    this.tellNearest();
  }

  private tellNumbers(): void {
    const rows = this.groups.flatMap((group) => {
      const [values, deviation] = [group.predict(this.x), group.deviation(this.x)];
      return group.outputs.map(({ name, unit: own }, j) => {
        const [value, half] = [values[j]!, group.factor * deviation[j]!];
        const { size, unit } = multiple(value, own);
        const [row, big] = [document.createElement("div"), worded("p", "")];
        big.className = "big";
        const [number, units, spread] = [worded("output", tidy(value / size, 4)), worded("span", unit), worded("span", "")];
        [units.className, spread.className] = ["unit", "spread"];
        spread.textContent = Number.isFinite(half) ? `± ${tidy(half / size, 2)}` : "";
        number.dataset["value"] = String(value); // for programs that read the page
        big.append(number, units, spread);
        row.append(worded("span", name), big);
        return row;
      });
    });
    element("numbers").replaceChildren(...rows);
    const sure = this.groups.some((group) => group.deviation(this.x).some(Number.isFinite));
    const level = Math.round(100 * (this.groups[0]?.level ?? 0));
    element("numbers-note").textContent = sure ? `± holds ${level} % of unseen solves` : "How far they may be off is not known.";
  }

  private tellRegion(): void {
    const groups = this.groups.map((group) => ({ name: group.outputs.map(({ name }) => name).join(", "), group }));
    const fields = (this.body?.fields ?? []).map(({ facts, modes }) => ({ name: facts.name, group: modes.group }));
    const curves = this.curves.map(({ facts, modes }) => ({ name: facts.name, group: modes.group }));
    const all = [...groups, ...fields, ...curves];
    const astray = all.filter(({ group }) => !group.trusted(this.x)).map(({ name }) => name);
    const words = element("answer-region");
    words.dataset["tone"] = astray.length ? "warn" : "good";
    const which = astray.length < all.length ? ` for ${astray.join(", ")}` : "";
    words.textContent = astray.length ? `Outside the trained region${which}: don't rely on it.` : "Inside the trained region.";
  }

  private respond(): void {
    const [which, over] = ["response-output", "response-input"].map((id) => Number(element<HTMLSelectElement>(id).value)) as [number, number];
    let [left, group] = [which, this.groups[0]];
    for (const one of this.groups) {
      group = one;
      if (left < one.outputs.length) break;
      left -= one.outputs.length;
    }
    const along = this.inputs[over];
    if (!group || !along) return;
    const { size, unit } = rangeUnit(along.low, along.high, along.unit);
    const x = Array.from({ length: STEPS + 1 }, (_, i) => along.low + (i / STEPS) * (along.high - along.low));
    const places = x.map((v) => this.x.map((own, i) => (i === over ? v : own)));
    this.response.show({
      x: x.map((v) => v / size),
      y: places.map((place) => group.predict(place)[left]!),
      half: places.map((place) => group.factor * group.deviation(place)[left]!),
      across: named({ name: along.name, unit }),
      along: named(group.outputs[left]!),
      mark: this.x[over]! / size,
    });
    element("response").setAttribute("aria-label", `${group.outputs[left]!.name} over ${along.name}`);
  }

  /** Number of the solve that is nearest in scaled inputs. */
  private nearest(x: readonly number[]): number {
    const { solves, inputs } = this;
    const n = inputs.length;
    let [best, least] = [0, Infinity];
    for (let i = 0; i < solves!.length; i += n) {
      const far = inputs.reduce((sum, { low, high }, j) => sum + ((solves![i + j]! - x[j]!) / (high - low)) ** 2, 0);
      if (far < least) [best, least] = [i / n, far];
    }
    return best;
  }

  private solveAt(number: number): number[] {
    const n = this.inputs.length;
    return Array.from(this.solves!.subarray(number * n, (number + 1) * n));
  }

  private tellNearest(): void {
    if (!this.solves) return;
    const rows = this.solveAt(this.nearest(this.x)).flatMap((v, i) => {
      const one = this.inputs[i]!;
      const { size, unit } = rangeUnit(one.low, one.high, one.unit);
      return [worded("dt", one.name), worded("dd", `${tidy(v / size, 4)} ${unit}`.trimEnd())];
    });
    element("nearest").replaceChildren(...rows);
  }
}

/** A slider's value: of the address where that has one inside the range, else `other`, by default the middle. */
function startOf({ low, high }: InputFacts, words: string | null, other = (low + high) / 2): number {
  const value = words === null || words === "" ? NaN : Number(words);
  return Number.isFinite(value) ? Math.min(Math.max(value, low), high) : other;
}
