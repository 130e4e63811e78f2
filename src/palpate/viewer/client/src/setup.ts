// The form on which a part is set up: picks on its surface, material, ball, and the start.

import { Role } from "./messages";
import type { PartFacts, StartWish } from "./messages";
import type { PartView, Pointed } from "./part_view";
import { lengthOf } from "./lengths";
import { element, input, tidy, worded } from "./units";

const CLICK = 5; // px that a pointer may move and still click
const LISTED = 60; // faces in the list
const TOOLS = {
  face: "Click on a face to pick it; click again to take it back.",
  patch: "Click on the surface: what is smooth around that place is picked; click again to take it back.",
  brush: "Drag over the surface. Drag beside the part, or with the right button, to turn the view.",
} as const;

type Tool = keyof typeof TOOLS;

export class Setup {
  private role: number = Role.HELD;
  private tool: Tool = "face";
  private readonly first: Uint8Array;
  private pressed: { x: number; y: number; id: number; painting: boolean } | null = null;
  private spreads = { patch: 35, brush: 0 }; // degrees, m

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly view: PartView,
    private readonly facts: PartFacts,
    private readonly start: (wish: StartWish, held: number[] | null, touched: number[] | null) => void,
    private readonly another: (unit: string) => void,
  ) {
    this.first = view.roles.slice();
    this.spreads.brush = 0.06 * view.extent;
    if (facts.faces.length < 2 && !facts.whole) this.tool = "patch"; // one smooth face is all of the part
    this.describe();
    this.form();
    this.buttons();
    this.pointers();
    this.show();
  }

  /** Say what does not fit; nothing where all does. */
  answer(problem: string): void {
    element("problem").hidden = !problem;
    element("problem").textContent = problem;
    element<HTMLButtonElement>("start").disabled = false;
    if (problem) element("problem").scrollIntoView({ block: "nearest" });
  }

  private describe(): void {
    const { facts } = this;
    const size = facts.size.map((side) => tidy(1000 * side)).join(" × ");
    const rows: [string, string][] = [
      ["file", facts.file],
      ["size", `${size} mm`],
      ["unit", facts.unit || "stated by the file"],
      ["faces", String(facts.faces.length)],
      ["triangles", String(this.view.roles.length)],
    ];
    element("part-facts").replaceChildren(...rows.flatMap(([name, words]) => [worded("dt", name), worded("dd", words)]));
    if (facts.units.length > 1) element("part-facts").querySelectorAll("dd")[2]!.replaceChildren(this.units());
    element("part-notes").replaceChildren(...facts.notes.map((note) => worded("li", note)));
    element("face-list").replaceChildren(...this.faces());
  }

  /** The unit in which the file's numbers are taken, to choose from. */
  private units(): HTMLElement {
    const select = document.createElement("select");
    select.id = "unit";
    select.setAttribute("aria-label", "Unit of the file's numbers");
    select.append(...this.facts.units.map((unit) => new Option(`numbers are ${unit}`, unit)));
    select.value = this.facts.unit;
    select.addEventListener("input", () => this.another(select.value));
    return select;
  }

  /** A row for each of the largest faces, by which it is given a role. */
  private faces(): HTMLElement[] {
    const order = this.facts.faces.map((_, i) => i).sort((a, b) => this.facts.faces[b]!.area - this.facts.faces[a]!.area);
    const rows = order.slice(0, LISTED).map((face) => {
      const [row, select] = [document.createElement("li"), document.createElement("select")];
      const { name, area } = this.facts.faces[face]!;
      for (const [role, words] of [
        ["-1", "in part"],
        ["0", "neither"],
        ["1", "held"],
        ["2", "touched"],
      ] as const) {
        const option = worded("option", words) as HTMLOptionElement;
        option.value = role;
        option.disabled = option.hidden = role === "-1";
        select.append(option);
      }
      select.dataset["face"] = String(face);
      select.setAttribute("aria-label", `What ${name} is there for`);
      select.addEventListener("input", () => this.assign(this.view.ofFace(face), Number(select.value)));
      row.append(worded("span", name), worded("span", square(area)), select);
      return row;
    });
    const left = order.length - rows.length;
    return left > 0 ? [...rows, worded("li", `and ${left} smaller ones`)] : rows;
  }

  private form(): void {
    const { facts } = this;
    const { choices } = facts as unknown as { choices: StartWish };
    const material = element<HTMLSelectElement>("material");
    const own = new Option("own: law and numbers", "");
    material.replaceChildren(own, ...facts.materials.map(({ name }) => new Option(name, name)));
    element<HTMLSelectElement>("law").replaceChildren(...facts.laws.map((law) => new Option(law, law)));
    material.value = choices.material;
    element<HTMLSelectElement>("law").value = choices.law;
    input("young").value = choices.young;
    input("poisson").value = choices.poisson;
    input("ball-radius").value = choices.radius;
    input("ball-depth").value = choices.depth;
    const told = (): void => {
      const known = facts.materials.find(({ name }) => name === material.value);
      for (const part of document.querySelectorAll<HTMLElement>(".own")) part.hidden = known !== undefined;
      element("material-about").textContent = known?.about ?? "";
    };
    material.addEventListener("input", told);
    told();
    const drawn = (): void => void (input("ball-radius").dataset["metres"] = String(lengthOf(input("ball-radius").value)));
    input("ball-radius").addEventListener("input", drawn);
    drawn();
    element("start").addEventListener("click", () => this.begin());
  }

  private begin(): void {
    const value = (id: string): string => element<HTMLInputElement | HTMLSelectElement>(id).value;
    element<HTMLButtonElement>("start").disabled = true;
    element("problem").hidden = true;
    const { roles } = this.view;
    const changed = roles.some((role, t) => role !== this.first[t]);
    const chosen = (role: number): number[] => [...roles.keys()].filter((t) => roles[t] === role);
    this.start(
      {
        material: value("material"),
        law: value("law"),
        young: value("young"),
        poisson: value("poisson"),
        radius: value("ball-radius"),
        depth: value("ball-depth"),
      },
      changed ? chosen(Role.HELD) : null,
      changed ? chosen(Role.TOUCHED) : null,
    );
  }

  private buttons(): void {
    for (const button of document.querySelectorAll<HTMLButtonElement>("#roles button")) {
      button.addEventListener("click", () => {
        this.role = Number(button.dataset["role"]);
        this.show();
      });
    }
    for (const button of document.querySelectorAll<HTMLButtonElement>("#picks button")) {
      button.hidden = this.facts.whole && button.dataset["tool"] !== "face";
      button.addEventListener("click", () => {
        this.tool = button.dataset["tool"] as Tool;
        this.show();
      });
    }
    for (const button of document.querySelectorAll<HTMLButtonElement>("#shortcuts button")) {
      const take = button.dataset["take"] as "up" | "low" | "rest" | "reset";
      button.hidden = this.facts.whole && (take === "up" || take === "low");
      button.addEventListener("click", () => {
        if (take === "reset") this.view.roles.set(this.first);
        this.assign(take === "reset" ? [] : this.view.all(take), this.role);
      });
    }
    input("spread").addEventListener("input", () => {
      if (this.tool !== "face") this.spreads[this.tool] = input("spread").valueAsNumber;
      this.label();
    });
  }

  private assign(triangles: readonly number[], role: number): void {
    this.view.assign(triangles, role);
    this.show();
  }

  private show(): void {
    const { tool, view } = this;
    for (const button of document.querySelectorAll<HTMLElement>("#roles button")) {
      button.setAttribute("aria-pressed", String(Number(button.dataset["role"]) === this.role));
    }
    for (const button of document.querySelectorAll<HTMLElement>("#picks button")) {
      button.setAttribute("aria-pressed", String(button.dataset["tool"] === tool));
    }
    element("spread-row").hidden = tool === "face";
    element("pick-help").textContent = TOOLS[tool];
    const spread = input("spread");
    [spread.min, spread.max] = tool === "patch" ? ["1", "90"] : [String(0.01 * view.extent), String(0.2 * view.extent)];
    if (tool !== "face") spread.valueAsNumber = this.spreads[tool];
    this.label();
    element("held-area").textContent = square(view.area(Role.HELD));
    element("touched-area").textContent = square(view.area(Role.TOUCHED));
    for (const select of document.querySelectorAll<HTMLSelectElement>("#face-list select")) {
      select.value = String(view.roleOf(Number(select.dataset["face"])));
    }
    // for programs that drive the page
    const count = (role: number): number => view.roles.reduce((sum, r) => sum + Number(r === role), 0);
    document.documentElement.dataset["picked"] = `${count(Role.HELD)} ${count(Role.TOUCHED)}`;
  }

  private label(): void {
    const { patch, brush } = this.spreads;
    element("spread-name").textContent = this.tool === "patch" ? "normals differ by up to" : "radius of the brush";
    element("spread-label").textContent = this.tool === "patch" ? `${tidy(patch, 2)}°` : `${tidy(1000 * brush, 2)} mm`;
  }

  private pointers(): void {
    const { canvas, view } = this;
    canvas.addEventListener("pointerdown", (e) => this.down(e), { capture: true });
    canvas.addEventListener("pointermove", (e) => {
      const at = this.pressed && !this.pressed.painting ? null : view.pointed(e.offsetX, e.offsetY);
      if (this.pressed?.painting && e.pointerId === this.pressed.id && at) this.paint(at);
      canvas.dataset["cursor"] = at ? "pick" : "";
      if (e.pointerType !== "touch") view.ball(this.tool === "brush" ? null : at, lengthOf(input("ball-radius").value));
    });
    canvas.addEventListener("pointerleave", () => view.ball(null, 0));
    for (const kind of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(kind, (e) => this.up(e, kind === "pointerup"));
    }
  }

  private down(e: PointerEvent): void {
    if (e.button !== 0 || this.pressed) return;
    const at = this.view.pointed(e.offsetX, e.offsetY);
    const painting = this.tool === "brush" && at !== null;
    this.view.brushing = painting; // before the view's own handlers hear of it
    this.pressed = { x: e.offsetX, y: e.offsetY, id: e.pointerId, painting };
    if (!painting) return;
    this.canvas.setPointerCapture(e.pointerId);
    this.paint(at!);
  }

  private up(e: PointerEvent, clicked: boolean): void {
    const { pressed } = this;
    if (!pressed || e.pointerId !== pressed.id) return;
    this.pressed = null;
    this.view.brushing = false;
    if (pressed.painting) {
      this.show();
      return;
    }
    if (!clicked || Math.hypot(e.offsetX - pressed.x, e.offsetY - pressed.y) > CLICK) return;
    const at = this.view.pointed(e.offsetX, e.offsetY);
    if (at) this.pick(at);
  }

  /** Take a face or a patch, or give it back where it is taken already. */
  private pick(at: Pointed): void {
    const { view } = this;
    const taken = this.tool === "face" ? view.face(at.triangle) : view.patch(at.triangle, this.spreads.patch);
    const back = taken.every((t) => view.roles[t] === this.role);
    this.assign(taken, back ? Role.FREE : this.role);
  }

  private paint(at: Pointed): void {
    this.view.assign(this.view.near(at, this.spreads.brush), this.role);
  }
}

/** An area as a person reads it. */
function square(area: number): string {
  return area >= 1e-4 ? `${tidy(1e4 * area)} cm²` : `${tidy(1e6 * area)} mm²`;
}
