// What is out of the ordinary, in plain words.

import { Hold, Loop } from "./messages";
import type { Frame, Hello } from "./messages";
import { tidy } from "./units";

const SLOW = 0.9; // of the rate aimed at

export interface Flag {
  id: string;
  tone: "good" | "calm" | "warn" | "bad";
  words: string;
}

/** The flags of one frame, the worst first. */
export function flags(frame: Frame, hello: Hello): Flag[] {
  const found = [...failures(frame, hello), ...limits(frame, hello)];
  if (found.length === 0) found.push(ordinary(frame));
  if (frame.hold === Hold.ANOTHER) {
    found.push({ id: "watching", tone: "calm", words: "Another page holds the hand; this one watches." });
  }
  if (frame.faults > 0 && frame.fault === 0) {
    const last = hello.faults[frame.last_fault] ?? `code ${frame.last_fault}`;
    found.push({ id: "faults", tone: "calm", words: `Faults so far: ${frame.faults}, the last one: ${last}.` });
  }
  return found;
}

function failures(frame: Frame, hello: Hello): Flag[] {
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

function limits(frame: Frame, hello: Hello): Flag[] {
  const found: Flag[] = [];
  if (!frame.inside) {
    found.push({
      id: "outside",
      tone: "warn",
      words: "Outside the trained range: the force is the one at its edge.",
    });
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

function ordinary(frame: Frame): Flag {
  if (!frame.grabbed) return { id: "free", tone: "calm", words: "Nobody holds the body. Drag the ball at its tip." };
  return { id: "inside", tone: "good", words: "Within what the network was trained on." };
}
