// The control page: where the sitting is, and pause, end and notes. The participant never sees it.
"use strict";
const at = (id) => document.getElementById(id);
const ROWS = [
  ["Phase", (v) => v.phase],
  ["Trials", (v) => `${v.done} of ${v.total}`],
  ["Time", (v) => `${v.minutes.toFixed(1)} of ${v.limit} min`],
  ["Participant's page", (v) => (v.connected ? "open" : "not there")],
  ["Trial", (v) => (v.trial === null ? "" : `${v.trial}, ${v.kind}, ${v.condition}, ${v.value}`)],
  ["Bodies", (v) => v.bodies.map((b, k) => (k + 1 === v.interval ? `[${b}]` : b)).join("  ")],
  ["Force and depth", (v) => `${v.force.toFixed(2)} N, ${v.depth.toFixed(1)} mm`],
];
let socket = null;

const cells = ROWS.map(([name]) => {
  const row = at("facts").insertRow();
  row.insertCell().textContent = name;
  return row.insertCell();
});

function connect() {
  socket = new WebSocket(`ws://${location.host}/sitting`);
  socket.onmessage = (event) => draw(JSON.parse(event.data));
  socket.onclose = () => { at("said").textContent = "The program has ended."; setTimeout(connect, 1000); };
}

function draw(view) {
  at("title").textContent = `Sitting of ${view.participant}`;
  at("progress").value = view.total ? view.done / view.total : 0;
  ROWS.forEach(([, words], k) => { cells[k].textContent = words(view); });
  at("said").textContent = [view.words, view.said].filter(Boolean).join("\n");
  at("pause").disabled = ["paused", "done", "failed", "consent"].includes(view.phase);
  at("resume").disabled = view.phase !== "paused";
  at("end").disabled = ["done", "failed"].includes(view.phase);
  document.documentElement.dataset.phase = view.phase;
}

const say = (message) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message)); };
for (const wish of ["pause", "resume"]) at(wish).onclick = () => say({ wish });
at("end").onclick = () => { if (confirm("End the sitting? It can be taken up again.")) say({ wish: "end" }); };
at("write").onclick = () => { say({ note: at("note").value }); at("note").value = ""; };
connect();
