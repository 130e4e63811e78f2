"""Examinations on this machine: a folder each in the user's data directory, never replaced.

A folder holds ``events.jsonl`` (`append_record`: the lumps, each mark, interruptions, the end), ``felt.palpate``, the
body with the lumps, and ``touch-1.trace`` and so on, every tick of the loop up to an interruption. The body without
lumps lies beside the folders in ``bodies``, once for all its examinations, under its checksum.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from palpate.errors import PalpateError, UsageError
from palpate.experiments.append_record import read_events
from palpate.files import system_errors, writing
from palpate.surrogates import Lump

__all__ = [
    "EVENTS",
    "FELT",
    "PastExamination",
    "exam_directory",
    "keep_body",
    "make_folder",
    "past_examinations",
]

EVENTS, FELT = "events.jsonl", "felt.palpate"


def exam_directory() -> Path:
    """Return the folder of this user's examinations: of the environment's data directory, or the system's usual one."""
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Application Support"
    else:
        base = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    return base / "palpate" / "examinations"


def make_folder(directory: Path, name: str, now: float) -> Path:
    """Make a new folder for an examination of a kind of that name, begun at a time (s since 1970), and return it.

    A clock that was set back can't make it meet an earlier one: the name ends at random.
    """
    name = re.sub(r"[^\w-]+", "-", name).strip("-") or "body"  # it stands in addresses too
    stem = f"{name}-{datetime.fromtimestamp(now):%Y%m%d-%H%M%S}-{secrets.token_hex(3)}"
    folder = directory / stem
    with system_errors(f"The folder {folder} of the examination could not be made."):
        folder.mkdir(parents=True)
    return folder


def keep_body(directory: Path, body: Path) -> Path:
    """Return the file of a body beside the examinations, copied there where it is not yet."""
    with system_errors(f"The body {body} could not be read."):
        mark = hashlib.sha256(body.read_bytes()).hexdigest()[:16]
    kept = directory / "bodies" / f"{mark}.palpate"
    if not kept.is_file():
        with system_errors(f"The body {body} could not be kept in {directory}."):
            kept.parent.mkdir(parents=True, exist_ok=True)
            with writing(kept) as part:
                shutil.copyfile(body, part)
    return kept


@dataclass(frozen=True)
class PastExamination:
    """An examination on this machine, as its record tells of it."""

    folder: Path
    events: tuple[dict[str, Any], ...]

    @classmethod
    def read(cls, folder: Path) -> PastExamination:
        """Read it from its folder; one without an examination is a UsageError."""
        try:
            events = read_events(folder / EVENTS)
        except PalpateError as error:
            raise UsageError(f"{folder.name} holds no examination.", why=error.what) from error
        if not events or events[0]["kind"] != "begun":
            raise UsageError(
                f"{folder.name} holds no examination.",
                why="Its record does not say what was examined: it was killed as it began.",
            )
        return cls(folder, tuple(events))

    @property
    def name(self) -> str:
        """The name of its folder, by which it is asked for."""
        return self.folder.name

    @property
    def facts(self) -> dict[str, Any]:
        """The first event: kind, title, body, lumps, seed, device."""
        return self.events[0]

    @property
    def lumps(self) -> tuple[Lump, ...]:
        """The lumps that were hidden."""
        return tuple(Lump((x, y, z), radius, ratio) for x, y, z, radius, ratio in self.facts["lumps"])

    @property
    def has_end(self) -> bool:
        """True where the person has ended it; otherwise it can go on."""
        return any(event["kind"] == "ended" for event in self.events)

    @property
    def seconds(self) -> float:
        """Time that it took, without interruptions, s."""
        return float(self.events[-1]["elapsed"])

    @property
    def body(self) -> Path:
        """The file of the body without lumps."""
        return self.folder.parent / "bodies" / str(self.facts["body"])

    @property
    def traces(self) -> tuple[Path, ...]:
        """The recorded touches, in the order of time."""
        return tuple(sorted(self.folder.glob("touch-*.trace"), key=_number))

    @property
    def next_trace(self) -> Path:
        """A new file for the touch from now on, after all that are there."""
        return self.folder / f"touch-{max((_number(path) for path in self.traces), default=0) + 1}.trace"

    @property
    def jumps(self) -> tuple[float, ...]:
        """Seconds by which the machine's clock jumped meanwhile, each time."""
        return tuple(float(event["seconds"]) for event in self.events if event["kind"] == "clock")

    @property
    def words(self) -> str:
        """The examination in a line."""
        said = [event["words"] for event in self.events if event["kind"] == "scored"]
        return said[-1] if said else ("not scored" if self.has_end else "interrupted")


def _number(trace: Path) -> int:
    """Return the number of a recorded touch."""
    digits = trace.stem.removeprefix("touch-")
    return int(digits) if digits.isdecimal() else 0


def past_examinations(directory: Path, only: Sequence[str] = ()) -> list[PastExamination]:
    """Return the examinations of a directory, the latest first; of some kinds only where these are named."""
    past = []
    for events in directory.glob(f"*/{EVENTS}"):
        try:
            exam = PastExamination.read(events.parent)
        except UsageError:
            continue
        if not only or exam.facts["exam"] in only:
            past.append(exam)
    return sorted(past, key=lambda exam: str(exam.facts["at"]), reverse=True)
