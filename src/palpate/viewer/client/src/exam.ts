// The page of an examination: a body is pressed, places are marked and described; practice answers, the examination does not.

import { joinServer } from "./connection";
import { isExamNews, PROTOCOL } from "./messages";
import type { ExamMark, ExamNews, ExamWish, FormerExam, Frame, Vec3 } from "./messages";
import { lose } from "./restart";
import { touch } from "./touch";
import { element, worded } from "./units";
import type { View } from "./view";
import { Vector3 } from "three";

const AGAIN = 1000; // ms until a lost connection is tried again
const SHALLOW = 2e-4; // m: a lighter touch is no place to mark
const ANSWERS = { hardness: ["hard", "soft"], depth: ["deep", "shallow"] } as const;
const root = document.documentElement;

let socket: WebSocket;
let news: ExamNews | null = null;
let heard = 0; // ms, when the news came
let pressed: Vec3 | null = null; // m, the probe's centre when it pressed last
let asked = false; // whether to end has been asked once
const pins = new Map<HTMLElement, Vec3>();

export function exam(): void {
  root.dataset["exam"] = "ready";
  touch({ connect: joinServer, seen: follow, drawn: pin });
  element("exam-practise").addEventListener("click", () => wish({ wish: "practise" }));
  element("exam-begin").addEventListener("click", () => wish({ wish: "examine" }));
  element("exam-mark").addEventListener("click", mark);
  element("exam-show").addEventListener("click", () => wish({ wish: "show" }));
  element("exam-leave").addEventListener("click", () => wish({ wish: "leave" }));
  element("exam-end").addEventListener("click", end);
  document.addEventListener("keydown", (event) => {
    const typing = event.target instanceof HTMLInputElement;
    if (event.key.toLowerCase() === "m" && !event.repeat && !event.ctrlKey && !event.metaKey && !typing) mark();
  });
  setInterval(clock, 250);
  connect();
}

function connect(): void {
  socket = new WebSocket(`ws://${location.host}/exam`);
  socket.onmessage = (event: MessageEvent<string>) => {
    const message = JSON.parse(event.data) as { kind: string };
    if (isExamNews(message)) hear(message);
  };
  socket.onopen = () => (element("banner").hidden = true);
  socket.onclose = () => {
    lose("The server of this page has ended. Give the command again and open its new address: an examination goes on from its list.");
    setTimeout(connect, AGAIN);
  };
}

function wish(what: Partial<ExamWish> & { wish: string }): void {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ kind: "ExamWish", ...what }));
}

function follow(frame: Frame): void {
  if (frame.grabbed && frame.depth > SHALLOW) pressed = frame.position;
  const ready = news !== null && news.stage !== "ready" && pressed !== null;
  const button = element<HTMLButtonElement>("exam-mark");
  if (button.disabled === ready) button.disabled = !ready;
}

function mark(): void {
  if (news && news.stage !== "ready" && pressed) wish({ wish: "mark", place: pressed });
}

/** End at the second click: what is ended can't go on. */
function end(): void {
  if (asked) wish({ wish: "end" });
  asked = !asked;
  element("exam-end").textContent = asked ? "end it now, and see the score" : "end the examination";
}

function hear(message: ExamNews): void {
  if (message.protocol !== PROTOCOL) {
    location.reload();
    return;
  }
  if (news?.stage !== message.stage) {
    pressed = null;
    asked = false;
    element("exam-end").textContent = "end the examination";
  }
  news = message;
  heard = performance.now();
  root.dataset["exam"] = message.stage;
  document.title = `${message.title} · palpate`;
  element("exam-words").textContent = message.words;
  element("exam-notice").textContent = message.notice;
  element("exam-notice").hidden = !message.notice;
  const score = element<HTMLAnchorElement>("exam-score");
  score.hidden = !message.score;
  if (message.score) score.href = `./exams/${message.score}`;
  element("exam-show").setAttribute("aria-pressed", String(message.lumps.length > 0));
  element("exam-marks").replaceChildren(...message.marks.map(entry));
  element("exam-no-marks").hidden = message.marks.length > 0;
  element("exam-former").replaceChildren(...message.former.map(former));
  element("exam-list").hidden = message.former.length === 0;
  stick(message);
  clock();
}

/** One mark of the list: its number, two answers, and what practice says of it. */
function entry(mark: ExamMark): HTMLElement {
  const item = document.createElement("li");
  const head = document.createElement("div");
  head.className = "head";
  head.append(
    worded("strong", `mark ${mark.number}`),
    button("remove", () => wish({ wish: "remove", number: mark.number })),
  );
  item.append(head);
  for (const name of ["hardness", "depth"] as const) {
    const group = document.createElement("div");
    group.className = "choice";
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", `${name} at mark ${mark.number}`);
    for (const value of ANSWERS[name]) {
      const own = button(value, () => {
        const { number, hardness, depth } = mark;
        wish({ wish: "answer", number, hardness, depth, [name]: mark[name] === value ? "" : value });
      });
      own.setAttribute("aria-pressed", String(mark[name] === value));
      group.append(own);
    }
    item.append(group);
  }
  if (mark.answer) item.append(worded("p", mark.answer));
  return item;
}

function former(exam: FormerExam): HTMLElement {
  const item = document.createElement("li");
  item.append(worded("span", exam.at), worded("p", exam.words));
  if (exam.ended) {
    const link = document.createElement("a");
    link.href = `./exams/${exam.name}`;
    link.textContent = "score";
    link.target = "_blank";
    link.rel = "noopener";
    item.append(link);
  } else {
    item.append(button("go on", () => wish({ wish: "resume", name: exam.name })));
  }
  return item;
}

function button(words: string, act: () => void): HTMLButtonElement {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = words;
  made.addEventListener("click", act);
  return made;
}

/** Stick a number on each mark of the body, and a ring on each lump that practice shows. */
function stick({ marks, lumps }: ExamNews): void {
  for (const tag of pins.keys()) tag.remove();
  pins.clear();
  for (const { number, place } of [...marks, ...lumps]) {
    const tag = worded("div", number ? String(number) : "");
    tag.className = number ? "pin" : "pin lump";
    element("stage").append(tag);
    pins.set(tag, place);
  }
  root.dataset["pins"] = String(pins.size); // for programs that drive the page
  moved = "";
}

let moved = ""; // camera for which the pins stand

function pin(view: View): void {
  const { camera } = view.canvas.dataset;
  const now = `${camera} ${view.size().join(" ")}`;
  if (now === moved) return;
  moved = now;
  for (const [tag, place] of pins) {
    const { x, y } = view.project(new Vector3(...place));
    tag.style.transform = `translate(${x}px, ${y}px)`;
  }
}

function clock(): void {
  if (news?.stage !== "examination" || socket.readyState !== WebSocket.OPEN) return;
  const seconds = Math.floor(news.elapsed + (performance.now() - heard) / 1000);
  element("exam-time").textContent = `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}
