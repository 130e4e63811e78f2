"""Output of the commands: progress and errors to stderr, results to stdout, as text or as one JSON object.

Names of files and of columns, and messages of solvers may hold anything. Here they become plain texts, whose characters
are shown and not obeyed by the terminal.
"""

from __future__ import annotations

import contextlib
import json
import sys
import threading
import time
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from palpate.errors import PalpateError
from palpate.input_files import plain_text
from palpate.output_files import json_data

__all__ = ["Console", "advice_in_words"]

PATIENCE, AGAIN = 2.0, 30.0  # s after which a user hears what takes so long, and then hears of it again


@contextlib.contextmanager
def advice_in_words() -> Iterator[None]:
    """Show warnings of palpate's own as what they say, each once, without the line of code that led to it."""
    usual, shown = warnings.showwarning, set[str]()

    def show(message: Warning | str, category: type[Warning], *place: Any) -> None:
        if category.__module__.partition(".")[0] != "palpate":
            usual(message, category, *place)
        elif str(message) not in shown:
            shown.add(str(message))
            print(f"warning: {plain_text(str(message))}", file=sys.stderr, flush=True)  # noqa: T201

    warnings.showwarning = show  # type: ignore[assignment]
    try:
        yield
    finally:
        warnings.showwarning = usual


@dataclass(frozen=True)
class Console:
    """Printer of a command."""

    as_json: bool = False  # results as one JSON object on stdout, and no progress
    verbose: bool = False  # all figures, where a verdict is printed else

    def say(self, text: str) -> None:
        """Print one line of progress to stderr."""
        if not self.as_json:
            print(plain_text(text), file=sys.stderr, flush=True)  # noqa: T201

    @contextlib.contextmanager
    def patience(self, doing: str) -> Iterator[None]:
        """Say what is being done once it has taken two seconds, and every half minute how long it has taken."""
        began, done = time.monotonic(), threading.Event()

        def tell() -> None:
            wait = PATIENCE
            while not done.wait(wait):
                taken = time.monotonic() - began
                self.say(f"{doing} …" if wait == PATIENCE else f"{doing} … {taken:.0f} s so far")
                wait = AGAIN

        thread = threading.Thread(target=tell, daemon=True)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join(1.0)  # not without an end: Ctrl-C in `set` may leave its lock taken

    def result(self, text: str, content: Mapping[str, Any]) -> None:
        """Print the result of a command to stdout."""
        # not-a-number is no JSON: it becomes null
        shown = json.dumps(json_data(content), indent=2) if self.as_json else plain_text(text)
        print(shown, flush=True)  # noqa: T201

    def error(self, error: PalpateError) -> None:
        """Print an error: what happened, why, and what to do."""
        if self.as_json:
            parts = {"kind": type(error).__name__, "what": error.what, "why": error.why, "fix": error.fix}
            print(json.dumps({"error": parts}, indent=2), flush=True)  # noqa: T201
        from rich.console import Console as Rich
        from rich.text import Text

        rich = Rich(stderr=True, highlight=False, soft_wrap=True)
        rich.print(Text.assemble(("error: ", "bold red"), (plain_text(error.what), "bold")))
        for line in filter(None, (error.why, error.fix)):
            rich.print(Text(plain_text(line)))
