// The page of a touched body: joins the connection, the hand, the view and the panel, one picture at a time.

import { bodyOf } from "./bodies";
import type { Body } from "./bodies";
import type { Link, Listener } from "./connection";
import { describe, say, status, warn } from "./flags";
import { Pads } from "./gamepad";
import { pinches } from "./hand_words";
import { LineView } from "./line_view";
import type { Frame, Hello, Vec3 } from "./messages";
import { Panel } from "./panel";
import { Drops, feel } from "./reason";
import { Recorder } from "./recorder";
import { lose } from "./restart";
import { mode, watch } from "./skeleton";
import { element, fixed, worded } from "./units";
import type { View } from "./view";

const SILENT = 1500; // ms without a picture until the page says so
const SAME = 1e-9; // what differs by less is drawn alike

const canvas = element<HTMLCanvasElement>("view");

/** A touched body, for the page of a part that is learnt meanwhile. */
export interface Touched {
  /** Draw dots where solves are done, m. */
  mark(places: readonly Vec3[]): void;
  /** Take the force error over all places, relative, at the 95th percentile; null where it is not known. */
  state(error: number | null): void;
  /** Version of the body that is drawn; 0 before the first picture. */
  readonly version: number;
}

/** How a page of a touched body is joined to what answers it. */
export interface Joint {
  /** Hears of each version of the body once it is drawn. */
  renewed?(version: number): void;
  /** Join whoever answers: the server, or the page itself. */
  connect(listener: Listener): Link;
  /** The view in whose place the body's comes, to look from the same place. */
  before?(): View | null;
  /** Hears of each picture. */
  seen?(frame: Frame): void;
  /** Hears of the view, once it has been asked to draw, picture by picture. */
  drawn?(view: View): void;
}

/** Show a touched body. */
export function touch({ connect, renewed = () => {}, before = () => null, seen = () => {}, drawn: placed = () => {} }: Joint): Touched {
  const panel = new Panel();
  let hello: Hello | null = null;
  let body: Body | null = null;
  let latest: Frame | null = null;
  let drawn: Frame | null = null;
  let pads: Pads | null = null; // of the page's own hand
  let lastFrame = 0;
  let ticked = 0;
  let places: readonly Vec3[] = [];
  let drawable = 0; // version of the body
  let next: { version: number; take: () => void; hello: Hello } | null = null; // comes with the first picture of it

  const connection = connect({
    hello: start,
    notice: warn,
    lost,
    recording: (news) => recorder.show(news),
    reason: (news) => drops.hear(news),
    feel,
  });
  const drops = new Drops((stop) => connection.stop(stop));
  const recorder = new Recorder((wanted) => connection.record(wanted));

  function start(news: Hello): void {
    if (hello && body?.renew && news.version > hello.version && news.name === hello.name) {
      renew(news).catch((error: unknown) => say(`The body can't be shown: ${String(error)}.`, "calm"));
      return;
    }
    if (hello && JSON.stringify(hello) !== JSON.stringify(news)) {
      location.reload(); // the server is back with another body: a fresh page is simpler than a changed one
      return;
    }
    element("banner").hidden = true;
    mode(news.line ? "line" : news.holds ? "pad" : pinches(news) ? "pinch" : "press");
    panel.start(news, {
      moved: (i, value) => {
        const values = Float32Array.from(latest?.parameters ?? []);
        values[i] = value;
        body!.hand.parameters = values;
        body!.hand.send();
      },
      deeper: (depth) => body && "wanted" in body.hand && (body.hand.wanted = depth),
    });
    lastFrame = performance.now();
    if (!news.device) pads ??= new Pads(Math.max(news.force_max, 1e-9), halt);
    if (!body) open(news).catch((error: unknown) => say(`The body can't be shown: ${String(error)}.`, "calm"));
    hello = news;
  }

  async function open(news: Hello): Promise<void> {
    body = bodyOf(news, canvas, connection, panel);
    await body.open(); // without WebGL this fails, and the numbers are still shown
    notes();
    const part = before();
    if (part) body.view!.stand(part);
    else body.view!.look(); // now that the words stand where they will
    body.mark?.(places);
    if (latest) show(latest);
    drawable = news.version;
    renewed(drawable);
  }

  /** A later surrogate: fetch what draws it, while the one before is still drawn. */
  async function renew(news: Hello): Promise<void> {
    const take = await body!.renew!(news);
    next = { version: news.version, take, hello: news };
    connection.ready(news.version);
  }

  /** Change to the surrogate that a frame is drawn with, where it is the next one. */
  function follow(frame: Frame): void {
    if (!next || frame.version !== next.version) return;
    hello = next.hello;
    next.take();
    panel.renew(hello);
    drawable = next.version;
    next = null;
    renewed(drawable);
  }

  function notes(): void {
    element("scale-notes").replaceChildren(...body!.notes().map((words) => worded("div", words)));
  }

  function show(frame: Frame): void {
    if (!body?.view) return;
    body.show(frame);
    drawn = frame;
  }

  function lost(): void {
    latest = drawn = null;
    body?.hand.release();
    panel.lost();
    drops.lost();
    recorder.lost();
    element("arrow-label").hidden = true;
    lose("Disconnected from palpate. If it was ended, start it again, and open the new address that its terminal shows.");
  }

  /** End the force: let go of what this page holds, stop what any other hand does. */
  function halt(): void {
    if (body?.hand.grabbed) body.hand.release();
    else if (hello?.device || latest?.grabbed) drops.stop();
  }

  function picture(): void {
    requestAnimationFrame(picture);
    if (document.hidden) return; // grants no credit, so nothing is sent either
    body?.hand.drive(pads?.read() ?? null, Math.min(performance.now() - ticked, 100));
    ticked = performance.now();
    body?.hand.tick();
    const frame = connection.take();
    drops.show();
    const now = performance.now();
    if (frame) {
      follow(frame);
      [latest, lastFrame] = [frame, now];
      describe(frame, drops.without);
      if (changed(frame, drawn)) show(frame);
      panel.update(frame);
      seen(frame);
      if (body?.hand.byPad) pads?.rumble(frame.force, now);
    } else if (connection.connected && latest && now - lastFrame > SILENT) {
      status("warn", "no pictures from the server");
    }
    if (body?.view?.render() && latest) {
      label(body.view, latest);
      body.place();
      panel.sharpness(body.view.sharpness);
    }
    if (body?.view) placed(body.view);
  }

  watch(
    () => body?.view ?? null,
    () => panel.recolour(),
  );
  // before the canvas hears of it, and lets go
  document.addEventListener("keydown", (event) => event.key === "Escape" && halt(), { capture: true });
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) return;
    panel.hidden();
    status("warn", "in the background");
  });
  element("true-scale").addEventListener("click", (event) => {
    const view = body?.view;
    if (!(view instanceof LineView)) return;
    const on = view.enlarged !== 1;
    view.enlarge(on ? 1 : view.enlargement);
    (event.currentTarget as HTMLElement).setAttribute("aria-pressed", String(on));
    if (latest) show(latest);
    notes();
  });
  requestAnimationFrame(picture);
  return {
    mark: (news) => {
      places = news;
      body?.mark?.(places);
    },
    state: (error) => panel.state(error),
    get version() {
      return drawable;
    },
  };
}

let [measuredFor, width, height] = [0, 0, 0];

/** The force in words beside the arrow's end, where it hides neither the arrow nor what is held. */
function label(view: NonNullable<Body["view"]>, frame: Frame): void {
  const tag = element("arrow-label");
  tag.hidden = !view.arrow.group.visible;
  if (tag.hidden) return;
  const words = `${fixed(Math.hypot(...frame.force), 2)} N`;
  const [at, from] = [view.project(view.arrow.end), view.project(view.grip)];
  tag.textContent = words;
  if (words.length !== measuredFor) {
    measuredFor = words.length; // digits have one width; to measure makes the browser lay out the page
    [width, height] = [tag.offsetWidth, tag.offsetHeight];
  }
  const level = Math.abs(at.x - from.x) > Math.abs(at.y - from.y);
  const beside = at.x + 16 + width < view.size()[0] ? at.x + 12 : at.x - 12 - width;
  const x = level ? at.x - width / 2 : beside;
  const y = level ? at.y - height - 14 : at.y - 12;
  tag.style.transform = `translate(${Math.max(x, 4)}px, ${Math.max(y, 4)}px)`;
}

/** True where two frames look different: a body at rest is not drawn again. */
function changed(a: Frame, b: Frame | null): boolean {
  if (!b || a.grabbed !== b.grabbed) return true;
  const parts = ["displacement", "coefficients", "indentation", "contact", "force", "position", "parameters"] as const;
  return parts.some((name) => {
    const [p, q]: ArrayLike<number>[] = [a[name], b[name]];
    return p !== q && (p!.length !== q!.length || Array.from(p!).some((x, i) => Math.abs(x - q![i]!) > SAME));
  });
}
