"""One examination while it is taken: marks, time, interruptions, its end; each is on the disk before it is answered."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from palpate.errors import UsageError
from palpate.experiments.append_record import AppendRecord, Clocks
from palpate.experiments.exam_folders import EVENTS, FELT, PastExamination, keep_body, make_folder
from palpate.experiments.exam_kinds import ExamKind
from palpate.surrogates import Lump

__all__ = ["ANSWERS", "Examination", "Mark", "standing_marks"]

ANSWERS = {"hardness": ("hard", "soft"), "depth": ("deep", "shallow")}
MOST_MARKS = 50  # in one examination: more is no finding


@dataclass(frozen=True)
class Mark:
    """A place that a person has marked: number, place on the skin at rest (m), and what was said of it, if anything."""

    number: int
    place: tuple[float, float, float]
    hardness: str = ""
    depth: str = ""


class Examination:
    """An examination in its folder; a context manager that lets go of its record.

    `begin` makes one, `resume` goes on with one that was interrupted; one that has ended, or that another process
    holds, is a UsageError. `marks` are those that stand now.
    """

    def __init__(self, folder: Path, clocks: Clocks | None = None) -> None:
        self.folder = folder
        self.record = AppendRecord(folder / EVENTS, clocks)
        self.marks = {mark.number: mark for mark in standing_marks(self.record.events)}

    @classmethod
    def begin(
        cls,
        directory: Path,
        kind: ExamKind,
        body: Path,
        lumps: Sequence[Lump],
        *,
        clocks: Clocks | None = None,
        **facts: Any,
    ) -> Self:
        """Begin an examination in a new folder of a directory, with lumps hidden in a body, whose file has none.

        `facts` are what else its first event says: seed, device.
        """
        clocks = clocks or Clocks()
        kept = keep_body(directory, body)
        exam = cls(make_folder(directory, kind.name, clocks.wall()), clocks)
        exam.record.add(
            "begun",
            exam=kind.name,
            title=kind.title,
            depth_limit=kind.depth_limit,
            body=kept.name,
            lumps=[[*lump.place, lump.radius, lump.ratio] for lump in lumps],
            **facts,
        )
        return exam

    @classmethod
    def resume(cls, folder: Path, clocks: Clocks | None = None) -> Self:
        """Go on with an examination that was interrupted."""
        exam = cls(folder, clocks)
        if exam.past.has_end:
            exam.close()
            raise UsageError(
                f"{folder.name} has ended.", why="Its score is known.", fix="Begin a new examination."
            )
        exam.record.add("resumed")
        return exam

    @property
    def past(self) -> PastExamination:
        """The examination as its record tells of it so far."""
        return PastExamination(self.folder, tuple(self.record.events))

    @property
    def body_file(self) -> Path:
        """The file of the body with its lumps, which the hand feels."""
        return self.folder / FELT

    def mark(self, place: Sequence[float]) -> Mark:
        """Mark a place (3,) on the skin, m."""
        if len(place) != 3 or not all(math.isfinite(v) for v in place):
            raise UsageError("A mark needs a place.", fix="Press the body where the mark shall be.")
        if len(self.marks) >= MOST_MARKS:
            raise UsageError(f"{MOST_MARKS} places are marked already.", fix="Remove a mark first.")
        numbers = [event["number"] for event in self.record.events if event["kind"] == "marked"]
        x, y, z = map(float, place)
        mark = Mark(max(numbers, default=0) + 1, (x, y, z))
        self._add("marked", number=mark.number, place=list(mark.place))
        return mark

    def answer(self, number: int, **answers: str) -> None:
        """Say of a mark whether it is ``hard`` or ``soft`` (`hardness`), ``deep`` or ``shallow`` (`depth`)."""
        self._require(number)
        for name, value in answers.items():
            if value not in (*ANSWERS.get(name, ()), ""):
                raise UsageError(f"{name} = {value!r} is no answer.", fix=f"Answers are {ANSWERS}.")
        self._add("answered", number=number, **answers)

    def remove(self, number: int) -> None:
        """Remove a mark; the record keeps that it was there."""
        self._require(number)
        self._add("removed", number=number)

    def end(self) -> None:
        """End the examination: nothing more is marked."""
        self.record.add("ended")

    def _require(self, number: int) -> None:
        if number not in self.marks:
            raise UsageError(f"There is no mark {number}.", fix=f"Marks are {list(self.marks)}.")

    def _add(self, kind: str, **facts: Any) -> None:
        _follow(self.marks, self.record.add(kind, **facts))

    def close(self) -> None:
        """Let go of the record; harmless when repeated."""
        self.record.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def standing_marks(events: Iterable[Mapping[str, Any]]) -> list[Mark]:
    """Return the marks that stand after the events of a record."""
    marks: dict[int, Mark] = {}
    for event in events:
        _follow(marks, event)
    return list(marks.values())


def _follow(marks: dict[int, Mark], event: Mapping[str, Any]) -> None:
    """Take an event into the marks that stand."""
    number = event.get("number", 0)
    if event["kind"] == "marked":
        x, y, z = event["place"]
        marks[number] = Mark(number, (x, y, z))
    elif event["kind"] == "answered":
        said = {name: event[name] for name in ANSWERS if name in event}
        marks[number] = replace(marks[number], **said)
    elif event["kind"] == "removed":
        del marks[number]
