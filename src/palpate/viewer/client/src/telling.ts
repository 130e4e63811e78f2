// What a page says in words beside the numbers: its banner and its status.

import { Hold, Loop } from "./messages";
import type { Notice } from "./messages";
import type { Beat } from "./flags";
import { element } from "./readings";

export function say(words: string, tone: "bad" | "calm"): void {
  const banner = element("banner");
  banner.textContent = words;
  banner.dataset["tone"] = tone;
  banner.hidden = false;
}

export function warn(notice: Notice): void {
  say(`${notice.what} ${notice.fix}`, "bad");
}

export function status(state: string, words: string): void {
  const pill = element("status");
  if (pill.textContent === words) return;
  pill.dataset["state"] = state;
  pill.textContent = words;
}

export function describe(frame: Beat): void {
  if (frame.loop === Loop.ENDED) status("ended", "real-time process ended");
  else if (frame.loop === Loop.FROZEN) status("warn", "real-time process stands still");
  else if (frame.hold === Hold.ANOTHER) status("warn", "watching");
  else if (frame.stalled && frame.grabbed) status("warn", "no word from the hand");
  else status("live", frame.grabbed ? "holding" : "live");
}
