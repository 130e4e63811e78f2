// Numbers that follow from inputs, as palpate computes them: networks of radial units, their deviations and the trained region
// (palpate/network/network.py, uncertainty.py, influence.py; surrogates/learnt_quantities.py).

import type { AnswerParts, DeviationFacts, GroupFacts, NetworkFacts, Numbers } from "./answer_facts";

const ASTRAY = 3; // calibrated deviations that members may be apart where they are trusted
const EDGE = 1e-9; // of a half range, that rounding may put an input outside of it

/** Value and first derivative of a radial function of a squared distance. */
function radial(name: NetworkFacts["radial"], q: number): [g: number, slope: number] {
  if (name === "gaussian") {
    const g = Math.exp(-q);
    return [g, -g];
  }
  if (name === "inverse-multiquadric") {
    const u = 1 / (1 + q);
    const g = Math.sqrt(u);
    return [g, -0.5 * g * u];
  }
  const s = Math.sqrt(5 * q);
  const e = Math.exp(-s);
  return [(1 + s + (s * s) / 3) * e, (-5 / 6) * (1 + s) * e];
}

/** A network: n inputs, h units of r factor rows, k latent outputs, m outputs. */
class Network {
  readonly units: number;
  readonly count: number; // of outputs
  readonly inputs: Numbers;
  readonly outputs: Numbers;
  readonly radial: NetworkFacts["radial"];
  private readonly rows: number;
  private readonly factors: Numbers;
  private readonly shifts: Numbers;
  private readonly tail: Numbers;
  private readonly weights: Numbers;
  private readonly basis: Numbers | null;
  private readonly latent: number;

  constructor(parts: AnswerParts, facts: NetworkFacts) {
    [this.units, this.rows] = facts.factors.shape as [number, number];
    [this.latent, this.count] = [facts.weights.shape[0]!, facts.outputs.shape[1]!];
    [this.inputs, this.outputs] = [parts.numbers(facts.inputs), parts.numbers(facts.outputs)];
    [this.factors, this.shifts] = [parts.numbers(facts.factors), parts.numbers(facts.shifts)];
    [this.tail, this.weights] = [parts.numbers(facts.tail), parts.numbers(facts.weights)];
    this.basis = facts.basis && parts.numbers(facts.basis);
    this.radial = facts.radial;
  }

  scaled(x: readonly number[]): number[] {
    const n = x.length;
    return x.map((v, i) => {
      const [far, h, b] = [v - this.inputs[i]!, this.inputs[n + i]!, this.inputs[2 * n + i]!];
      return far / (b === 0 ? h : Math.max(h + b * far, h / (2 * (1 + Math.abs(b)))));
    });
  }

  /** A ξ − b of a unit. */
  offset(unit: number, xs: readonly number[]): number[] {
    const n = xs.length;
    return Array.from({ length: this.rows }, (_, r) => {
      const at = unit * this.rows + r;
      let v = -this.shifts[at]!;
      for (let i = 0; i < n; i++) v += this.factors[at * n + i]! * xs[i]!;
      return v;
    });
  }

  /** Values of all units. */
  values(xs: readonly number[]): number[] {
    return Array.from({ length: this.units }, (_, k) => {
      return radial(this.radial, this.offset(k, xs).reduce((sum, v) => sum + v * v, 0))[0];
    });
  }

  predict(x: readonly number[]): number[] {
    const xs = this.scaled(x);
    const [phi, n, m] = [this.values(xs), x.length, this.count];
    const latent = Array.from({ length: this.latent }, (_, j) => {
      let y = this.tail[j * (1 + n)]!;
      for (let i = 0; i < n; i++) y += this.tail[j * (1 + n) + 1 + i]! * xs[i]!;
      for (let k = 0; k < this.units; k++) y += this.weights[j * this.units + k]! * phi[k]!;
      return y;
    });
    const { basis } = this;
    return Array.from({ length: m }, (_, j) => {
      const y = basis ? latent.reduce((sum, v, k) => sum + v * basis[j * this.latent + k]!, 0) : latent[j]!;
      return this.outputs[j]! + this.outputs[m + j]! * y;
    });
  }

  /** Weight of a unit in an output, through the basis where there is one. */
  weight(output: number, unit: number): number {
    const { basis, weights, units } = this;
    if (!basis) return weights[output * units + unit]!;
    let w = 0;
    for (let k = 0; k < this.latent; k++) w += basis[output * this.latent + k]! * weights[k * units + unit]!;
    return w;
  }
}

/** The calibrated deviation of a network's outputs. */
class Deviation {
  private readonly network: Network;
  private readonly noise: Numbers;
  private readonly coefficients: Numbers;
  private readonly root: Numbers;
  private readonly through: Numbers;
  private readonly pattern: Numbers;
  private readonly factor: Numbers;
  private readonly regressors: number;
  private readonly columns: number; // of the root

  constructor(parts: AnswerParts, facts: DeviationFacts) {
    this.network = new Network(parts, facts.network);
    [this.noise, this.factor] = [parts.numbers(facts.noise), parts.numbers(facts.factor)];
    [this.coefficients, this.root] = [parts.numbers(facts.coefficients), parts.numbers(facts.root)];
    [this.through, this.pattern] = [parts.numbers(facts.through), parts.numbers(facts.pattern)];
    [this.regressors, this.columns] = [facts.coefficients.shape[0]!, facts.root.shape[1]!];
  }

  of(x: readonly number[]): number[] {
    const { network, noise, factor } = this;
    const variance = this.variance(network.scaled(x));
    return Array.from(noise, (_, j) => Math.sqrt(variance[j]!) * factor[j]! * network.outputs[network.count + j]!);
  }

  private variance(xs: number[]): number[] {
    const { network, regressors: c, coefficients } = this;
    if (c === 0) return Array.from(this.noise);
    const row = [...[1, ...xs].slice(0, c - network.units), ...network.values(xs)];
    let form = 1;
    for (let i = 0; i < c; i++) for (let j = 0; j < c; j++) form += row[i]! * coefficients[i * c + j]! * row[j]!;
    const linear = Array.from(this.noise, (s) => s * form);
    if (this.root.length === 0) return linear;
    const moved = this.moved(xs, row);
    return linear.map((v, j) => {
      const sum = new Float64Array(this.columns);
      moved.forEach((some, k) => {
        const w = network.weight(j, k);
        for (let z = 0; z < sum.length; z++) sum[z]! += w * some[z]!;
      });
      return v + sum.reduce((total, s) => total + s * s, 0);
    });
  }

  /** How each unit moves with the root of its covariance. */
  private moved(xs: readonly number[], row: readonly number[]): Float64Array[] {
    const { network, root, through, pattern, columns } = this;
    const entries = pattern.length / 2;
    return Array.from({ length: network.units }, (_, k) => {
      const v = network.offset(k, xs);
      const slope = 2 * radial(network.radial, v.reduce((sum, u) => sum + u * u, 0))[1];
      const e = Array.from({ length: entries }, (_, i) => slope * v[pattern[i]!]! * xs[pattern[entries + i]!]!);
      e.push(...v.map((u) => -slope * u));
      const [q, width] = [e.length, network.units * e.length];
      const out = new Float64Array(columns);
      e.forEach((own, i) => {
        let value = own;
        row.forEach((r, c) => (value -= r * through[c * width + k * q + i]!));
        for (let z = 0; z < columns; z++) out[z]! += value * root[(k * q + i) * columns + z]!;
      });
      return out;
    });
  }
}

/** Numbers that were learnt together. */
export class Group {
  readonly outputs: GroupFacts["outputs"];
  private readonly network: Network;
  private readonly members: Network[];
  private readonly sure: Deviation | null;
  private readonly points: Numbers | null;
  private readonly shares: Numbers | null;
  private readonly missed: Numbers | null;

  constructor(
    parts: AnswerParts,
    private readonly facts: GroupFacts,
  ) {
    this.outputs = facts.outputs;
    this.network = new Network(parts, facts.network);
    this.members = facts.members.map((member) => new Network(parts, member));
    this.sure = facts.deviation && new Deviation(parts, facts.deviation);
    this.points = facts.region && parts.numbers(facts.region.points);
    this.shares = facts.influence && parts.numbers(facts.influence.shares);
    this.missed = facts.influence && parts.numbers(facts.influence.missed);
  }

  get level(): number {
    return this.facts.level;
  }

  /** Half width of the interval of `level`, in deviations. */
  get factor(): number {
    return this.facts.factor;
  }

  predict(x: readonly number[]): number[] {
    return this.network.predict(x);
  }

  /** Standard deviations; not-a-number where they are unknown. */
  deviation(x: readonly number[]): number[] {
    if (!this.sure) return this.outputs.map(() => NaN);
    const apart = this.disagreement(x);
    return this.sure.of(x).map((s, j) => Math.max(s, apart[j]!));
  }

  trusted(x: readonly number[]): boolean {
    const xs = this.network.scaled(x);
    if (!this.near(xs)) return false;
    if (!this.sure) return true;
    const [apart, single] = [this.disagreement(x), this.influence(xs)];
    return this.sure.of(x).every((s, j) => Math.max(apart[j]!, single[j]!) <= ASTRAY * s);
  }

  private near(xs: readonly number[]): boolean {
    const { points } = this;
    if (!points) return xs.every((v) => Math.abs(v) <= 1 + EDGE);
    let best = Infinity;
    for (let i = 0; i < points.length; i += xs.length) {
      best = Math.min(best, xs.reduce((sum, v, j) => sum + (v - points[i + j]!) ** 2, 0));
    }
    return Math.sqrt(best) <= this.facts.region!.radius;
  }

  private disagreement(x: readonly number[]): number[] {
    const answers = this.members.map((member) => member.predict(x));
    return this.outputs.map((_, j) => {
      if (answers.length === 0) return 0;
      const mean = answers.reduce((sum, y) => sum + y[j]!, 0) / answers.length;
      return Math.sqrt(answers.reduce((sum, y) => sum + (y[j]! - mean) ** 2, 0) / answers.length);
    });
  }

  /** The jackknife's deviation: how the answers hang on single samples. */
  private influence(xs: readonly number[]): number[] {
    const { shares, missed, network } = this;
    const m = this.outputs.length;
    if (!shares || !missed) return this.outputs.map(() => 0);
    const [samples, row] = [missed.length / m, [1, ...xs, ...network.values(xs)]];
    const sums = new Array<number>(m).fill(0);
    for (let p = 0; p < samples; p++) {
      const a = row.reduce((sum, r, i) => sum + r * shares[i * samples + p]!, 0);
      for (let j = 0; j < m; j++) sums[j]! += (a * missed[p * m + j]!) ** 2;
    }
    return sums.map((s, j) => Math.sqrt(s) * network.outputs[m + j]!);
  }
}
