// The form beside a part that is set up: material and ball. Numbers are judged by the server when their field is left; a sentence
// about one of them is looked at again with each key, so that it goes as soon as the number is right.

import type { MaterialInfo, PartFacts, StartWish } from "./messages";
import { lengthOf } from "./lengths";
import { element, input } from "./units";

const PAUSE = 250; // ms without a key until a number that was wrong is judged again
const FIELDS = { young: "young", poisson: "poisson", radius: "ball-radius", depth: "ball-depth" } as const;
const KINDS = { tissue: "tissues", silicone: "silicones", other: "others" } as const;

type Field = keyof typeof FIELDS;

export class PartForm {
  private readonly left = new Set<Field>(); // fields that a person has left, with what stands in them now
  private waiting = 0;

  constructor(
    private readonly facts: PartFacts,
    private readonly judge: (wish: StartWish) => void,
  ) {
    const choices = facts.choices as unknown as StartWish;
    this.list(choices.material);
    element<HTMLSelectElement>("law").replaceChildren(...facts.laws.map((law) => new Option(law, law)));
    element<HTMLSelectElement>("law").value = choices.law;
    for (const field of names()) this.prepare(field, choices[field]);
    element("material").addEventListener("input", () => {
      this.show();
      this.ask();
    });
    this.show();
    this.draw();
  }

  /** All choices but the picks. */
  wish(trial: boolean): StartWish {
    const value = (id: string): string => element<HTMLInputElement | HTMLSelectElement>(id).value;
    const [young, poisson] = [value("young"), value("poisson")];
    const [radius, depth] = [value("ball-radius"), value("ball-depth")];
    return { material: value("material"), law: value("law"), young, poisson, radius, depth, trial };
  }

  /** Say beside the fields what is wrong with their numbers; with `all`, of those too in which a person still writes. */
  say(problems: Record<string, string>, all: boolean): void {
    for (const field of names()) {
      const problem = problems[field] ?? "";
      if (problem && !all && !this.left.has(field)) continue;
      if (all) this.left.add(field);
      const [line, box] = [element(`${FIELDS[field]}-misfit`), input(FIELDS[field])];
      line.textContent = problem;
      line.hidden = !problem;
      box.setAttribute("aria-invalid", String(problem !== ""));
    }
    if (all) document.querySelector<HTMLElement>("#panel input[aria-invalid=true]")?.focus();
  }

  /** The radius of the ball, m; 0 where its text is none. */
  get radius(): number {
    return lengthOf(input("ball-radius").value);
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

  private prepare(field: Field, text: string): void {
    const [box, line] = [input(FIELDS[field]), document.createElement("p")];
    box.value = box.defaultValue = text;
    line.id = `${box.id}-misfit`;
    line.className = box.classList.contains("own") ? "misfit own" : "misfit";
    line.hidden = true;
    line.setAttribute("role", "status");
    box.setAttribute("aria-describedby", line.id);
    box.after(line);
    box.addEventListener("input", () => {
      this.draw();
      if (box.getAttribute("aria-invalid") !== "true") this.left.delete(field);
      else this.ask(PAUSE);
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

function names(): Field[] {
  return Object.keys(FIELDS) as Field[];
}
