// A field or a curve: a mean and modes whose coefficients follow from the inputs (palpate/surrogates/fields/modal_field.py).

import type { AnswerParts, ModesFacts, Numbers } from "./answer_facts";
import { Group } from "./answer_network";

export class Modes {
  readonly group: Group;
  readonly columns: number; // components
  readonly values: Float64Array; // row by row, of the last inputs
  private readonly mean: Numbers;
  private readonly modes: Numbers;
  private readonly scatter: Numbers;
  private readonly widening: number;
  private readonly solved: Numbers | null;
  private spread: number[] = [];

  constructor(parts: AnswerParts, facts: ModesFacts) {
    this.group = new Group(parts, facts.coefficients);
    [this.mean, this.modes, this.scatter] = [facts.mean, facts.modes, facts.scatter].map((a) => parts.numbers(a)) as [Numbers, Numbers, Numbers];
    this.columns = facts.mean.shape[1]!;
    this.widening = facts.widening ?? NaN;
    this.solved = facts.solved && parts.numbers(facts.solved);
    this.values = new Float64Array(this.mean.length);
  }

  /** Answer other inputs. */
  ask(x: readonly number[]): void {
    this.sum(this.group.predict(x), this.values);
    this.spread = this.group.deviation(x);
  }

  /** Whether the solves that it was learnt from are known. */
  get hasSolves(): boolean {
    return this.solved !== null;
  }

  /** Values of a solve that it was learnt from, row by row. */
  solve(index: number): Float64Array {
    const [values, k] = [new Float64Array(this.values.length), this.modes.length / this.values.length];
    this.sum(Array.from(this.solved!.subarray(index * k, (index + 1) * k)), values);
    return values;
  }

  private sum(coefficients: readonly number[], values: Float64Array): void {
    const [count, { modes }] = [values.length, this];
    values.set(this.mean);
    coefficients.forEach((a, k) => {
      for (let i = 0; i < count; i++) values[i]! += a * modes[k * count + i]!;
    });
  }

  /** Standard deviation of a component at a row, at the last inputs. */
  deviation(row: number, component: number): number {
    const [at, count] = [row * this.columns + component, this.values.length];
    const variance = this.spread.reduce((sum, s, k) => sum + (s * this.modes[k * count + at]!) ** 2, this.scatter[at]! ** 2);
    return this.widening * Math.sqrt(variance);
  }

  /** The value at a row; of component −1 the size of the vector. */
  at(row: number, component: number, values = this.values): number {
    const { columns } = this;
    if (component >= 0) return values[row * columns + component]!;
    let sum = 0;
    for (let k = 0; k < columns; k++) sum += values[row * columns + k]! ** 2;
    return Math.sqrt(sum);
  }
}
