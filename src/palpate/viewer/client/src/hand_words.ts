// Words for whoever moves the hand. A person is told of the mouse, the finger or the gamepad that is in use; where a device, a
// recorded touch or a program moves the hand, nobody is told to take hold.

import type { Hello } from "./messages";
import { capital, element } from "./units";

type Kind = "mouse" | "touch" | "gamepad" | "device" | "recording" | "program";

const MOVERS: Record<string, string> = { device: "device", recording: "recorded hand", program: "program" };
const FREE = {
  press: {
    mouse: "Nobody presses. Hold the mouse button or the space bar on the body.",
    touch: "Nobody presses. Hold a finger on the body.",
    gamepad: "Nobody presses. Pull the right trigger.",
  },
  pinch: {
    mouse: "Nobody pinches. Drag the jaws, or the bright ball between them, with the mouse.",
    touch: "Nobody pinches. Drag the jaws, or the bright ball between them, with a finger.",
    gamepad: "Nobody pinches. Pull the right trigger; the sticks move the jaws.",
  },
  hold: {
    mouse: "Nobody holds the body. Drag the bright ball or pad with the mouse.",
    touch: "Nobody holds the body. Drag the bright ball or pad with a finger.",
    gamepad: "Nobody holds the body. Hold the right trigger and pull with the left stick.",
  },
};
const HELP = {
  mouse: "Hold the mouse button on the body; the wheel presses deeper.",
  touch: "Hold a finger on the body; the slider says how deep it goes.",
  gamepad: "The right trigger presses, the left stick moves the probe.",
};

/** True where two jaws pinch the body. */
export function pinches(hello: Hello): boolean {
  return (hello.tool?.opening ?? -1) >= 0;
}

const root = document.documentElement;
let own: keyof typeof HELP = matchMedia("(hover: none) and (pointer: coarse)").matches ? "touch" : "mouse";
let mover: Hello | null = null;
show();

/** The page's own hand is moved by this from now on: words for it are shown (`data-by`), and for the view (`data-pointer`). */
export function use(kind: string): void {
  if (kind !== "gamepad") root.dataset["pointer"] = kind === "mouse" ? "mouse" : "touch";
  own = kind === "mouse" || kind === "gamepad" ? kind : "touch";
  show();
}

/** Who moves the hand of this body. */
export function moves(hello: Hello): void {
  mover = hello;
  show();
  if (hello.device) element("view").setAttribute("aria-label", `The body. ${capital(hello.device)} moves the hand.`);
}

/** Nobody touches the body. */
export function free(): string {
  const does = mover?.holds ? "hold" : mover && pinches(mover) ? "pinch" : "press";
  const other = MOVERS[kind()];
  return other ? `The ${other} does not ${does === "hold" ? "hold" : "touch"} the body.` : FREE[does][own];
}

/** The page went to the background. */
export function away(): string {
  const other = MOVERS[kind()];
  if (!other) return "This tab is in the background: the hand has let go.";
  return `This tab is in the background: its picture stands still. The ${other} goes on.`;
}

function kind(): Kind {
  return mover && mover.hand !== "page" ? (mover.hand as Kind) : own;
}

function show(): void {
  root.dataset["by"] = kind();
  root.dataset["pointer"] ??= own;
  element("press-help").textContent = HELP[own];
}
