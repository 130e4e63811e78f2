// A page whose server is gone, or was started again: then the page's token is of no use, and another address is the way in.

import { say, status } from "./flags";

const MOVED = "palpate was started again. Open the new address that its terminal shows.";

let moved = false; // as far as is known

/** Say that the server is gone, or that it was started again since this page was opened. */
export function lose(words: string): void {
  tell(words);
  void refuses().then((refused) => {
    if (refused === moved) return;
    moved = refused;
    tell(words);
  });
}

function tell(words: string): void {
  status("lost", moved ? "started again" : "disconnected, trying again");
  say(moved ? MOVED : words, "bad");
}

/** True where a server answers that this page's token is not its own. */
async function refuses(): Promise<boolean> {
  try {
    return (await fetch("./", { method: "HEAD", cache: "no-store" })).status === 401;
  } catch {
    return false; // nobody answers
  }
}
