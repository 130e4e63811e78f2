// Facts about the model: its own figures, and the record of its making in its file.

import { fixed, tidy, worded } from "./units";

const ROWS = 80; // of one group
const FIRST = ["validation", "errors of solves left out of learning in turn", "limits", "warnings"]; // groups that matter most stand first and open
const HASH = /^[0-9a-f]{32,}$/;
const UNITS: Record<string, readonly [unit: string, factor: number]> = {
  young: ["GPa", 1e-9],
  density: ["kg/m³", 1],
  length: ["m", 1],
  radius: ["mm", 1e3],
  "half height": ["mm", 1e3],
  "max force": ["N", 1],
  rate: ["Hz", 1],
};

export type Row = readonly [string, string];

interface Known {
  meta: Record<string, unknown>;
  max_force?: number; // of a body that is touched
  scale?: number;
}

/** `own`: what the kind of body has to say of itself. */
export function about(hello: Known, own: Row[]): void {
  const entries = Object.entries(hello.meta);
  const apart = (value: unknown): boolean => isGroup(value) || areSentences(value);
  const loose = entries.filter(([, value]) => !apart(value)).flatMap(([key, value]) => rows([key], value));
  const groups = entries.filter(([, value]) => apart(value));
  const rank = (key: string): number => (FIRST.includes(key) ? FIRST.indexOf(key) : FIRST.length);
  groups.sort(([a], [b]) => rank(a) - rank(b));
  document
    .getElementById("meta")!
    .replaceChildren(table([...loose, ...own, ...figures(hello)]), ...groups.map(([key, value]) => group(key, value)));
}

function figures({ max_force: force, scale }: Known): Row[] {
  if (force === undefined || scale === undefined) return [];
  return [
    ["force limit", `${tidy(force)} N`],
    ["1 mm of the hand is", `${tidy(scale)} mm at the body`],
  ];
}

function group(key: string, value: unknown): HTMLElement {
  const [details, summary] = [document.createElement("details"), document.createElement("summary")];
  summary.textContent = key.replaceAll("_", " ");
  details.open = FIRST.includes(key);
  details.append(summary, areSentences(value) ? sentences(value) : table([...rows([], value)].slice(0, ROWS)));
  return details;
}

function sentences(all: readonly string[]): HTMLElement {
  const list = document.createElement("ul");
  list.append(...all.map((words) => worded("li", words)));
  return list;
}

function table(all: Row[]): HTMLElement {
  const list = document.createElement("dl");
  for (const [key, value] of all) {
    const [term, words] = [document.createElement("dt"), document.createElement("dd")];
    [term.textContent, words.textContent] = [key, value];
    words.classList.toggle("hash", HASH.test(value));
    list.append(term, words);
  }
  return list;
}

function areSentences(value: unknown): value is string[] {
  return Array.isArray(value) && value.length > 0 && value.every((words) => typeof words === "string" && words.endsWith("."));
}

function isGroup(value: unknown): boolean {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/** Every plain value below `value`, named by the last two steps of its path. */
function rows(path: string[], value: unknown): Row[] {
  if (value === null || value === undefined || value === "") return [];
  if (isGroup(value)) {
    return Object.entries(value).flatMap(([key, inner]) => rows([...path, key.replaceAll("_", " ")], inner));
  }
  const name = path.slice(-2).join(" · ");
  if (!Array.isArray(value)) return [[name, measured(path.at(-1) ?? "", value)]];
  if (value.some(isGroup)) {
    return value.flatMap((inner, i) => rows([...path.slice(0, -1), `${path.at(-1)} ${i + 1}`], inner));
  }
  return value.length <= 8 ? [[name, value.map(plain).join(", ")]] : [];
}

/** A value with its unit, where its name tells which; errors and ratios come in words. */
function measured(name: string, value: unknown): string {
  if (typeof value !== "number") return plain(value);
  const [unit, factor] = UNITS[name] ?? ["", 1];
  return unit ? `${plain(factor * value)}\u00a0${unit}` : plain(value);
}

function plain(value: unknown): string {
  if (typeof value === "number") return whole(value) ? fixed(value, 0) : tidy(value);
  if (typeof value === "boolean") return value ? "yes" : "no";
  const words = String(value);
  // to the minute, and the zone only where it is the common one
  return words.replace(/^(\d{4}-\d\d-\d\d)T(\d\d:\d\d)\S*\+00:00$/, "$1 $2 UTC");
}

function whole(value: number): boolean {
  return Number.isInteger(value) && Math.abs(value) < 1e6;
}
