// The participant's page. It shows the phase that the conductor names, and sends the hand, consent and answers.
"use strict";
const at = (id) => document.getElementById(id);
const ORDINALS = ["First", "Second", "Third"];
const SECTIONS = { consent: "consent", ready: "ready", touch: "touching", question: "question" };
let socket = null, view = {}, shown = "", hand = 0, held = false, from = 0;

function say(message) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function connect() {
  socket = new WebSocket(`ws://${location.host}/sitting`);
  socket.onmessage = (event) => { view = JSON.parse(event.data); draw(); };
  socket.onclose = () => { view = { phase: "gone" }; draw(); setTimeout(connect, 1000); };
}

// what changes only with the phase is built once: a button that is rebuilt under a finger is never clicked
function build() {
  const section = SECTIONS[view.phase] || "waiting";
  for (const id of [...Object.values(SECTIONS), "waiting"]) at(id).hidden = id !== section;
  if (view.phase === "consent") at("consent-text").textContent = view.consent;
  if (view.phase === "touch") {
    at("which").textContent = view.intervals > 1 ? `${ORDINALS[view.interval - 1]} body` : "The body";
    at("how").textContent = view.page ? "Press here, hold, and draw downwards until the bar meets the line."
      : "Press with the device until the bar meets the line.";
    at("force").hidden = !view.page;
    at("depth").querySelector("b").style.top = `${100 / view.beyond}%`;
  }
  if (view.phase === "question") buildQuestion();
  document.documentElement.dataset.phase = view.phase;
}

function buildQuestion() {
  at("ask").textContent = view.ask;
  at("answers").replaceChildren();
  at("ratings").replaceChildren();
  if (view.rate.length) { buildRatings(); return; }
  for (let k = 1; k <= view.intervals; k++) {
    const button = document.createElement("button");
    button.textContent = ORDINALS[k - 1];
    button.dataset.answer = k;
    button.onclick = () => say({ answer: k });
    at("answers").append(button);
  }
}

function buildRatings() {
  view.rate.forEach((text, n) => {
    const set = document.createElement("fieldset"), legend = document.createElement("legend");
    legend.textContent = `${text} (1: not at all, 7: fully)`;
    set.append(legend);
    for (let k = 1; k <= 7; k++) {
      const label = document.createElement("label"), input = document.createElement("input");
      Object.assign(input, { type: "radio", name: `r${n}`, value: k, required: true });
      label.append(input, String(k));
      set.append(label);
    }
    at("ratings").append(set);
  });
  const button = document.createElement("button");
  button.className = "main";
  button.textContent = "Next";
  at("ratings").append(button);
}

function draw() {
  const key = `${view.phase}/${view.interval}`;
  if (key !== shown) { shown = key; release(); build(); }
  if (view.phase === "touch") {
    at("depth").firstElementChild.style.height = `${Math.min(100, 100 * view.depth / view.beyond)}%`;
    if (view.page) at("force").firstElementChild.style.height = `${Math.min(100, 100 * view.force)}%`;
  }
  at("wait").textContent = waiting();
}

function waiting() {
  if (view.phase === "break") return `A break. It goes on in ${view.left} s.`;
  if (view.phase === "lift") return "Let go.";
  if (view.phase === "between") return "The next body comes …";
  if (view.phase === "paused") return "A pause. Please wait.";
  if (view.phase === "gone") return "The page has lost its program. Please wait.";
  return view.words || "";
}

function release() { held = false; hand = 0; at("pad").classList.remove("held"); }

const pad = at("pad");
pad.addEventListener("pointerdown", (event) => {
  pad.setPointerCapture(event.pointerId);
  held = true; hand = 0; from = event.clientY;
  pad.classList.add("held");
});
pad.addEventListener("pointermove", (event) => {
  if (held) hand = Math.min(1, Math.max(0, (event.clientY - from) / (0.75 * pad.clientHeight)));
});
for (const end of ["pointerup", "pointercancel"]) pad.addEventListener(end, release);
at("agree").onclick = () => say({ agree: true });
at("go").onclick = () => say({ go: true });
at("ratings").addEventListener("submit", (event) => {
  event.preventDefault();
  const data = new FormData(event.target);
  say({ answer: view.rate.map((_, n) => Number(data.get(`r${n}`))) });
});
document.addEventListener("keydown", (event) => {
  if (event.repeat) return;
  if (view.phase === "question" && !view.rate.length && event.key >= "1" && Number(event.key) <= view.intervals)
    say({ answer: Number(event.key) });
});
// the heartbeat: a page in the background steers nothing
setInterval(() => say({ hand, held, hidden: document.hidden }), 16);
connect();
