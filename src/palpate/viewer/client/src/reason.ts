// Words for a force that is not there: why now, why it dropped a moment ago, and the button that ends all force.

import type { Feel, Reason } from "./messages";
import { capital, element } from "./units";

const VISIBLE = 8; // s for which the reason of a drop stays when the force has come back

export class Drops {
  private stopped = false;
  private told: Reason = { now: "", stopped: false, dropped: "", ago: Infinity };
  private at = 0; // ms, when it was told

  constructor(private readonly want: (stop: boolean) => void) {
    element("stop").addEventListener("click", () => want(!this.stopped));
    element("resume").addEventListener("click", () => want(false));
  }

  /** True while there is no force, for a reason. */
  get without(): boolean {
    return this.told.now !== "";
  }

  /** End all force. */
  stop(): void {
    this.want(true);
  }

  hear(news: Reason): void {
    [this.told, this.at] = [news, performance.now()];
    this.stopped = news.stopped;
    const button = element("stop");
    button.textContent = news.stopped ? "resume" : "stop";
    button.setAttribute("aria-pressed", String(news.stopped));
    element("resume").hidden = !news.stopped;
    this.show();
  }

  /** Show what is to be said now; called for every picture. */
  show(): void {
    const { now, dropped, ago } = this.told;
    const since = ago + (performance.now() - this.at) / 1000;
    const lately = dropped !== "" && since < VISIBLE;
    const words = now || (lately ? `The force was zero for a moment: ${dropped}.` : "");
    const box = element("reason");
    if (element("reason-words").textContent !== words) element("reason-words").textContent = words;
    box.dataset["tone"] = now ? "bad" : "calm";
    box.hidden = words === "";
  }

  lost(): void {
    this.hear({ now: "", stopped: false, dropped: "", ago: Infinity });
  }
}

/** Say that a body is softened for its device, or would be. */
export function feel(news: Feel): void {
  const box = element("feel");
  box.hidden = news.words === "";
  const stiff = news.override ? "Not softened, as asked: it may hum or oscillate." : "Softened for this device.";
  const head = news.body > news.limit ? stiff : "Caution.";
  element("feel-head").textContent = head;
  element("feel-words").textContent = capital(news.words);
  const data = { body: news.body, limit: news.limit, felt: news.felt };
  for (const [name, value] of Object.entries(data)) {
    element(`feel-${name}`).textContent = value.toFixed(0);
  }
}
