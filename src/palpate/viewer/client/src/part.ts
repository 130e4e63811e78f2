// The page of a part: it is set up, then solved and learnt, and touched as soon as there is something to touch.

import { joinServer } from "./connection";
import { say, status } from "./flags";
import { Learning, toast } from "./learning";
import {
  decodePartFaces,
  decodeSurface,
  encodeEndWish,
  encodePicks,
  isAnswer,
  isLearningProgress,
  isPartFacts,
  isPartNews,
  PROTOCOL,
  Role,
} from "./messages";
import type { LearningProgress, PartFacts, PartNews, StartWish } from "./messages";
import { PartView } from "./part_view";
import { Refusal } from "./refusal";
import { lose } from "./restart";
import { Setup } from "./setup";
import { mode, watch } from "./skeleton";
import { touch } from "./touch";
import type { Touched } from "./touch";
import { element, tidy } from "./units";

const GONE = "The server of this page has ended. Give the command again, and open the new address that the terminal shows";
const PRESS = "You can press it now.";
const PIECE = 900; // triangles in a message: the server takes 4 kB
const AGAIN = 1000; // ms until a lost connection is tried again

const canvas = element<HTMLCanvasElement>("part-view");
const root = document.documentElement;

let socket: WebSocket;
let view: PartView | null = null;
let setup: Setup | null = null;
let refusal: Refusal | null = null;
let loading: Promise<PartFacts> | null = null;
let touched: Touched | null = null;
let news: PartNews | null = null;
let progress: LearningProgress | null = null;
let roomy = false; // there is room above the part for the ball
const learning = new Learning(() => send(encodeEndWish({ sure: true })));

export function part(): void {
  mode("work");
  status("connecting", "reading the part");
  connect();
  watch(() => view, undefined, canvas);
  requestAnimationFrame(picture);
}

function connect(): void {
  socket = new WebSocket(`ws://${location.host}/part`);
  socket.onmessage = (event: MessageEvent<string>) => hear(JSON.parse(event.data) as { kind: string });
  socket.onopen = () => served(true);
  socket.onclose = () => {
    if (!touched) served(false);
    setTimeout(connect, AGAIN);
  };
}

/** Say that the server is gone, or take that back. */
function served(on: boolean): void {
  if (setup) setup.connected = on;
  if (on) {
    element("banner").hidden = true;
    return;
  }
  const stays = news?.stage === "choosing" ? "what is chosen here stays while the page is open." : "it goes on where it stopped.";
  lose(`${GONE}: ${stays}`);
}

function send(message: string | ArrayBuffer): void {
  if (socket.readyState === WebSocket.OPEN) socket.send(message);
}

function hear(message: { kind: string }): void {
  if (isPartNews(message)) turn(message);
  if (isAnswer(message)) (setup ?? refusal)?.answer(message);
  if (!isLearningProgress(message)) return;
  progress = message;
  learning.hear(message);
  element("model-line").textContent ||= message.phase;
  touched?.state(message.error_p95);
  if (touched) touched.mark(message.places);
  else view?.mark(message.places);
}

function turn(message: PartNews): void {
  if (message.protocol !== PROTOCOL || (news && isOther(message, news))) {
    location.reload(); // another version of palpate, another part, or another unit of its numbers
    return;
  }
  news = message;
  root.dataset["stage"] = message.stage;
  document.title = `${message.name} · palpate`;
  if (!touched) element("model-name").textContent = message.name;
  if (message.stage === "refused") refuse(message);
  if (message.stage === "choosing") choose();
  if (message.stage === "working" || message.stage === "ended") work(message);
}

function isOther(message: PartNews, before: PartNews): boolean {
  const other = before.name !== message.name || before.version > message.version;
  return other || (before.part > 0 && before.part !== message.part);
}

/** Say why the part is refused, and offer a wrap. */
function refuse({ words, wrap }: PartNews): void {
  status("connecting", "refused");
  mode("refused");
  refusal ??= new Refusal(words, wrap, (size) => send(JSON.stringify({ kind: "WrapWish", size })));
}

/** Show the part with all that can be chosen. */
function choose(): void {
  status("connecting", "not started yet");
  if (news?.words) say(news.words, "calm");
  loading ??= open();
  loading
    .then((facts) => {
      if (news?.stage !== "choosing") return;
      mode("setup");
      const judge = (wish: StartWish): void => send(JSON.stringify({ kind: "StartWish", ...wish }));
      setup ??= new Setup(canvas, view!, facts, begin, judge, (unit) => send(JSON.stringify({ kind: "UnitWish", unit })));
      view!.look();
    })
    .catch(fail);
}

async function open(): Promise<PartFacts> {
  const [facts, surface, faces] = await Promise.all([
    get("part/facts").then((answer) => answer.json() as Promise<{ kind: string }>),
    get("part/surface").then(async (answer) => decodeSurface(await answer.arrayBuffer())),
    get("part/faces").then(async (answer) => decodePartFaces(await answer.arrayBuffer())),
  ]);
  if (!isPartFacts(facts)) throw new Error("the server speaks of something else");
  view = new PartView(canvas, surface, faces, ["title", "tools", "scale-notes", "legend"].map(element));
  element("model-line").textContent = `${facts.file}, ${facts.size.map((side) => tidy(1000 * side)).join(" × ")} mm`;
  if (progress) view.mark(progress.places);
  return facts;
}

function begin(wish: StartWish, held: number[] | null, chosen: number[] | null): void {
  for (const [role, triangles] of [
    [Role.HELD, held],
    [Role.TOUCHED, chosen],
  ] as const) {
    if (!triangles) continue;
    for (let at = 0; at === 0 || at < triangles.length; at += PIECE) {
      const piece = Float32Array.from(triangles.slice(at, at + PIECE));
      send(encodePicks({ role, first: at === 0, triangles: piece }));
    }
  }
  send(JSON.stringify({ kind: "StartWish", ...wish }));
}

/** Solves run, or have ended; the body is touched once there is one. */
function work(message: PartNews): void {
  root.dataset["learning"] = "";
  if (element("banner").dataset["tone"] === "calm") element("banner").hidden = true; // of a wrap
  if (message.stage === "ended") learning.end(message.words);
  else if (message.words) element("phase").textContent = message.words;
  wait();
  if (message.version > 0) {
    touched ??= joinTouch();
    return;
  }
  mode("work");
  if (message.part === 0 && message.stage === "ended") {
    status("ended", "not begun"); // the part could not be read
    say(message.words, "bad");
    return;
  }
  status("connecting", message.stage === "ended" ? "ended" : "solving");
  loading ??= open();
  loading
    .then(() => {
      if (!roomy) view?.leaveRoom();
      roomy = true;
    })
    .catch(fail);
}

/** Say whether the part can be pressed yet, and what happens meanwhile. */
function wait(): void {
  const over = news?.stage === "ended";
  const yet = over ? "" : "It can't be pressed yet. A first version comes after the first solves, in about a minute; you need not wait here.";
  const words = root.dataset["touching"] ? (over ? PRESS : `${PRESS} Solves go on, and make it better meanwhile.`) : yet;
  if (element("pressable").textContent !== words) element("pressable").textContent = words; // read aloud once
}

function joinTouch(): Touched {
  const renewed = (version: number): void => {
    if (view) {
      view.dispose();
      view = null;
    }
    if (!root.dataset["touching"]) toast(PRESS);
    root.dataset["touching"] = String(version);
    wait();
  };
  const joined = touch({ connect: joinServer, renewed, before: () => view });
  if (progress) joined.mark(progress.places);
  joined.state(progress?.error_p95 ?? null);
  return joined;
}

async function get(path: string): Promise<Response> {
  const answer = await fetch(`./${path}`);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer;
}

function picture(): void {
  if (root.dataset["touching"]) return; // the body is drawn by its own page
  requestAnimationFrame(picture);
  if (document.hidden || !view?.render()) return;
  // for programs that drive the page: where some triangles are, in pixels of the window
  root.dataset["partdrawn"] = "true";
}

function fail(error: unknown): void {
  say(`The part can't be shown: ${String(error)}.`, "bad");
}
