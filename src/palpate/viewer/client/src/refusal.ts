// The refusal of a part whose surface bounds no body, and the click that wraps a closed one around it.

import type { Answer } from "./messages";
import { element, input } from "./units";

export class Refusal {
  private wrapping = false;

  constructor(
    words: string,
    size: string,
    private readonly wrap: (size: string) => void,
  ) {
    element("refusal-words").textContent = words;
    input("wrap-size").value = size;
    input("wrap-size").addEventListener("input", () => this.show());
    input("wrap-size").addEventListener("keydown", (e) => {
      if (e.key === "Enter") this.ask();
    });
    element("wrap").addEventListener("click", () => this.ask());
    this.show();
  }

  /** Say why it can't be wrapped so; another size may be tried. */
  answer({ problem }: Answer): void {
    this.wrapping = false;
    element("wrap-problem").textContent = problem;
    element("wrap-problem").hidden = !problem;
    input("wrap-size").setAttribute("aria-invalid", String(problem !== ""));
    this.show();
  }

  private ask(): void {
    if (this.wrapping) return;
    this.wrapping = true;
    element("wrap-problem").hidden = true;
    this.show();
    this.wrap(input("wrap-size").value);
  }

  private show(): void {
    const button = element<HTMLButtonElement>("wrap");
    button.disabled = this.wrapping;
    button.textContent = this.wrapping ? "wrapping, for a minute or so …" : `wrap it (${input("wrap-size").value.trim()})`;
  }
}
