// The evaluator core as WebAssembly: a learnt body's energy, force, stiffness, memory and shape, from its block of weights
// (docs/method/weights-block.md). One body in one module; places in metres, forces on the hand in newtons.

import type { Vec3 } from "./messages";

const PAGE = 65536; // bytes of WebAssembly memory
const FRAME = 8; // numbers of a shape before the further inputs: s, f, contact point, normal
const MOST = 16; // further inputs and more
const LEDGER = 4; // numbers of energy at the head of a memory's state
const FAULTS = [
  "",
  "they are none, or were written by a later version",
  "they were damaged on their way",
  "their arrays do not fit each other",
  "they are of a kind of body that this page doesn't hold",
];
export const CONTACT = 1;
export const TRUSTED = 2;
export const TOO_DEEP = 8;

interface Core {
  memory: WebAssembly.Memory;
  _initialize(): void;
  room(): number;
  open(size: number): number;
  needs(size: number): number;
  asked(): number;
  answered(): number;
  shaped(): number;
  open_field(at: number, size: number): number;
  open_network(at: number, size: number): number;
  predict(): void;
  shape_size(field: number): number;
  answer(): number;
  trust(): number;
  state(): number;
  step(dt: number): number;
  release(dt: number): number;
  start(): void;
  touch(field: number): number;
  torque(): number;
}

/** What a body answers at a place. */
export interface Answer {
  flags: number;
  energy: number; // J
  depth: number; // m
  force: Vec3; // N
  stiffness: Float64Array; // (9), N/m, row by row
}

/** The shape of a touch. */
export interface Touch {
  depth: number; // m
  contact: Vec3;
  normal: Vec3;
  numbers: Float32Array;
}

export class Evaluator {
  private constructor(
    private readonly core: Core,
    readonly fields: number,
    private readonly places: number,
  ) {}

  /**
   * A body from its block of weights and those of its further fields; rejects one that is damaged or of another version.
   * `places`: at how many it keeps indentations. `network`: the block of a network beside the body.
   */
  static async of(module: BufferSource, blocks: Uint8Array[], places = 0, network: Uint8Array | null = null): Promise<Evaluator> {
    const { instance } = await WebAssembly.instantiate(module);
    const core = instance.exports as unknown as Core;
    core._initialize();
    const room = core.room();
    let at = room;
    [...blocks, ...(network ? [network] : [])].forEach((block, i) => {
      reserve(core.memory, at + block.length);
      new Uint8Array(core.memory.buffer, at).set(block);
      const further = block === network ? core.open_network : core.open_field;
      const fault = i === 0 ? core.open(block.length) : further(at, block.length);
      if (fault !== 0) throw new Error(`The weights of this body can't be used: ${FAULTS[fault] ?? "their fault is unknown"}.`);
      at += block.length;
    });
    reserve(core.memory, at + core.needs(at - room) + 64);
    core.start();
    return new Evaluator(core, core.shape_size(0) === 0 ? 0 : blocks.length, places);
  }

  answer(place: Vec3, parameters: ArrayLike<number>): Answer {
    this.ask(place, parameters);
    return this.read(this.core.answer());
  }

  /** The answer after `dt` seconds; the force is that of the body with what it remembers. */
  step(place: Vec3, parameters: ArrayLike<number>, dt: number): Answer {
    this.ask(place, parameters);
    return this.read(this.core.step(dt));
  }

  /** Let go for `dt` seconds of a body that lies elsewhere after a touch; the answer is that of the place where it then lies. */
  release(place: Vec3, parameters: ArrayLike<number>, dt: number): Answer & { lies: Vec3 } {
    this.ask(place, parameters);
    const flags = this.core.release(dt);
    const [x, y, z] = this.numbers(this.core.asked(), 3);
    return { ...this.read(flags), lies: [x!, y!, z!] };
  }

  /** Standard deviation of the force relative to its size; not-a-number where it is unknown. */
  deviation(place: Vec3, parameters: ArrayLike<number>): number {
    this.ask(place, parameters);
    this.core.trust();
    return this.numbers(this.core.answered(), 20)[19]!;
  }

  /** Torque on a tool where the last answer was asked for, N m. */
  torque(): Vec3 {
    return [...this.numbers(this.core.torque(), 3)] as Vec3;
  }

  /** Amplitudes (√J) of the indentations at the places that keep them; overwritten by each step. */
  get amplitudes(): Float64Array {
    return this.numbers(this.core.state() + 8 * LEDGER, this.places);
  }

  /** Forget all that was done to the body. */
  start(): void {
    this.core.start();
  }

  /** The shape of a touch, null without contact; `numbers` are for each field coefficients of its modes, then the local mode's profile. */
  touch(place: Vec3, parameters: ArrayLike<number>): Touch | null {
    if (this.fields === 0) return null;
    this.ask(place, parameters);
    const numbers = new Float32Array(this.shapeNumbers);
    let [at, first]: [number, Float64Array | null] = [0, null];
    for (let field = 0; field < this.fields; field++) {
      const touched = (this.core.touch(field) & CONTACT) !== 0;
      const shape = this.numbers(this.core.shaped(), this.core.shape_size(field));
      if (!touched) return null;
      first ??= shape.slice(0, FRAME);
      numbers.set(shape.subarray(FRAME + MOST + 1), at);
      at += shape.length - FRAME - MOST - 1;
    }
    const [depth, , x, y, z, u, v, w] = first as unknown as number[];
    return { depth: depth!, contact: [x!, y!, z!], normal: [u!, v!, w!], numbers };
  }

  /** Outputs of the network beside the body; overwritten by each call. */
  predict(inputs: ArrayLike<number>, outputs: number): Float64Array {
    this.numbers(this.core.asked(), inputs.length).set(Array.from(inputs));
    this.core.predict();
    return this.numbers(this.core.shaped(), outputs);
  }

  /** How many numbers a shape has for modes and local modes of all fields. */
  get shapeNumbers(): number {
    let total = 0;
    for (let field = 0; field < this.fields; field++) total += this.core.shape_size(field) - FRAME - MOST - 1;
    return total;
  }

  private ask(place: Vec3, parameters: ArrayLike<number>): void {
    const asked = this.numbers(this.core.asked(), 3 + parameters.length);
    asked.set(place);
    asked.set(Array.from(parameters), 3);
  }

  private read(flags: number): Answer {
    const a = this.numbers(this.core.answered(), 19);
    return { flags, energy: a[0]!, depth: a[1]!, force: [a[2]!, a[3]!, a[4]!], stiffness: a.slice(5, 14) };
  }

  // made anew each time: a memory that has grown has another buffer
  private numbers(at: number, count: number): Float64Array {
    return new Float64Array(this.core.memory.buffer, at, count);
  }
}

function reserve(memory: WebAssembly.Memory, bytes: number): void {
  const missing = Math.ceil((bytes - memory.buffer.byteLength) / PAGE);
  if (missing > 0) memory.grow(missing);
}
