// The button that records the touch: it asks the server, and shows what the server says.

import type { Recording } from "./messages";
import { element, fixed } from "./units";

export class Recorder {
  private active = false;

  constructor(want: (wanted: boolean) => void) {
    element("record").addEventListener("click", () => want(!this.active));
  }

  show(news: Recording): void {
    this.press(news.active);
    const lost = news.lost ? `, ${news.lost} ticks lost` : "";
    const written = `${news.file}: ${fixed(news.seconds, 0)} s, ${fixed(news.size / 1e6, 1)} MB${lost}`;
    const words = element("recording");
    words.textContent = [news.file ? written : "", news.problem].filter(Boolean).join(". ");
    words.dataset["tone"] = news.problem ? "bad" : "";
  }

  /** The server ends its recording with itself, and says so when it is back. */
  lost(): void {
    this.press(false);
  }

  private press(active: boolean): void {
    this.active = active;
    const button = element("record");
    button.setAttribute("aria-pressed", String(active));
    button.textContent = active ? "stop recording" : "record";
  }
}
