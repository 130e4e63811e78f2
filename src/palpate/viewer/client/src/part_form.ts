// The form beside a part that is set up: material, and what presses. Numbers are judged by the server when their field is left; a
// sentence about one of them is looked at again with each key, so that it goes as soon as the number is right.

import type { DrawnTool, MaterialInfo, PartFacts, StartWish, ToolInfo } from "./messages";
import { lengthOf } from "./lengths";
import { ToolShape } from "./tool_shape";
import { element, input, worded } from "./units";

const PAUSE = 250; // ms without a key until a number that was wrong is judged again
const FIXED: Record<string, string> = { young: "young", poisson: "poisson", radius: "ball-radius", depth: "ball-depth" };
const KINDS = { tissue: "tissues", silicone: "silicones", other: "others" } as const;
const BALL = "ball";

/** A label, and the box of a text that it is for. */
function labelled(id: string, words: string): [HTMLLabelElement, HTMLInputElement] {
  const [label, box] = [worded("label", words) as HTMLLabelElement, document.createElement("input")];
  [box.id, box.type, box.autocomplete, box.spellcheck] = [id, "text", "off", false];
  label.htmlFor = id;
  return [label, box];
}

export class PartForm {
  /** Hears of another tool, or another size of it, that can be drawn. */
  reshaped: () => void = () => {};

  private readonly left = new Set<string>(); // fields that a person has left, with what stands in them now
  private readonly boxes = new Map(Object.entries(FIXED)); // id of the box of each field
  private waiting = 0;
  private drawn: ToolShape;

  constructor(
    private readonly facts: PartFacts,
    private readonly judge: (wish: StartWish) => void,
  ) {
    const choices = facts.choices as unknown as StartWish;
    this.list(choices.material);
    element<HTMLSelectElement>("law").replaceChildren(...facts.laws.map((law) => new Option(law, law)));
    element<HTMLSelectElement>("law").value = choices.law;
    for (const field of Object.keys(FIXED)) this.prepare(field, choices[field as "depth"]);
    element("material").addEventListener("input", () => {
      this.show();
      this.ask();
    });
    this.drawn = new ToolShape(null, this.radius);
    element<HTMLSelectElement>("tool").replaceChildren(...facts.tools.map(({ name }) => new Option(name, name)));
    element<HTMLSelectElement>("tool").value = choices.tool;
    element("tool").addEventListener("input", () => {
      this.resize();
      this.ask();
    });
    this.listRegions();
    this.show();
    this.resize();
    if (choices.tool !== BALL) this.ask(); // what it looks like
    this.draw();
  }

  /** All choices but the picks. */
  wish(trial: boolean): StartWish {
    const value = (id: string): string => element<HTMLInputElement | HTMLSelectElement>(id).value;
    const [young, poisson] = [value("young"), value("poisson")];
    const [radius, depth] = [value("ball-radius"), value("ball-depth")];
    const sizes = Object.fromEntries(this.tool.sizes.map(({ name }) => [name, value(sizeId(name))]));
    const regions = Object.fromEntries(this.facts.regions.map(({ name }, i) => [name, value(`region-${i}`).trim()]));
    const material = { material: value("material"), law: value("law"), young, poisson, regions };
    return { ...material, radius, depth, trial, tool: this.tool.name, sizes };
  }

  /** Say beside the fields what is wrong with their numbers; with `all`, of those too in which a person still writes. */
  say(problems: Record<string, string>, all: boolean): void {
    for (const [field, id] of this.boxes) {
      const problem = problems[field] ?? "";
      if (problem && !all && !this.left.has(field)) continue;
      if (all) this.left.add(field);
      const [line, box] = [element(`${id}-misfit`), input(id)];
      line.textContent = problem;
      line.hidden = !problem;
      box.setAttribute("aria-invalid", String(problem !== ""));
    }
    if (all) document.querySelector<HTMLElement>("#panel input[aria-invalid=true]")?.focus();
  }

  /** Take the tool that the server has made of the sizes. */
  take(tool: DrawnTool | null): void {
    if ((tool === null) !== (this.tool.name === BALL)) return; // of a choice that was changed meanwhile
    this.drawn = new ToolShape(tool, this.radius);
    this.reshaped();
  }

  /** What presses, as it is drawn. */
  get shape(): ToolShape {
    if (!this.drawn.tool) this.drawn.radius = this.radius;
    return this.drawn;
  }

  /** The radius of the ball, m; 0 where its text is none. */
  private get radius(): number {
    return lengthOf(input("ball-radius").value);
  }

  private get tool(): ToolInfo {
    const { value } = element<HTMLSelectElement>("tool");
    return this.facts.tools.find(({ name }) => name === value) ?? this.facts.tools[0]!;
  }

  private list(chosen: string): void {
    const groups = (Object.keys(KINDS) as (keyof typeof KINDS)[]).map((kind) => {
      const group = document.createElement("optgroup");
      group.label = KINDS[kind];
      const mine = this.facts.materials.filter((material) => material.kind === kind);
      group.append(...mine.map(({ name }) => new Option(name, name)));
      return group;
    });
    const select = element<HTMLSelectElement>("material");
    select.replaceChildren(new Option("own numbers", ""), ...groups.filter((group) => group.children.length));
    select.value = chosen;
  }

  /** A field for the material of each region of a part that has several. */
  private listRegions(): void {
    const { regions, materials } = this.facts;
    element("regions").hidden = !regions.length;
    element("region-materials").replaceChildren(...materials.map(({ name }) => new Option(name, name)));
    const fields = regions.flatMap(({ name }, i) => labelled(`region-${i}`, name));
    document.querySelector("#regions .form")!.replaceChildren(...fields);
    regions.forEach(({ material }, i) => {
      this.boxes.set(`region-${i}`, `region-${i}`);
      this.prepare(`region-${i}`, material);
      input(`region-${i}`).setAttribute("list", "region-materials");
    });
  }

  /** The fields of the tool that is chosen, which begin with sizes that suit the part. */
  private resize(): void {
    const { tool } = this;
    const ball = tool.name === BALL;
    for (const part of document.querySelectorAll<HTMLElement>("#ball-section .ball")) {
      part.hidden = !ball || (part.classList.contains("misfit") && !part.textContent);
    }
    element("tool-about").textContent = tool.about;
    element("tool-about").hidden = ball;
    for (const field of [...this.boxes.keys()]) if (field.startsWith("size-")) this.boxes.delete(field);
    element("tool-sizes").hidden = ball;
    element("tool-sizes").replaceChildren(
      ...tool.sizes.flatMap(({ name, words }) => labelled(sizeId(name), words)),
    );
    for (const { name, value } of tool.sizes) {
      this.boxes.set(`size-${name}`, sizeId(name));
      this.prepare(`size-${name}`, value);
    }
    this.drawn = new ToolShape(null, ball ? this.radius : 0);
    this.reshaped();
  }

  private prepare(field: string, text: string): void {
    const [box, line] = [input(this.boxes.get(field)!), document.createElement("p")];
    box.value = box.defaultValue = text;
    line.id = `${box.id}-misfit`;
    line.className = ["misfit", ...["own", "ball"].filter((name) => box.classList.contains(name))].join(" ");
    line.hidden = true;
    line.setAttribute("role", "status");
    box.setAttribute("aria-describedby", line.id);
    box.after(line);
    box.addEventListener("input", () => {
      this.draw();
      if (box.getAttribute("aria-invalid") !== "true") this.left.delete(field);
      if (box.getAttribute("aria-invalid") === "true" || field.startsWith("size-")) this.ask(PAUSE);
    });
    box.addEventListener("change", () => {
      this.left.add(field);
      this.ask();
    });
  }

  private ask(pause = 0): void {
    clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => this.judge(this.wish(true)), pause);
  }

  /** A material by name, or the fields of an own one, which begin with the numbers of the one that was seen last. */
  private show(): void {
    const name = element<HTMLSelectElement>("material").value;
    const known: MaterialInfo | undefined = this.facts.materials.find((material) => material.name === name);
    for (const part of document.querySelectorAll<HTMLElement>("#material-section .own")) {
      part.hidden = known !== undefined || (part.classList.contains("misfit") && !part.textContent);
    }
    element("material-about").textContent = known?.about ?? "";
    if (!known) return;
    for (const [id, text] of [
      ["young", known.young],
      ["poisson", known.poisson],
    ] as const) {
      // a number of a person's own stays
      if (input(id).value === input(id).defaultValue) input(id).value = input(id).defaultValue = text;
    }
  }

  private draw(): void {
    input("ball-radius").dataset["metres"] = String(this.radius); // for programs that drive the page
  }
}

/** The id of the box of a size. */
function sizeId(name: string): string {
  return `size-${name.replaceAll("_", "-")}`;
}
