"""The program: the command line with its exit codes, and what is kept where Ctrl-C or SIGTERM ends it."""

from __future__ import annotations

import re
import signal
import sys
from pathlib import Path

import typer

from palpate.checks import did_you_mean
from palpate.cli.app import STUDY, app
from palpate.cli.console import Console, advice_in_words
from palpate.errors import AccuracyError, PalpateError
from palpate.files import explain_system_error
from palpate.processes import end_by_sigterm, interrupts, note_interrupt

__all__ = ["KEPT", "kept_after", "main", "near_file"]

INTERRUPTED = 128 + signal.SIGINT  # the shell's code of a program that Ctrl-C has ended
TERMINATED = 128 + signal.SIGTERM  # and of one that was asked to end

_OFFERED = 3  # studies of a folder that are offered, at most
_ALIKE = 0.75  # how alike the name of a file must be to be offered in place of one that is not there

_GOES_ON = "What is solved is kept: the same command goes on."
_AS_BEFORE = "Nothing was changed."
_WHOLE = "Files that are written are whole; the file being written is left out."

KEPT = {
    "ask": _AS_BEFORE,
    "benchmark": _WHOLE,
    "card": _WHOLE,
    "correct": "The model is as it was, and no corrected one is written; what a sensor sent is not kept.",
    "dataset export": _WHOLE,
    "dataset import": "The files read are as they were; a dataset is written whole or not at all.",
    "demo": _GOES_ON,
    "devices": _AS_BEFORE,
    "devices simulate": "The simulated device is gone; a library that was compiled stays.",
    "doctor": _AS_BEFORE,
    "exam": "What was pressed and marked is kept: the page's list goes on with that examination.",
    "experiment": _WHOLE,
    "experiment plan": _GOES_ON,
    "experiment forget": "What is not forgotten yet is as it was: the same command goes on.",
    "experiment run": "All trials that were answered are kept: the same command goes on with the next one.",
    "export": _WHOLE,
    "fit": "The table is as it was, and no model is written.",
    "init": _WHOLE,
    "learn": "The solves are kept, and a model that was there: the same command learns from the beginning.",
    "material fit": "The tables are as they were, and nothing is written.",
    "replay": "The recorded touch is as it was, and none is written.",
    "run": "The report is of the ticks until then, and so is a recording.",
    "schema": _AS_BEFORE,
    "serve-umbridge": "The model is as it was.",
    "show": "The solved bodies are as they were.",
    "sweep": _GOES_ON,
    "touch": "What was begun is kept beside the part: the same command goes on.",
    "trace": _WHOLE,
    "validate": "The model and its solves are as they were; the same command judges again.",
    "view": "The model is as it was.",
}
"""What is kept where a command is interrupted, by the command or its group."""


def kept_after(words: list[str]) -> str:
    """Return the sentence on what is kept after an interruption of the command that these arguments call."""
    command, path = typer.main.get_command(app), list[str]()
    for word in words:
        child = getattr(command, "commands", {}).get(word)
        if child is not None:
            command = child
            path.append(word)
    names = (" ".join(path[:length]) for length in range(len(path), 0, -1))
    return next((KEPT[name] for name in names if name in KEPT), "")


def near_file(words: list[str], what: str) -> str:
    """Return a question that offers the file whose name is near, where an error is of a file that is not there.

    Where it is the study that a command takes by default, the studies of this folder are offered.
    """
    if what.startswith(f"{STUDY} ") and not STUDY.exists() and str(STUDY) not in words:
        studies = [str(file) for file in sorted(Path().glob("*.toml")) if _is_study(file)]
        return f"Did you mean {' or '.join(studies[:_OFFERED])}?" if studies else ""
    missing = [
        Path(word)
        for word in words
        if not word.startswith("-") and word in what and Path(word).suffix and not Path(word).exists()
    ]
    if not missing or not missing[0].parent.is_dir():
        return ""
    path = missing[0]
    beside = [file.name for file in path.parent.iterdir()]
    return did_you_mean(path.name, beside, shown=lambda name: str(path.with_name(name)), cutoff=_ALIKE)


def _is_study(file: Path) -> bool:
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return False
    return re.search(r"^\[(body|interaction)\]", text, re.MULTILINE) is not None


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; an error that palpate foresaw ends with its exit code and without a traceback."""
    words = sys.argv[1:] if arguments is None else arguments
    # a program that calls this keeps its own way to end
    if arguments is None:
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, end_by_sigterm)  # temporary folders are removed on the way
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, note_interrupt)
    try:
        with advice_in_words():
            app(words, standalone_mode=True)
    except AccuracyError as error:
        Console().error(error)  # the figures have been printed already, as JSON where asked
        sys.exit(error.exit_code)
    except PalpateError as error:
        near = near_file(words, error.what)
        known = type(error)(error.what, why=error.why, fix=" ".join(filter(None, (near, error.fix))))
        Console(as_json="--json" in words).error(known)
        sys.exit(error.exit_code)
    except (OSError, MemoryError) as error:  # 1, which Python would end with, says that a target was missed
        known = explain_system_error(f"palpate {words[0] if words else ''} could not go on.", error)
        Console(as_json="--json" in words).error(known)
        sys.exit(known.exit_code)
    except SystemExit as end:
        # Typer ends by Ctrl-C without a word; pages and loops end in good order, as if nothing had happened
        code = end.code or next((128 + number for number in interrupts()), 0)
        if code in (INTERRUPTED, TERMINATED):
            way = "Interrupted" if code == INTERRUPTED else "Ended from outside (SIGTERM)"
            Console().say(f"\n{way}. {kept_after(words)}".rstrip())
        sys.exit(code)
