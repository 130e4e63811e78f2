// What is out of the ordinary, in plain words.

import { Hold, Loop } from "./messages";
import type { Frame } from "./messages";
import { tidy } from "./units";

const SLOW = 0.9; // of the rate aimed at

/** What every picture tells of the loop, whatever the body. */
export type Beat = Omit<Frame, "contact" | "displacement">;

/** What is told once of the loop. */
export interface LoopFacts {
  faults: string[];
  max_force: number;
  rate: number;
}

/** How a kind of body says where the hand is. */
export interface Places {
  free: string;
  inside: string;
  outside: string;
}

export interface Flag {
  id: string;
  tone: "good" | "calm" | "warn" | "bad";
  words: string;
}

/** The flags of one frame, the worst first. */
export function flags(frame: Beat, hello: LoopFacts, places: Places): Flag[] {
  const found = [...failures(frame, hello), ...limits(frame, hello, places)];
  if (found.length === 0) found.push(ordinary(frame, places));
  if (frame.hold === Hold.ANOTHER) {
    found.push({ id: "watching", tone: "calm", words: "Another page holds the hand; this one watches." });
  }
  if (frame.faults > 0 && frame.fault === 0) {
    const last = hello.faults[frame.last_fault] ?? `code ${frame.last_fault}`;
    found.push({ id: "faults", tone: "calm", words: `Faults so far: ${frame.faults}, the last one: ${last}.` });
  }
  return found;
}

function failures(frame: Beat, hello: LoopFacts): Flag[] {
  if (frame.loop === Loop.ENDED) {
    return [{ id: "ended", tone: "bad", words: "The real-time process has ended. The force is zero." }];
  }
  if (frame.loop === Loop.FROZEN) {
    return [{ id: "frozen", tone: "bad", words: "The real-time process stands still. The force is zero." }];
  }
  const found: Flag[] = [];
  if (frame.fault !== 0) {
    const words = hello.faults[frame.fault] ?? `code ${frame.fault}`;
    found.push({ id: "fault", tone: "bad", words: `Fault: ${words}. The force is zero.` });
  }
  if (frame.stalled && frame.grabbed) {
    found.push({
      id: "stalled",
      tone: "warn",
      words: "Nothing was heard of the hand for too long. The force is zero until it is back.",
    });
  }
  return found;
}

function limits(frame: Beat, hello: LoopFacts, places: Places): Flag[] {
  const found: Flag[] = [];
  if (!frame.inside) {
    found.push({ id: "outside", tone: "warn", words: places.outside });
  }
  if (frame.clamped) {
    found.push({ id: "clamped", tone: "warn", words: `Force limited to ${tidy(hello.max_force)} N.` });
  }
  if (frame.rate < SLOW * hello.rate && frame.tick > hello.rate) {
    const words = `The real-time loop reaches only ${tidy(frame.rate)} of ${tidy(hello.rate)} ticks per second.`;
    found.push({ id: "slow", tone: "warn", words });
  }
  return found;
}

function ordinary(frame: Beat, places: Places): Flag {
  if (!frame.grabbed) return { id: "free", tone: "calm", words: places.free };
  return { id: "inside", tone: "good", words: places.inside };
}
