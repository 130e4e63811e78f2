// Words of a page: flags for all that is out of the ordinary, the banner, the status.

import { free } from "./hand_words";
import { Hold, Loop } from "./messages";
import type { Frame, Hello, Notice } from "./messages";
import { capital, element, tidy } from "./units";

const SLOW = 0.9; // of the rate aimed at

/** Words of a kind of body for where the hand is. */
export interface Places {
  inside: string;
  outside: string;
}

export interface Flag {
  id: string;
  tone: "good" | "calm" | "warn" | "bad";
  words: string;
}

/** The flags of one frame, the worst first. */
export function flags(frame: Frame, hello: Hello, places: Places): Flag[] {
  const list = [...failures(frame, hello), ...limits(frame, hello, places)];
  if (list.length === 0) list.push(ordinary(frame, places));
  if (hello.device) {
    list.push({ id: "device", tone: "calm", words: `${capital(hello.device)} moves the hand; the page shows it.` });
  } else if (frame.hold === Hold.ANOTHER) {
    list.push({ id: "watching", tone: "calm", words: "Another page holds the hand; this one watches." });
  }
  if (frame.faults > 0 && frame.fault === 0) {
    const last = hello.faults[frame.last_fault] ?? `code ${frame.last_fault}`;
    list.push({ id: "faults", tone: "calm", words: `Faults so far: ${frame.faults}, the last one: ${last}.` });
  }
  return list;
}

function failures(frame: Frame, hello: Hello): Flag[] {
  if (frame.loop === Loop.ENDED) {
    return [{ id: "ended", tone: "bad", words: "The real-time process has ended. The force is zero." }];
  }
  if (frame.loop === Loop.FROZEN) {
    return [{ id: "frozen", tone: "bad", words: "The real-time process stands still. The force is zero." }];
  }
  const list: Flag[] = [];
  if (frame.fault !== 0) {
    const words = hello.faults[frame.fault] ?? `code ${frame.fault}`;
    list.push({ id: "fault", tone: "bad", words: `Fault: ${words}. The force is zero.` });
  }
  if (frame.stalled && frame.grabbed) {
    list.push({
      id: "stalled",
      tone: "warn",
      words: "Nothing was heard of the hand for too long. The force is zero until it is back.",
    });
  }
  return list;
}

function limits(frame: Frame, hello: Hello, places: Places): Flag[] {
  const list: Flag[] = [];
  if (!frame.inside) {
    list.push({ id: "outside", tone: "warn", words: places.outside });
  }
  if (frame.clamped) {
    list.push({ id: "clamped", tone: "warn", words: `Force limited to ${tidy(hello.max_force)} N.` });
  }
  if (!frame.resting && frame.rate < SLOW * hello.rate && frame.tick > hello.rate) {
    const words = `The real-time loop reaches only ${tidy(frame.rate)} of ${tidy(hello.rate)} ticks per second.`;
    list.push({ id: "slow", tone: "warn", words });
  }
  return list;
}

function ordinary(frame: Frame, places: Places): Flag {
  if (!frame.grabbed) return { id: "free", tone: "calm", words: free() };
  return { id: "inside", tone: "good", words: places.inside };
}

export function say(words: string, tone: "bad" | "calm"): void {
  const banner = element("banner");
  if (banner.textContent !== words) banner.textContent = words; // read aloud once
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

/** The status in few words; `without`: there is no force, for a reason that is shown elsewhere. */
export function describe(frame: Frame, without: boolean): void {
  if (frame.loop === Loop.ENDED) status("ended", "real-time process ended");
  else if (frame.loop === Loop.FROZEN) status("warn", "real-time process stands still");
  else if (frame.hold === Hold.ANOTHER) status("warn", "watching");
  else if (frame.stalled && frame.grabbed) status("warn", "no word from the hand");
  else if (without) status("warn", "no force");
  else status("live", frame.hold === Hold.YOURS ? "holding" : "live");
}
