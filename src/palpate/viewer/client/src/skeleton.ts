// The skeleton that all pages share, whose parts belong to modes:
//
// line    a touched body that is drawn as a line and held at a node
// press   one that is pressed by a probe
// pad     one that is held by a pad
// pinch   one that two jaws pinch
// shown   a solved body that is looked at
// refused a part whose surface bounds no body, and may be wrapped
// setup   a part that is set up
// work    a part that is solved and can't be touched yet
// answers a surrogate that answers inputs and is not touched
//
// What belongs to solving and learning is marked by data-learn, and seen beside any of them.

import { element } from "./units";
import type { View } from "./view";

export type Mode = "line" | "press" | "pad" | "pinch" | "shown" | "refused" | "setup" | "work" | "answers";

const LABELS: Record<Mode, string> = {
  line: "The body. Arrow keys pull the held end, Escape lets it go.",
  press: "The body. Hold the space bar to press, arrow keys move the probe, Page Up and Page Down change the depth.",
  pad: "The body. Arrow keys pull the pad, Escape lets it go.",
  pinch: "The body between two jaws. Arrow keys move them, Page Down and Page Up close and open them, Escape lets go.",
  shown: "The body. Arrow keys left and right change the state, the mouse turns it.",
  refused: "No body yet: its surface is refused.",
  setup: "The body, which can be touched later.",
  work: "The body, which can be touched later.",
  answers: "The body, coloured by the chosen field. The mouse turns it, a click reads a value.",
};

/** Show the parts that belong to a mode; at first none of them are seen. */
export function mode(name: Mode): void {
  for (const part of document.querySelectorAll<HTMLElement>("[data-for]")) {
    part.classList.toggle("here", part.dataset["for"]!.split(" ").includes(name));
  }
  element("view").setAttribute("aria-label", LABELS[name]);
}

/** Keep a view fitting its canvas and the theme; `recolour` hears of a new theme as well. */
export function watch(
  view: () => View | null,
  recolour: () => void = () => {},
  canvas: HTMLElement = element("view"),
): void {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    view()?.recolour();
    recolour();
  });
  new ResizeObserver(() => {
    view()?.resize();
    view()?.look();
  }).observe(canvas);
  canvas.addEventListener("dblclick", () => view()?.look());
  element("reset-view").addEventListener("click", () => view()?.look());
}
