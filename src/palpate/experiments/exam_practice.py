"""Practice before an examination: each mark is answered at once, and the lumps can be shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.experiments.exam_kinds import ExamKind
from palpate.experiments.exam_lumps import place_of
from palpate.experiments.exam_score import NEAR, LumpResult, match_marks
from palpate.experiments.examination import Mark
from palpate.format import millimetres
from palpate.runtime.touchable import Touchable
from palpate.surrogates import Lump

__all__ = ["Practice"]


class Practice:
    """A practice on a body with hidden lumps: `marks` by number, and whether the lumps are `shown`. None is kept."""

    def __init__(self, kind: ExamKind, body: Touchable, lumps: Sequence[Lump]) -> None:
        self.marks: dict[int, Mark] = {}
        self.shown = False
        self._count, self._radius = 0, body.radius
        self._results = [LumpResult(lump, place_of(body, lump), kind.depth_limit) for lump in lumps]

    def mark(self, place: Sequence[float]) -> Mark:
        """Mark a place (3,) on the skin, m."""
        self._count += 1
        x, y, z = map(float, place)
        self.marks[self._count] = Mark(self._count, (x, y, z))
        return self.marks[self._count]

    def answer(self, number: int, **answers: str) -> None:
        """Say of a mark whether it is hard or soft (`hardness`), deep or shallow (`depth`)."""
        if number in self.marks:
            changes: dict[str, Any] = dict(answers)
            self.marks[number] = replace(self.marks[number], **changes)

    def remove(self, number: int) -> None:
        """Remove a mark."""
        self.marks.pop(number, None)

    def judge(self, mark: Mark) -> str:
        """Return in words whether a mark has found a lump, and which."""
        radii = [result.lump.radius + NEAR * self._radius for result in self._results]
        pairs = match_marks([result.at for result in self._results], radii, [mark])
        if not pairs:
            nearest = min(float(np.linalg.norm(r.at.above - mark.place)) for r in self._results)
            return f"No lump lies here. The nearest is {millimetres(round(nearest, 3))} away along the skin."
        result = replace(self._results[next(iter(pairs))], mark=mark)
        right = [name for name in ("hardness", "depth") if getattr(mark, name) == getattr(result, name)]
        wrong = [name for name in ("hardness", "depth") if getattr(mark, name) and name not in right]
        judged = (
            f" Your {' and '.join(wrong)} is wrong." if wrong else " All right." if len(right) == 2 else ""
        )
        return f"Found: {_lump_words(result)}, {millimetres(round(result.off, 3))} from the mark.{judged}"

    def shown_lumps(self) -> list[tuple[Mark, str]]:
        """Return the place of the skin above each lump, as a mark of number 0, and its description."""
        shown = []
        for result in self._results:
            x, y, z = result.at.above.tolist()
            shown.append((Mark(0, (x, y, z), result.hardness, result.depth), _lump_words(result)))
        return shown


def _lump_words(result: LumpResult) -> str:
    under = millimetres(round(result.at.cover, 4))
    return f"a {result.hardness}, {result.depth} lump of {result.size}, {under} under the skin"
