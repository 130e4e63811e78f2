// The facts of a page of answers, as palpate/viewer/answer_page.py writes them, and its arrays.

import { json, part, words } from "./file_parts";

/** Where an array stands among the parts of the page. */
export interface ArrayFacts {
  part: string;
  at: number; // bytes
  kind: "f4" | "f8" | "i4";
  shape: number[];
}

export interface Named {
  name: string;
  unit: string;
}

export interface InputFacts extends Named {
  low: number;
  high: number;
}

export interface NetworkFacts {
  radial: "gaussian" | "inverse-multiquadric" | "matern-5/2";
  inputs: ArrayFacts;
  outputs: ArrayFacts;
  factors: ArrayFacts;
  shifts: ArrayFacts;
  weights: ArrayFacts;
  tail: ArrayFacts;
  basis: ArrayFacts | null;
}

export interface DeviationFacts {
  network: NetworkFacts;
  noise: ArrayFacts;
  coefficients: ArrayFacts;
  root: ArrayFacts;
  through: ArrayFacts;
  pattern: ArrayFacts;
  factor: ArrayFacts;
}

export interface GroupFacts {
  outputs: Named[];
  network: NetworkFacts;
  members: NetworkFacts[];
  region: { points: ArrayFacts; radius: number } | null;
  deviation: DeviationFacts | null;
  influence: { shares: ArrayFacts; missed: ArrayFacts } | null;
  level: number; // share of unseen solves that an interval holds
  factor: number; // half width of that interval, in standard deviations
}

export interface ModesFacts extends Named {
  components: string[];
  coefficients: GroupFacts;
  mean: ArrayFacts;
  modes: ArrayFacts;
  scatter: ArrayFacts;
  widening: number | null;
  solved: ArrayFacts | null; // coefficients of the solves that it was learnt from, in the order of their inputs
}

export interface CurveFacts extends ModesFacts {
  axis: Named & { values: number[] };
}

export interface Scale {
  name: string;
  component: number; // −1: the size of the vector
  low: number;
  high: number;
}

export interface DrawingFacts {
  rest: ArrayFacts;
  triangles: ArrayFacts;
  creases: ArrayFacts;
  source: ArrayFacts; // of each drawn point, the row of the field
  moved: ArrayFacts; // of each drawn point, the row of a field at the nodes of the same mesh
}

export interface FieldFacts extends ModesFacts {
  mesh: number;
  kind: "nodes" | "cells";
  drawing: DrawingFacts;
  scales: Scale[];
  moves: boolean; // a displacement
}

export interface AnswerFacts {
  name: string;
  purpose: string;
  inputs: InputFacts[];
  groups: GroupFacts[];
  solves: ArrayFacts | null;
  curves: CurveFacts[];
  fields: FieldFacts[];
  meta: Record<string, unknown>;
}

export type Numbers = Float32Array | Float64Array | Int32Array;

const KINDS = { f4: Float32Array, f8: Float64Array, i4: Int32Array };

/** All that a page knows: its facts, and how to read its arrays. */
export class AnswerParts {
  private constructor(
    readonly facts: AnswerFacts,
    private readonly parts: ReadonlyMap<string, Uint8Array>,
  ) {}

  static async read(): Promise<AnswerParts> {
    const facts = await json<AnswerFacts>("answers");
    const names = ["answers-main", ...facts.fields.map((_, i) => `answers-${i}`)];
    const parts = await Promise.all(names.map(async (name) => [name, await part(name)] as const));
    return new AnswerParts(facts, new Map(parts));
  }

  /** The numbers of an array, row by row. */
  numbers({ part: name, at, kind, shape }: ArrayFacts): Numbers {
    const [count, Kind] = [shape.reduce((a, b) => a * b, 1), KINDS[kind]];
    const size = count * Kind.BYTES_PER_ELEMENT;
    return new Kind(words(this.parts.get(name)!.subarray(at, at + size), Kind.BYTES_PER_ELEMENT).buffer);
  }
}
