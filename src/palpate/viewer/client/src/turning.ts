// The turn of a tool whose orientation is an input: by keys, by a second finger, by a gamepad's right stick, within what was trained.

import type { Hello } from "./messages";
import { element } from "./units";

const STEP = 0.1; // of the trained angle, a key press
const SMALL_STEP = 0.02;
const FINGER = 1 / 120; // of the trained angle for a px of the second finger
const STICK = 1 / 900; // of it for a ms of a stick that is pushed all the way
// axis of the body (x, y, z) and direction of each key
const KEYS: Record<string, readonly [axis: number, way: number]> = {
  q: [1, -1],
  e: [1, 1],
  r: [0, 1],
  f: [0, -1],
  t: [2, 1],
  g: [2, -1],
};

export class Turning {
  private readonly turns: readonly number[]; // parameters that are the components about x, y and z; -1 for none

  constructor(private readonly hello: Hello) {
    this.turns = hello.tool?.turns ?? [-1, -1, -1];
    document.documentElement.dataset["turns"] = String(this.turns.filter((i) => i >= 0).length);
    element("turn-help").hidden = element("turn-keys").hidden = !this.possible;
    for (const about of document.querySelectorAll<HTMLElement>(".turn-z")) about.hidden = this.turns[2]! < 0;
  }

  /** True where the tool can be turned at all. */
  get possible(): boolean {
    return this.turns.some((i) => i >= 0);
  }

  /** The parameters after a key; null where it turns nothing. */
  byKey(key: string, small: boolean, parameters: Float32Array): Float32Array | null {
    const [axis, way] = KEYS[key.toLowerCase()] ?? [0, 0];
    if (!way || this.turns[axis]! < 0) return null;
    const by = [0, 0, 0];
    by[axis] = way * (small ? SMALL_STEP : STEP);
    return this.by(by, parameters);
  }

  /** The parameters after a second finger has moved by so many px. */
  byFinger(right: number, down: number, parameters: Float32Array): Float32Array {
    return this.by([FINGER * down, FINGER * right, 0], parameters);
  }

  /** The parameters after a stick was pushed for so many ms. */
  byStick([right, up]: readonly [number, number], elapsed: number, parameters: Float32Array): Float32Array {
    return this.by([-STICK * elapsed * up, STICK * elapsed * right, 0], parameters);
  }

  /** The parameters after turns about x, y and z, in shares of the largest trained angle. */
  private by(shares: readonly number[], parameters: Float32Array): Float32Array {
    const after = Float32Array.from(parameters);
    shares.forEach((share, axis) => {
      const i = this.turns[axis]!;
      if (i < 0) return;
      const { low, high } = this.hello.parameters[i]!;
      after[i] = Math.min(Math.max(after[i]! + share * Math.max(Math.abs(low), Math.abs(high)), low), high);
    });
    return this.within(after);
  }

  /** A tilt is trained up to an angle in all directions: the corners of its ranges are not. */
  private within(after: Float32Array): Float32Array {
    const [x, y] = [this.turns[0]!, this.turns[1]!];
    if (x < 0 || y < 0) return after;
    const [most, tilt] = [this.hello.parameters[x]!.high, Math.hypot(after[x]!, after[y]!)];
    if (tilt <= most) return after;
    for (const i of [x, y]) after[i]! *= most / tilt;
    return after;
  }
}
