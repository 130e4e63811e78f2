// What is known of the model: its own figures, and what its file says of how it was made.

import type { Hello } from "./messages";
import { metres, tidy } from "./units";

const ROWS = 40; // of one group
const FIRST = ["errors", "validation"]; // groups that matter most stand first and open

type Row = readonly [string, string];

export function about(hello: Hello): void {
  const entries = Object.entries(hello.meta);
  const loose = entries.filter(([, value]) => !isGroup(value)).flatMap(([key, value]) => rows([key], value));
  const groups = entries.filter(([, value]) => isGroup(value));
  groups.sort(([a], [b]) => Number(FIRST.includes(b)) - Number(FIRST.includes(a)));
  document
    .getElementById("meta")!
    .replaceChildren(table([...figures(hello), ...loose]), ...groups.map(([key, value]) => group(key, value)));
}

function figures(hello: Hello): Row[] {
  return [
    ["reach of the tip", metres(hello.reach, hello.reach)],
    ["nodes", String(hello.rest.length)],
    ["force limit", `${tidy(hello.max_force)} N`],
    ["hand to body", `1 : ${tidy(hello.scale)}`],
  ];
}

function group(key: string, value: unknown): HTMLElement {
  const [details, summary] = [document.createElement("details"), document.createElement("summary")];
  summary.textContent = key.replaceAll("_", " ");
  details.open = FIRST.includes(key);
  details.append(summary, table([...rows([], value)].slice(0, ROWS)));
  return details;
}

function table(all: Row[]): HTMLElement {
  const list = document.createElement("dl");
  for (const [key, value] of all) {
    const [term, words] = [document.createElement("dt"), document.createElement("dd")];
    [term.textContent, words.textContent] = [key, value];
    list.append(term, words);
  }
  return list;
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
  if (Array.isArray(value)) {
    const short = value.length <= 8 && value.every((v) => typeof v !== "object");
    return short ? [[path.slice(-2).join(" · "), value.map(plain).join(", ")]] : [];
  }
  return [[path.slice(-2).join(" · "), plain(value)]];
}

function plain(value: unknown): string {
  if (typeof value === "number") return Number.isInteger(value) && value < 1e6 ? String(value) : tidy(value);
  if (typeof value === "boolean") return value ? "yes" : "no";
  const words = String(value);
  return /^[0-9a-f]{32,}$/.test(words) ? `${words.slice(0, 12)}…` : words;
}
