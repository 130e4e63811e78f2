// The form on which a part is set up: picks on its surface, material, tool, and the start.
//
// No role is chosen at first, so that a click changes nothing by mistake: it asks what the place shall be. With a role, a click gives
// it; nothing is taken back by a second click, for which there is *neither*, and undo.

import { Role } from "./messages";
import type { Answer, PartFacts, StartWish } from "./messages";
import { PartForm } from "./part_form";
import type { PartView, Pointed } from "./part_view";
import { PickHistory } from "./pick_history";
import { element, input, square, tidy, worded } from "./units";

const CLICK = 5; // px that a pointer may move and still click
const LISTED = 60; // faces in the list
const ROLES: Record<number, string> = { [Role.FREE]: "neither", [Role.HELD]: "held", [Role.TOUCHED]: "touched" };
const TOOLS = {
  face: "A click takes a whole face.",
  patch: "A click takes what is smooth around that place.",
  brush: "Drag over the surface. Drag beside the part, or with the right button, to turn the view.",
} as const;

type Tool = keyof typeof TOOLS;

export class Setup {
  private role: number | null = null; // that a click gives; null: it asks
  private tool: Tool = "face";
  private asked: number[] = []; // triangles that a click would take, while the page asks what they shall be
  private readonly history = new PickHistory();
  private readonly form: PartForm;
  private readonly first: Uint8Array;
  private pressed: { x: number; y: number; id: number; painting: boolean } | null = null;
  private spreads = { patch: 35, brush: 0 }; // degrees, m

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly view: PartView,
    private readonly facts: PartFacts,
    private readonly start: (wish: StartWish, held: number[] | null, touched: number[] | null) => void,
    judge: (wish: StartWish) => void,
    private readonly another: (unit: string) => void,
  ) {
    this.first = view.roles.slice();
    this.spreads.brush = 0.06 * view.extent;
    if (facts.faces.length < 2 && !facts.whole) this.tool = "patch"; // one smooth face is all of the part
    this.describe();
    this.form = new PartForm(facts, judge);
    this.form.reshaped = () => this.rest();
    this.rest();
    element("start").addEventListener("click", () => this.begin());
    this.buttons();
    this.pointers();
    this.keys();
    this.show();
  }

  /** Say what does not fit, of the whole and of single fields; nothing where all does. */
  answer({ problem, fields, trial, tool }: Answer): void {
    if (trial && fields && !Object.keys(fields).length) this.form.take(tool);
    if (fields) this.form.say(fields as Record<string, string>, !trial);
    if (trial) return;
    this.starting = false;
    element("problem").hidden = !problem;
    element("problem").textContent = problem;
    if (problem) element("problem").scrollIntoView({ block: "nearest" });
    this.ready();
  }

  /** Let the work be started, or not while there is no server. */
  set connected(on: boolean) {
    this.served = on;
    if (!on) this.starting = false;
    this.ready();
  }

  private starting = false;
  private served = true;

  private ready(): void {
    element<HTMLButtonElement>("start").disabled = this.starting || !this.served;
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

  private begin(): void {
    this.starting = true;
    this.ready();
    element("problem").hidden = true;
    const { roles } = this.view;
    const changed = roles.some((role, t) => role !== this.first[t]);
    const chosen = (role: number): number[] => [...roles.keys()].filter((t) => roles[t] === role);
    this.start(this.form.wish(false), changed ? chosen(Role.HELD) : null, changed ? chosen(Role.TOUCHED) : null);
  }

  private buttons(): void {
    for (const button of document.querySelectorAll<HTMLButtonElement>("#roles button")) {
      button.addEventListener("click", () => {
        const role = Number(button.dataset["role"]);
        this.arm(role === this.role ? null : role);
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
        if (take === "reset") this.become(this.first);
        else this.give(this.view.all(take));
      });
    }
    for (const button of document.querySelectorAll<HTMLButtonElement>("#ask button")) {
      button.addEventListener("click", () => {
        const [taken, role] = [this.asked, Number(button.dataset["role"])];
        this.arm(role);
        this.assign(taken, role);
      });
    }
    element("undo").addEventListener("click", () => this.turn(true));
    element("redo").addEventListener("click", () => this.turn(false));
    input("spread").addEventListener("input", () => {
      if (this.tool !== "face") this.spreads[this.tool] = input("spread").valueAsNumber;
      this.label();
    });
  }

  private keys(): void {
    document.addEventListener("keydown", (e) => {
      if (document.documentElement.dataset["stage"] !== "choosing") return;
      if (e.key === "Escape") this.arm(null);
      const writing = e.target instanceof HTMLInputElement && e.target.type === "text"; // there it undoes letters
      if (writing || !(e.ctrlKey || e.metaKey)) return;
      const key = e.key.toLowerCase();
      if (key !== "z" && key !== "y") return;
      e.preventDefault();
      this.turn(key === "z" && !e.shiftKey);
    });
  }

  /** Choose the role that a click gives; without one it asks. */
  private arm(role: number | null): void {
    this.role = role;
    this.ask([]);
    this.show();
  }

  /** Give triangles the chosen role, or ask for one: where none is chosen, or they have it all already. */
  private give(triangles: readonly number[]): void {
    const { role } = this;
    if (role === null || triangles.every((t) => this.view.roles[t] === role)) this.ask(triangles);
    else this.assign(triangles, role);
  }

  /** Ask what triangles shall be; of none, stop asking. */
  private ask(triangles: readonly number[]): void {
    this.asked = [...triangles];
    this.view.ask(this.asked);
    element("ask").hidden = triangles.length === 0;
    const roles = new Set(triangles.map((t) => this.view.roles[t]!));
    const now = roles.size === 1 ? ROLES[[...roles][0]!]! : ""; // of all of it
    const some = [Role.HELD, Role.TOUCHED].filter((role) => roles.has(role)).map((role) => ROLES[role]);
    const words = now === "neither" ? "neither held nor touched" : now || `in part ${some.join(" and in part ")}`;
    element("ask-words").textContent = `This place is ${words}. What shall it be?`;
    for (const button of document.querySelectorAll<HTMLElement>("#ask button")) {
      button.hidden = ROLES[Number(button.dataset["role"])] === now;
    }
  }

  private assign(triangles: readonly number[], role: number): void {
    this.ask([]);
    this.history.keep(this.view.roles);
    this.view.assign(triangles, role);
    this.history.settle(this.view.roles);
    this.show();
  }

  private turn(back: boolean): void {
    const roles = this.history.turn(back, this.view.roles);
    if (roles) this.become(roles, false);
  }

  private become(roles: Uint8Array, step = true): void {
    this.ask([]);
    if (step) this.history.keep(this.view.roles);
    this.view.roles.set(roles);
    this.view.assign([], Role.FREE);
    if (step) this.history.settle(this.view.roles);
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
    const first = this.role === null ? "Choose first what a click makes of the surface; without that it asks. " : "";
    element("pick-help").textContent = first + TOOLS[tool];
    const { back, forth } = this.history.steps;
    [element<HTMLButtonElement>("undo").disabled, element<HTMLButtonElement>("redo").disabled] = [!back, !forth];
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
      if (e.pointerType !== "touch") view.press(this.tool === "brush" ? null : at, this.form.shape);
    });
    canvas.addEventListener("pointerleave", () => this.rest());
    for (const kind of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(kind, (e) => this.up(e, kind === "pointerup"));
    }
  }

  /** Where nobody points, a tool is seen on the middle of what it touches; a ball is none that has to be seen. */
  private rest(): void {
    const { shape } = this.form;
    this.view.shape(shape);
    this.view.press(shape.tool ? this.view.middle() : null, shape);
  }

  private down(e: PointerEvent): void {
    if (e.button !== 0 || this.pressed) return;
    const at = this.view.pointed(e.offsetX, e.offsetY);
    const painting = this.tool === "brush" && at !== null && this.role !== null;
    this.view.brushing = painting; // before the view's own handlers hear of it
    this.pressed = { x: e.offsetX, y: e.offsetY, id: e.pointerId, painting };
    if (!painting) return;
    this.canvas.setPointerCapture(e.pointerId);
    this.ask([]);
    this.history.keep(this.view.roles);
    this.paint(at!);
  }

  private up(e: PointerEvent, clicked: boolean): void {
    const { pressed } = this;
    if (!pressed || e.pointerId !== pressed.id) return;
    this.pressed = null;
    this.view.brushing = false;
    if (pressed.painting) {
      this.history.settle(this.view.roles);
      this.show();
      return;
    }
    if (!clicked || Math.hypot(e.offsetX - pressed.x, e.offsetY - pressed.y) > CLICK) return;
    const at = this.view.pointed(e.offsetX, e.offsetY);
    if (at) this.give(this.taken(at));
    else this.ask([]);
  }

  /** The triangles that a click takes. */
  private taken(at: Pointed): number[] {
    if (this.tool === "brush") return this.view.near(at, this.spreads.brush);
    return this.tool === "face" ? this.view.face(at.triangle) : this.view.patch(at.triangle, this.spreads.patch);
  }

  private paint(at: Pointed): void {
    if (this.role !== null) this.view.assign(this.view.near(at, this.spreads.brush), this.role);
  }
}
