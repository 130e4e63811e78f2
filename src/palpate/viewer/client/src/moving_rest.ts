// Where a body lies that stays bent or creeps back, and how a hand takes hold of it there: runtime/hand_evaluator.py in a page
// that is one file. A hand leads such a body from where it lies, not to the hand's own place, which would bend it back.

import type { Answer, Evaluator } from "./evaluator";
import type { Vec3 } from "./messages";

export class MovingRest {
  private lies: Vec3 = [0, 0, 0]; // m
  private grip: Vec3 | null = null; // from the hand's own place to that of what it holds; null: nobody holds

  constructor(
    private readonly evaluator: Evaluator,
    private readonly direction: Vec3, // the one that is felt, of length 1
  ) {}

  /** Where what is held lies now, m. */
  get place(): Vec3 {
    return this.lies;
  }

  /** A hand at this place takes hold where the body lies, and gives its grip. */
  take(hand: Vec3): Vec3 {
    const along = this.along(hand);
    return (this.grip = this.lies.map((v, i) => v - along[i]!) as Vec3);
  }

  /** Where a hand at this place leads what it holds, m. */
  lead(hand: Vec3): Vec3 {
    const grip = this.grip ?? this.take(hand);
    return hand.map((v, i) => v + grip[i]!) as Vec3;
  }

  /** Take note that the hand has led it to this place. */
  led(place: Vec3): void {
    this.lies = this.along(place);
  }

  /** The answer of the body that nobody has held for `count` steps of `dt` seconds. */
  free(parameters: ArrayLike<number>, dt: number, count: number): Answer {
    this.grip = null;
    let answer = this.evaluator.release(this.lies, parameters, dt);
    for (let k = 1; k < count; k++) answer = this.evaluator.release(answer.lies, parameters, dt);
    this.lies = answer.lies;
    return answer;
  }

  /** Forget all that was done to the body: it is straight, and a hand takes hold of it anew. */
  straighten(): void {
    this.evaluator.start();
    this.lies = [0, 0, 0];
    this.grip = null;
  }

  private along(place: Vec3): Vec3 {
    const share = this.direction.reduce((sum, v, i) => sum + v * place[i]!, 0);
    return this.direction.map((v) => share * v) as Vec3;
  }
}
