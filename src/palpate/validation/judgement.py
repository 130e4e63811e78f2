"""How a model did on solves that it has never seen: the part that is alike for every kind of model."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import AccuracyError
from palpate.format import criterion_figure
from palpate.validation.limits import Check

__all__ = ["Judgement"]


@dataclass(frozen=True)
class Judgement:
    """Figures against limits, and what to say of them.

    Attributes
    ----------
    name : str
        Of the model.
    samples : int
        Unseen solves.
    checks : tuple of Check
        What was judged.
    notes : tuple of str
        What was not judged, and why.
    """

    name: str
    samples: int
    checks: tuple[Check, ...]
    notes: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether every limit is kept."""
        return not self.failures

    @property
    def failures(self) -> tuple[Check, ...]:
        """The checks that failed."""
        return tuple(c for c in self.checks if not c.passed)

    def raise_if_failed(self) -> None:
        """Do nothing if every limit is kept.

        Raises
        ------
        AccuracyError
            What was measured, what was asked and where the worst case is, for every limit missed.
        """
        if self.passed:
            return
        count = f"{len(self.failures)} of {len(self.checks)} limits"
        raise AccuracyError(
            f"{self.name} misses {count} on {self.samples} solves that it has never seen.",
            why="\n".join(_without_fix(c) for c in self.failures),
            fix=" ".join(dict.fromkeys(c.criterion.fix for c in self.failures)),
        )

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain data for a JSON file; figures that are not finite become null."""
        judged = [
            {
                "name": c.criterion.key,
                "measured": c.measured,
                "limit": c.limit,
                "good": c.criterion.good,
                "grade": c.grade,
                "passed": c.passed,
                "where": c.where,
            }
            for c in self.checks
        ]
        data = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name != "checks"}
        plain: dict[str, Any] = _plain({"passed": self.passed, **data, "checks": judged})
        return plain

    def details(self) -> list[str]:
        """Lines below the table: what a kind of model has more to tell."""
        return []

    def __str__(self) -> str:
        rows = [("", "measured", "asked", "good", "")]
        for c in self.checks:
            kind, good = c.criterion.kind, c.criterion.good
            rows.append(
                (
                    c.criterion.label,
                    criterion_figure(c.measured, kind),
                    criterion_figure(c.limit, kind),
                    "" if good is None else criterion_figure(good, kind),
                    c.grade.upper() if c.grade == "fail" else c.grade,
                )
            )
        widths = [max(len(r[i]) for r in rows) for i in range(5)]
        table = [
            "  " + "  ".join(cell.ljust(w) for cell, w in zip(r, widths, strict=True)).rstrip() for r in rows
        ]
        verdict = (
            "every limit kept" if self.passed else f"{len(self.failures)} of {len(self.checks)} limits missed"
        )
        head = f"{self.name} on {self.samples} unseen solves: {verdict}"
        return "\n".join([head, *table, *(f"  {line}" for line in (*self.details(), *self.notes))])


def _without_fix(check: Check) -> str:
    return str(check).removesuffix(check.criterion.fix).rstrip()


def _plain(value: Any) -> Any:
    """Dataclasses, arrays and mappings as JSON-able data."""
    if dataclasses.is_dataclass(value):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
