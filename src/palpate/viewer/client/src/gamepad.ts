// A gamepad through the browser: two sticks, a trigger, a button that holds and one that stops, and rumble. Rumble is a cue for the
// size of the force and for its changes, and has no direction: it pushes on no hand.

import type { Vec3 } from "./messages";
import { element } from "./units";

const DEAD = 0.12; // of a stick's way: sticks rest anywhere within
const PRESSED = 0.02; // of a trigger's way
const SEARCH = 200; // ms between two looks for a gamepad where there was none: a look may take a millisecond
const EFFECT = 100; // ms; it lapses by itself when no other follows
const EVERY = 50; // ms between two effects
const CHANGE = 0.1; // s in which the whole force must come or go to fill the strong motor
const LEAST = 0.01; // of a motor: weaker effects are not asked for
// the standard mapping: https://www.w3.org/TR/gamepad/#remapping
const [HOLD, STOP, TRIGGER] = [0, 1, 7];

/** A gamepad as the hand reads it. */
export interface Pad {
  left: readonly [right: number, up: number]; // each −1 … 1
  right: readonly [right: number, up: number];
  trigger: number; // 0 … 1
  hold: boolean;
}

/** A stick without its dead zone: zero inside of it, and from there continuous up to 1. */
export function stick(x: number, y: number): readonly [right: number, up: number] {
  const size = Math.hypot(x, y);
  if (!(size > DEAD)) return [0, 0];
  const scale = Math.min((size - DEAD) / (1 - DEAD), 1) / size;
  return [x * scale, y === 0 ? 0 : -y * scale];
}

/** Magnitudes of the two motors for a force and its rate of change, of the largest force. */
export function motors(force: number, rate: number, full: number): { weak: number; strong: number } {
  const part = (x: number): number => Math.min(Math.max(x / full, 0), 1) || 0;
  return { weak: part(force), strong: part(Math.abs(rate) * CHANGE) };
}

export class Pads {
  private words = "";
  private stopping = false;
  private halted = false;
  private mute = ""; // why the gamepad in use doesn't rumble
  private last = { time: 0, force: 0 };
  private active: Gamepad | null = null;
  private looked = -Infinity;

  /** `full`: the largest force (N); `stop`: hears of the button that stops. */
  constructor(
    private readonly full: number,
    private readonly stop: () => void,
  ) {
    this.say("None found. Press a button on a connected gamepad.");
    if (!("getGamepads" in navigator)) this.say("This browser offers no gamepads.");
  }

  /** The gamepad as it is now; null where there is none that can be read. */
  read(): Pad | null {
    const now = performance.now();
    if (!this.active && now - this.looked < SEARCH) return null;
    this.looked = now;
    const all = this.all();
    const pad = all.find((one) => one.mapping === "standard" && one.connected);
    if (pad?.id !== this.active?.id) this.mute = "";
    this.active = pad ?? null;
    if (!pad) {
      if (all.length > 0) this.say(`${name(all[0]!)}: its buttons are in no standard order, so it is not used.`);
      else if (this.words && "getGamepads" in navigator) this.say("None found. Press a button on a connected gamepad.");
      return null;
    }
    this.say(`${name(pad)}: ${this.rumbles(pad)}.`);
    const [a, b, c, d] = [0, 1, 2, 3].map((i) => pad.axes[i] ?? 0) as [number, number, number, number];
    const stopping = pad.buttons[STOP]?.pressed ?? false;
    if (stopping && !this.stopping) this.stop();
    this.stopping = stopping;
    let trigger = pad.buttons[TRIGGER]?.value ?? 0;
    if (!(trigger > PRESSED)) trigger = 0;
    let hold = pad.buttons[HOLD]?.pressed ?? false;
    // after a stop it holds again only when it had let go
    this.halted = stopping || (this.halted && (hold || trigger > 0));
    if (this.halted) [trigger, hold] = [0, false];
    return {
      left: stick(a, b),
      right: stick(c, d),
      trigger,
      hold,
    };
  }

  /** Let the gamepad in use rumble by a force (N, on the hand that it holds), at most every 50 ms. */
  rumble(force: Vec3, now: number): void {
    const elapsed = now - this.last.time;
    if (elapsed < EVERY) return;
    const size = Math.hypot(...force);
    const rate = elapsed < 5 * EVERY ? (1000 * (size - this.last.force)) / elapsed : 0;
    this.last = { time: now, force: size };
    const { weak, strong } = motors(size, rate, this.full);
    const actuator = this.active?.vibrationActuator;
    if (!actuator || this.mute || Math.max(weak, strong) < LEAST) return;
    actuator
      .playEffect("dual-rumble", { duration: EFFECT, startDelay: 0, weakMagnitude: weak, strongMagnitude: strong })
      .catch((error: unknown) => (this.mute = `rumble refused (${String(error)})`));
  }

  private all(): Gamepad[] {
    if (!("getGamepads" in navigator)) return [];
    try {
      return navigator.getGamepads().filter((pad) => pad !== null);
    } catch {
      this.say("This browser forbids gamepads here.");
      return [];
    }
  }

  private rumbles(pad: Gamepad): string {
    const actuator = pad.vibrationActuator as (GamepadHapticActuator & { effects?: string[] }) | null | undefined;
    if (typeof actuator?.playEffect !== "function") this.mute = "no rumble in this browser";
    else if (actuator.effects && !actuator.effects.includes("dual-rumble")) this.mute = "no rumble";
    return this.mute || "rumble grows with the force and its changes";
  }

  private say(words: string): void {
    if (words === this.words) return;
    this.words = words;
    element("gamepad").textContent = words;
  }
}

function name(pad: Gamepad): string {
  return pad.id.replace(/\s*\(.*$/, "") || "A gamepad";
}
