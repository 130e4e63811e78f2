// The evaluator core as WebAssembly: a learnt body's energy, force, stiffness, memory and shape, from its block of weights
// (docs/method/weights-block.md). One body in one module; places in metres, forces on the hand in newtons.

import type { Vec3 } from "./messages";

const PAGE = 65536; // bytes of WebAssembly memory
const FRAME = 8; // numbers of a shape before the further inputs: s, f, contact point, normal
const MOST = 16; // further inputs and more
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
  shape_size(): number;
  answer(): number;
  trust(): number;
  step(dt: number): number;
  start(): void;
  touch(): number;
}

/** What a body answers at a place. */
export interface Answer {
  flags: number;
  energy: number; // J
  depth: number; // m
  force: Vec3; // N
  stiffness: Float64Array; // (9), N/m, row by row
}

export class Evaluator {
  private constructor(private readonly core: Core) {}

  /** Rejects a block that is damaged or of another version. */
  static async of(module: BufferSource, block: Uint8Array): Promise<Evaluator> {
    const { instance } = await WebAssembly.instantiate(module);
    const core = instance.exports as unknown as Core;
    core._initialize();
    const room = core.room();
    reserve(core.memory, room + block.length);
    new Uint8Array(core.memory.buffer, room).set(block);
    const fault = core.open(block.length);
    if (fault !== 0) throw new Error(`The weights of this body can't be used: ${FAULTS[fault] ?? "their fault is unknown"}.`);
    reserve(core.memory, room + block.length + core.needs(block.length) + 64);
    core.start();
    return new Evaluator(core);
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

  /** Standard deviation of the force relative to its size; not-a-number where it is unknown. */
  deviation(place: Vec3, parameters: ArrayLike<number>): number {
    this.ask(place, parameters);
    this.core.trust();
    return this.numbers(this.core.answered(), 20)[19]!;
  }

  /** Forget all that was done to the body. */
  start(): void {
    this.core.start();
  }

  /** The shape of a touch, null without contact; `numbers` are coefficients of the modes, then the profile of the local mode. */
  touch(place: Vec3, parameters: ArrayLike<number>): { depth: number; contact: Vec3; normal: Vec3; numbers: Float32Array } | null {
    const size = this.core.shape_size();
    if (size === 0) return null;
    this.ask(place, parameters);
    const touched = (this.core.touch() & CONTACT) !== 0;
    const shape = this.numbers(this.core.shaped(), size);
    if (!touched) return null;
    return {
      depth: shape[0]!,
      contact: [shape[2]!, shape[3]!, shape[4]!],
      normal: [shape[5]!, shape[6]!, shape[7]!],
      numbers: Float32Array.from(shape.subarray(FRAME + MOST + 1)),
    };
  }

  /** How many numbers a shape has for modes and local mode. */
  get shapeNumbers(): number {
    return Math.max(0, this.core.shape_size() - FRAME - MOST - 1);
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
