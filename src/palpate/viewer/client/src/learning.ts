// How far solves and learning are: phase, time left, error against unseen solves, target; and the wish that they end.

import type { LearningProgress } from "./messages";
import { element, share, square, tidy } from "./units";

const TOAST = 6000; // ms that an improvement is shown on the picture

export class Learning {
  private latest: LearningProgress | null = null;
  private since = 0; // ms, when it came
  private trial = ""; // words on the latest body beside the one before it
  private ended = false;

  constructor(enough: () => void) {
    element("enough").addEventListener("click", () => {
      element<HTMLButtonElement>("enough").disabled = true;
      enough();
    });
    setInterval(() => this.clock(), 500);
  }

  hear(news: LearningProgress): void {
    [this.latest, this.since] = [news, performance.now()];
    document.documentElement.dataset["learning"] = "";
    element("phase").textContent = news.phase;
    element("solves").textContent = String(news.solves);
    element("error-target").textContent = share(news.target);
    element("error").classList.toggle("unknown", news.error_p95 === null);
    element("report-link").hidden = !news.report;
    this.errors();
    this.areas();
    this.clock();
  }

  /** How much of what was to be touched is trained. */
  private areas(): void {
    const [painted, trained] = [this.latest?.painted_area ?? null, this.latest?.trained_area ?? null];
    const line = element("trained-area");
    line.hidden = painted === null || trained === null;
    if (painted === null || trained === null) return;
    line.textContent = `${square(trained)} of ${square(painted)} that were to be touched are trained`;
  }

  /** No more solves come. */
  end(words: string): void {
    this.ended = true;
    element("enough").hidden = true;
    if (words) element("phase").textContent = words;
    element("work-share").hidden = true;
    this.clock();
  }

  private errors(): void {
    const { latest } = this;
    if (!latest) return;
    if (latest.error_p95 === null) {
      element("error-p95").textContent = element("error-median").textContent = "–";
      element("improved").textContent = latest.trial || "not checked yet"; // the error of the one before
      return;
    }
    const error = latest.error_p95;
    element("error-p95").textContent = tidy(100 * error, 2);
    element("error-median").textContent = latest.error_median === null ? "–" : share(latest.error_median);
    // errors alone would not tell: between two bodies they change with the solves that judge
    element("improved").textContent = latest.trial;
    if (latest.trial && latest.trial !== this.trial) {
      document.documentElement.dataset["improved"] = latest.trial; // for programs that read the page
      toast(latest.trial);
    }
    this.trial = latest.trial;
  }

  /** The time that has passed, and the time that is left, both going on between two messages. */
  private clock(): void {
    const { latest } = this;
    if (!latest) return;
    const since = this.ended ? 0 : (performance.now() - this.since) / 1000;
    const left = latest.remaining === null || this.ended ? null : Math.max(0, latest.remaining - since);
    element("remaining").textContent = left === null ? "" : left < 1 ? ", a little longer" : `, about ${roughly(left)}`;
    const rest = latest.remaining === null ? 0 : Math.min(since / Math.max(latest.remaining, 1), 1);
    const bar = element<HTMLProgressElement>("work-share");
    if (latest.remaining === null && latest.share === 0) bar.removeAttribute("value"); // at work, for an unknown time
    else bar.value = latest.share + (0.98 - latest.share) * rest;
    const passed = latest.seconds + since;
    const [minutes, seconds] = [Math.floor(passed / 60), Math.floor(passed % 60)];
    element("elapsed").textContent = `${minutes ? `${minutes} min ` : ""}${seconds} s since the start`;
  }
}

/** A time as one says it: 4 s, 20 s, 2 min. */
function roughly(seconds: number): string {
  if (seconds < 10) return `${Math.ceil(seconds)} s`;
  if (seconds < 90) return `${5 * Math.round(seconds / 5)} s`;
  return `${Math.round(seconds / 60)} min`;
}

let fading = 0;

/** Say something on the picture for some seconds. */
export function toast(words: string): void {
  const box = element("toast");
  box.textContent = words;
  box.hidden = false;
  clearTimeout(fading);
  fading = window.setTimeout(() => (box.hidden = true), TOAST);
}
