// The server's place in a page that is one file: takes the hand, asks the evaluator, and makes the pictures' numbers itself.
//
// Force and shape are of the same place, as they are from the server. There is no real-time loop: a hand that moves is followed
// in steps of 2 ms between two pictures, and what the body remembers with it.

import type { Listener } from "./connection";
import { CONTACT, TOO_DEEP, TRUSTED } from "./evaluator";
import type { Answer, Evaluator } from "./evaluator";
import type { IndentationDrawing } from "./indentation_drawing";
import type { LineShape } from "./line_shape";
import { Hold, Loop } from "./messages";
import type { MovingRest } from "./moving_rest";
import type { Frame, Hand, Hello, Vec3 } from "./messages";

const STEP = 0.002; // s
const LONGEST = 0.1; // s between two pictures; what is longer was no touch
const FREE = 0.04; // s, time constant of the withdrawal that is drawn, as the server has it
const STILL = 1e-3; // share of the deepest depth below which the body counts as at rest
const NOWHERE: Vec3 = [0, 0, 0];
const NOTHING = new Float32Array();
const WAY = 2e-6; // m, of the difference that is the effort of two jaws
const WEIGHTS = [[1, 8], [-1, -8], [2, -1], [-2, 1]] as const; // ways and weights of it, over 12

export class FileConnection {
  connected = false;

  private hand: Hand | null = null;
  private place: Vec3;
  private force: Vec3 = NOWHERE;
  private torque: Vec3 = NOWHERE; // of the last answer, on a tool
  private answer: Answer | null = null;
  private parameters: Float64Array;
  private tick = 0;
  private last = performance.now();
  private released = { at: -Infinity, depth: 0, place: NOWHERE, normal: NOWHERE };
  private stopped = false;
  private clamped = false;

  constructor(
    private readonly listener: Listener,
    private readonly hello: Hello,
    private readonly evaluator: Evaluator,
    private readonly kept: IndentationDrawing | null,
    private readonly line: LineShape | null = null,
    private readonly rest: MovingRest | null = null,
  ) {
    this.place = [...hello.centre];
    const jaws = hello.tool?.opening ?? -1; // they begin at their widest
    this.parameters = Float64Array.from(hello.parameters, ({ low, high }, i) => (i === jaws ? high : (low + high) / 2));
    queueMicrotask(() => {
      this.connected = true;
      listener.hello(hello);
    });
  }

  send(hand: Hand): void {
    // at once: until the next picture the hand may have gone on
    if (hand.grabbed && !this.hand?.grabbed) this.rest?.take(this.moved(hand.target));
    this.hand = hand;
  }

  record(): void {
    // a file records nothing
  }

  stop(stop: boolean): void {
    this.stopped = stop;
    this.listener.reason({ now: stop ? "Stopped." : "", stopped: stop, dropped: "", ago: 0 });
  }

  ready(): void {
    // a file holds one version of its body
  }

  /** The picture of this moment. */
  take(): Frame | null {
    const now = performance.now();
    const elapsed = Math.min((now - this.last) / 1000, LONGEST);
    this.last = now;
    const { hand } = this;
    const { parameters } = this.hello;
    // an end of a range is beyond it when rounded to single precision
    const kept = (v: number, i: number): number => Math.min(Math.max(v, parameters[i]?.low ?? v), parameters[i]?.high ?? v);
    if (hand?.parameters.length) this.parameters = Float64Array.from(hand.parameters, kept);
    const held = hand !== null && hand.grabbed && !hand.hidden && !this.stopped;
    if (held) this.follow(this.wanted(hand.target), elapsed);
    else if (this.rest) this.lieFree(this.rest, elapsed);
    else if (this.answer) this.letGo(now);
    return this.frame(now / 1000, held);
  }

  /** Where the hand wants the probe's centre, or what it holds, m. */
  private wanted(target: Vec3): Vec3 {
    const moved = this.moved(target);
    if (this.rest) return this.rest.lead(moved);
    return this.hello.holds ? moved : (moved.map((v, k) => v + this.hello.centre[k]!) as Vec3);
  }

  /** The hand's place in the axes of the body, from the device's centre, m. */
  private moved(target: Vec3): Vec3 {
    const [x, y, z] = target.map((v) => v * this.hello.scale) as Vec3;
    return this.line ? [x, y, z] : [x, -z, y]; // a device's y is up, as a line's; a solid's z
  }

  private follow(to: Vec3, elapsed: number): void {
    const from = this.rest?.place ?? (this.answer ? this.place : to); // the hand has just taken hold
    const count = this.steps(elapsed);
    for (let k = 1; k <= count; k++) {
      const between = to.map((v, i) => from[i]! + ((v - from[i]!) * k) / count) as Vec3;
      this.answer = this.evaluator.step(between, this.parameters, elapsed / count);
    }
    if (this.hello.twists) this.torque = this.evaluator.torque();
    this.place = to;
    this.rest?.led(to);
    const size = Math.hypot(...this.answer!.force);
    this.clamped = size > this.hello.max_force;
    const share = this.clamped ? this.hello.max_force / size : 1;
    const free = (this.answer!.flags & TOO_DEEP) !== 0; // the body has let go
    this.force = Number.isFinite(size) && !free ? (this.answer!.force.map((v) => v * share) as Vec3) : NOWHERE;
  }

  /** Into how many steps the time between two pictures is divided: a body that remembers nothing hears of the last place alone. */
  private steps(elapsed: number): number {
    return this.hello.remembers || this.rest ? Math.max(1, Math.ceil(elapsed / STEP)) : 1;
  }

  private lieFree(rest: MovingRest, elapsed: number): void {
    const count = this.steps(elapsed);
    this.answer = rest.free(this.parameters, elapsed / count, count);
    this.place = rest.place;
    this.force = NOWHERE;
  }

  private letGo(now: number): void {
    const touched = this.evaluator.touch(this.place, this.parameters);
    this.released = {
      at: now,
      depth: touched?.depth ?? 0,
      place: this.place,
      normal: touched?.normal ?? NOWHERE,
    };
    this.answer = null;
    this.force = NOWHERE;
  }

  /** Where the probe is drawn: at the hand's place, or on its way out. */
  private drawn(now: number): Vec3 | null {
    if (this.answer) return this.place;
    const { at, depth, place, normal } = this.released;
    const left = depth * Math.exp(-(now - at / 1000) / FREE);
    if (left < STILL * this.hello.deepest) return null;
    return place.map((v, k) => v + (depth - left) * normal[k]!) as Vec3;
  }

  /** A contact point of the body: the core's lies on the surface that takes a tool's places. */
  private shifted(contact: Vec3): Vec3 {
    const shift = this.hello.tool?.shift ?? NOWHERE;
    return contact.map((v, k) => v + shift[k]!) as Vec3;
  }

  /** The effort of two jaws, N; not-a-number of one tool, and of a body that remembers. */
  private effort(): number {
    const { hello, evaluator, place, parameters } = this;
    const opening = hello.tool?.opening ?? -1;
    if (opening < 0 || hello.remembers) return NaN;
    let slope = 0;
    for (const [way, weight] of WEIGHTS) {
      const moved = Float64Array.from(parameters);
      moved[opening]! += way * WAY;
      slope += weight * evaluator.answer(place, moved).energy;
    }
    return -slope / (12 * WAY);
  }

  /** Displacements (3 N) of a line's nodes, m. */
  private shape(time: number): Float32Array {
    const { line, answer } = this;
    if (!line) return NOTHING;
    return answer ? line.held(this.place, answer.force, this.parameters, time) : line.free(this.parameters, time);
  }

  /** The displacement of the node that a hand holds. */
  private nodeAt(displacement: Float32Array): Vec3 {
    const first = 3 * this.hello.line!.touch_node;
    return Array.from(displacement.subarray(first, first + 3)) as Vec3;
  }

  private frame(time: number, held: boolean): Frame {
    const { hello, answer, evaluator } = this;
    const at = hello.holds ? null : this.drawn(time);
    const touched = at && evaluator.touch(at, this.parameters);
    const coefficients = touched ? touched.numbers : new Float32Array(evaluator.shapeNumbers);
    this.kept?.update();
    if (this.kept && touched) {
      const share = this.kept.elastic(touched.depth, touched.contact, touched.normal);
      for (let i = 0; i < coefficients.length; i++) coefficients[i]! *= share;
    }
    const contact = answer !== null && (answer.flags & CONTACT) !== 0;
    const displacement = this.shape(time);
    this.tick += 1;
    return {
      version: hello.version,
      tick: this.tick,
      time,
      echo: this.hand?.sent ?? 0,
      position: this.place,
      force: this.force,
      torque: held ? this.torque : NOWHERE,
      effort: held && contact ? this.effort() : 0,
      rate: hello.rate, // there is no loop that could be late
      lateness: 0,
      lateness_p50: 0,
      lateness_p99: 0,
      lateness_max: 0,
      work_p50: 0,
      faults: 0,
      fault: 0,
      last_fault: 0,
      loop: Loop.RUNNING,
      hold: held ? Hold.YOURS : Hold.FREE,
      inside: !answer || (answer.flags & TRUSTED) !== 0,
      clamped: held && this.clamped,
      grabbed: held,
      resting: !held,
      stalled: false,
      parameters: Float32Array.from(this.parameters),
      contact: touched ? this.shifted(touched.contact) : this.line ? this.nodeAt(displacement) : hello.holds ? hello.centre : NOWHERE,
      normal: touched ? touched.normal : NOWHERE,
      depth: answer ? answer.depth : 0,
      stiffness: held && answer && contact ? along(answer) : 0,
      deviation: held && contact ? evaluator.deviation(this.place, this.parameters) : 0,
      drawn: touched ? touched.depth : 0,
      displacement,
      coefficients,
      indentation: this.kept?.depths ?? NOTHING,
    };
  }
}

/** Stiffness along the force, N/m, positive for a body that resists. */
function along({ force, stiffness }: Answer): number {
  const squared = force.reduce((sum, v) => sum + v * v, 0);
  if (!(squared > 0)) return 0;
  let total = 0;
  for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) total -= force[i]! * stiffness[3 * i + j]! * force[j]!;
  return total / squared;
}
