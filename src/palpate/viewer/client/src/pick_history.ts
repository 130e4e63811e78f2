// What a person has picked, step by step: back and forth.

const STEPS = 100; // that can be taken back

export class PickHistory {
  private past: Uint8Array[] = [];
  private future: Uint8Array[] = [];

  /** Keep the roles as they are before a step changes them. */
  keep(roles: Uint8Array): void {
    this.past = [...this.past.slice(1 - STEPS), roles.slice()];
    this.future = [];
  }

  /** Forget the latest step where it has changed nothing. */
  settle(roles: Uint8Array): void {
    const before = this.past.at(-1);
    if (before?.every((role, t) => role === roles[t])) this.past.pop();
  }

  /** The roles one step back, or forth; null where there is none. */
  turn(back: boolean, roles: Uint8Array): Uint8Array | null {
    const [from, to] = back ? [this.past, this.future] : [this.future, this.past];
    const other = from.pop();
    if (!other) return null;
    to.push(roles.slice());
    return other;
  }

  get steps(): { back: number; forth: number } {
    return { back: this.past.length, forth: this.future.length };
  }
}
