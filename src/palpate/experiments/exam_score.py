"""The score of an examination, as trainers of clinical examination report it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from palpate.experiments.exam_folders import PastExamination
from palpate.experiments.exam_kinds import HARD
from palpate.experiments.exam_lumps import LumpPlace, place_of
from palpate.experiments.exam_touch import (
    ExamSurface,
    ExamTouch,
    order_of_search,
    pressed_depths,
    read_touch,
    typical_force,
)
from palpate.experiments.examination import Mark, standing_marks
from palpate.format import count, duration, millimetres
from palpate.runtime.touchable import Touchable, load_touchable
from palpate.surrogates import Lump

__all__ = ["NEAR", "ExamScore", "LumpResult", "match_marks", "score_examination", "share_interval"]

NEAR = 0.5  # of the probe's radius, beyond a lump's own, within which a mark finds it
_NORMAL = 1.959964  # quantile of the normal distribution for an interval of 95 %


@dataclass(frozen=True, eq=False)
class LumpResult:
    """A hidden lump and the mark that found it, if one did."""

    lump: Lump
    at: LumpPlace
    depth_limit: float  # m of cover from which it is deep
    mark: Mark | None = None

    @property
    def size(self) -> str:
        """Its diameter in words."""
        return f"⌀ {millimetres(2.0 * self.lump.radius)}"

    @property
    def depth(self) -> str:
        """Class of its depth, deep or shallow."""
        return "deep" if self.at.cover >= self.depth_limit else "shallow"

    @property
    def hardness(self) -> str:
        """Class of its hardness, hard or soft."""
        return "hard" if self.lump.ratio >= HARD else "soft"

    def is_near(self, mark: Mark, radius: float) -> bool:
        """Return whether a mark is near enough to find the lump with a probe of a radius, m."""
        return bool(np.linalg.norm(self.at.above - mark.place) <= self.lump.radius + NEAR * radius)

    @property
    def off(self) -> float:
        """Distance of the mark from the place of the skin above the lump, m; not-a-number where it was missed."""
        return math.nan if self.mark is None else float(np.linalg.norm(self.at.above - self.mark.place))


def match_marks(lumps: Sequence[LumpPlace], radii: Sequence[float], marks: Sequence[Mark]) -> dict[int, Mark]:
    """Return the mark that found each lump, by its index: as many pairs as can be, with the least distance in all.

    A mark finds a lump if it lies within `radii` of the place of the skin above it, m, each for its lump; it finds one.
    """
    from scipy.optimize import linear_sum_assignment

    if not lumps or not marks:
        return {}
    away = np.array([[np.linalg.norm(at.above - mark.place) for mark in marks] for at in lumps])
    far = away > np.asarray(radii)[:, None]
    rows, columns = linear_sum_assignment(np.where(far, 1e3, away))  # 1 km: no sum of distances is as long
    return {int(i): marks[int(j)] for i, j in zip(rows, columns, strict=True) if not far[i, j]}


def share_interval(hits: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a probability with `hits` in `count` trials (Wilson 1927)."""
    if count == 0:
        return 0.0, 1.0
    z2, p = _NORMAL**2 / count, hits / count
    middle, half = p + z2 / 2.0, _NORMAL * math.sqrt(p * (1.0 - p) / count + z2 / (4.0 * count))
    return max(0.0, (middle - half) / (1.0 + z2)), min(1.0, (middle + half) / (1.0 + z2))


@dataclass(frozen=True, eq=False)
class ExamScore:
    """The score of an examination: lumps that were found and missed, and the way of searching."""

    past: PastExamination
    results: tuple[LumpResult, ...]
    marks: tuple[Mark, ...]
    surface: ExamSurface
    touch: ExamTouch
    seconds: float

    @property
    def hits(self) -> int:
        """Number of lumps that were found."""
        return sum(result.mark is not None for result in self.results)

    @property
    def false_alarms(self) -> tuple[Mark, ...]:
        """Marks where there is no lump; a second mark of a lump is none."""
        radius = self.surface.radius
        return tuple(mark for mark in self.marks if not any(r.is_near(mark, radius) for r in self.results))

    @cached_property
    def depths(self) -> np.ndarray:
        """Depth (N,) to which each point of the surface was pressed at most, m."""
        return pressed_depths(self.surface, self.touch)

    @cached_property
    def area_shares(self) -> dict[str, float]:
        """Share of the area that was pressed to each level."""
        return self.surface.shares(self.depths)

    @cached_property
    def order(self) -> Any:
        """The `SearchOrder`."""
        return order_of_search(self.surface, self.touch)

    def right(self, answer: str) -> tuple[int, int]:
        """Return how many marks that found a lump say its ``hardness`` or ``depth`` rightly, and how many say it."""
        said = [r for r in self.results if r.mark is not None and getattr(r.mark, answer)]
        return sum(getattr(r.mark, answer) == getattr(r, answer) for r in said), len(said)

    def by(self, name: str) -> dict[str, tuple[int, int]]:
        """Return found and hidden lumps by their ``size``, ``depth`` or ``hardness``."""
        groups = sorted({getattr(r, name) for r in self.results}, key=lambda group: (len(group), group))
        return {group: _share(r for r in self.results if getattr(r, name) == group) for group in groups}

    @property
    def words(self) -> str:
        """The score in a line."""
        hidden = len(self.results)
        found = f"{self.hits} of {count(hidden, 'lump')} found" if hidden else "no lump was hidden"
        alarms = count(len(self.false_alarms), "false alarm")
        covered = self.area_shares
        return (
            f"{found}, {alarms}, {100 * covered['lightly']:.0f} % of the area pressed, "
            f"{100 * covered['deeply']:.0f} % deeply, {duration(self.seconds)}"
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the score as data for a program."""
        low, middle, high = typical_force(self.touch)
        return {
            "examination": self.past.name,
            "lumps": len(self.results),
            "found": self.hits,
            "sensitivity_interval": list(share_interval(self.hits, len(self.results))),
            "by_size": self.by("size"),
            "by_depth": self.by("depth"),
            "by_hardness": self.by("hardness"),
            "hardness_right": self.right("hardness"),
            "depth_right": self.right("depth"),
            "false_alarms": len(self.false_alarms),
            "covered": self.area_shares,
            "presses": len(self.touch.presses),
            "force_p10": low,
            "force_median": middle,
            "force_p90": high,
            "seconds": self.seconds,
            "seconds_in_contact": self.touch.seconds_in_contact,
            "order": self.order.words,
            "clock_jumps": list(self.past.jumps),
            "notes": list(self.touch.notes),
        }


def _share(results: Iterable[LumpResult]) -> tuple[int, int]:
    hits = [result.mark is not None for result in results]
    return sum(hits), len(hits)


def score_examination(past: PastExamination, body: Touchable | None = None) -> ExamScore:
    """Return the score of an examination on this machine.

    A mark finds a lump within the lump's radius and half the probe's of the place of the skin above it. `body` is the
    one without lumps, by default read from its file; a missing or damaged file is a FileFormatError.
    """
    body = load_touchable(past.body) if body is None else body
    marks = standing_marks(past.events)
    places = [place_of(body, lump) for lump in past.lumps]
    pairs = match_marks(places, [lump.radius + NEAR * body.radius for lump in past.lumps], marks)
    limit = float(past.facts["depth_limit"])
    results = tuple(
        LumpResult(lump, at, limit, pairs.get(k))
        for k, (lump, at) in enumerate(zip(past.lumps, places, strict=True))
    )
    ends = [event["elapsed"] for event in past.events if event["kind"] == "ended"]
    seconds = float(ends[0]) if ends else past.seconds
    return ExamScore(
        past, results, tuple(marks), ExamSurface.of(body), read_touch(past.traces, body), seconds
    )
