// The page: joins the connection, the hand, the view and the panel, one picture at a time.

import { gradient } from "./colour";
import { Connection } from "./connection";
import { HandInput } from "./hand";
import { decodeFrame, isHello } from "./messages";
import type { Frame, Hello } from "./messages";
import { Panel } from "./panel";
import { element } from "./readings";
import { View } from "./scene";
import { describe, say, status, warn } from "./telling";
import { fixed, metres, tidy } from "./units";

const SILENT = 1500; // ms without a picture until the page says so

const canvas = element<HTMLCanvasElement>("view");
const panel = new Panel();
let view: View | null = null;
let latest: Frame | null = null;
let lastFrame = 0;

const connection = new Connection<Hello, Frame>({ isHello, decode: decodeFrame }, { hello: start, notice: warn, lost });
const hand = new HandInput(canvas, connection);

function start(hello: Hello): void {
  if (view && JSON.stringify(view.hello) !== JSON.stringify(hello)) {
    location.reload(); // the server is back with another body: a fresh page is simpler than a changed one
    return;
  }
  element("banner").hidden = true;
  panel.start(hello, (i, value) => {
    const values = Float32Array.from(latest?.parameters ?? []);
    values[i] = value;
    hand.parameters = values;
    hand.send();
  });
  if (!view) open(hello);
  lastFrame = performance.now();
}

function open(hello: Hello): void {
  try {
    view = new View(canvas, hello, ["title", "tools", "scale-notes", "legend"].map(element));
  } catch (error) {
    // a browser without WebGL still shows the numbers
    say(`No 3-D view: this browser offers no WebGL (${String(error)}).`, "calm");
    return;
  }
  hand.attach(view);
  element("legend-bar").style.background = gradient();
  element("legend-ticks").replaceChildren(
    ...[0, 0.25, 0.5, 0.75, 1].map((t) => {
      const tick = document.createElement("span");
      tick.textContent = t === 0 || t === 1 ? metres(t * hello.reach, hello.reach) : "";
      return tick;
    }),
  );
  element("true-scale").hidden = view.enlargement === 1;
  notes(view);
  view.look(); // now that the words stand where they will
}

function notes(view: View): void {
  const times = (n: number): string => (n === 1 ? "to scale" : `drawn × ${tidy(n)}`);
  element("scale-notes").replaceChildren(
    ...[
      `displacement ${times(view.enlarged)}`,
      `thickness ${times(view.thickened)}`,
      "bands: nodes of interest",
    ].map((words) => {
      const line = document.createElement("div");
      line.textContent = words;
      return line;
    }),
  );
}

function lost(): void {
  latest = null;
  hand.release();
  panel.lost();
  element("arrow-label").hidden = true;
  status("lost", "disconnected, trying again");
  say("Disconnected from palpate. This page connects again as soon as the server is back.", "bad");
}

function labelArrow(view: View, frame: Frame): void {
  const label = element("arrow-label");
  label.hidden = !view.arrow.group.visible;
  if (label.hidden) return;
  label.textContent = `${fixed(Math.hypot(...frame.force), 2)} N`;
  const [at, from] = [view.project(view.arrow.end), view.project(view.tip)];
  const [width, height] = [label.offsetWidth, label.offsetHeight];
  const level = Math.abs(at.x - from.x) > Math.abs(at.y - from.y); // beside its end it would hide tip or body
  const beside = at.x + 16 + width < canvas.clientWidth ? at.x + 12 : at.x - 12 - width;
  const x = level ? at.x - width / 2 : beside;
  const y = level ? at.y - height - 14 : at.y - 12;
  label.style.transform = `translate(${Math.max(x, 4)}px, ${Math.max(y, 4)}px)`;
}

function picture(): void {
  requestAnimationFrame(picture);
  if (document.hidden) return; // grants no credit, so nothing is sent either
  hand.tick();
  const frame = connection.take();
  const now = performance.now();
  if (frame) {
    if (changed(frame, latest)) view?.show(frame);
    [latest, lastFrame] = [frame, now];
    describe(frame);
    panel.update(frame, true);
  } else if (connection.connected && latest && now - lastFrame > SILENT) {
    status("warn", "no pictures from the server");
  }
  if (view?.render()) where(view);
}

/** Put on the page what follows the tip. */
function where(view: View): void {
  if (latest) labelArrow(view, latest);
  const [at, box] = [view.project(view.tip), canvas.getBoundingClientRect()];
  // for programs that drive the page: where the ball is, in pixels of the window
  document.documentElement.dataset["tip"] = `${at.x + box.left} ${at.y + box.top}`;
}

/** Whether two frames look different: a body at rest is not drawn again. */
function changed(a: Frame, b: Frame | null): boolean {
  if (!b || a.grabbed !== b.grabbed) return true;
  const differ = (p: ArrayLike<number>, q: ArrayLike<number>): boolean =>
    Array.from(p).some((x, i) => Math.abs(x - q[i]!) > 1e-7);
  return differ(a.displacement, b.displacement) || differ(a.force, b.force) || differ(a.position, b.position);
}

function recolour(): void {
  view?.recolour();
  panel.recolour();
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolour);
new ResizeObserver(() => {
  view?.resize();
  view?.look();
}).observe(canvas);
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) return;
  panel.hidden();
  status("warn", "in the background");
});
canvas.addEventListener("dblclick", () => view?.look());
element("reset-view").addEventListener("click", () => view?.look());
element("true-scale").addEventListener("click", (event) => {
  if (!view) return;
  const on = view.enlarged !== 1;
  view.enlarge(on ? 1 : view.enlargement);
  (event.currentTarget as HTMLElement).setAttribute("aria-pressed", String(on));
  if (latest) view.show(latest);
  notes(view);
});
requestAnimationFrame(picture);
