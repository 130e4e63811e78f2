"""Rows of the page's tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from palpate.format import criterion_figure, duration, length, scientific
from palpate.validation.judgement import Judgement
from palpate.validation.limits import CRITERIA
from palpate.validation.result import Validation

__all__ = ["Judged", "flat", "judged_rows", "node_rows", "sources", "timing_rows"]

NAMES = {"filter": "filter", "refined": "refined"}


@dataclass(frozen=True)
class Judged:
    """One line of the table of limits, all cells as text."""

    label: str
    measured: str
    limit: str
    good: str
    grade: str
    where: str


def judged_rows(validation: Judgement) -> list[Judged]:
    """Every check as text."""
    return [
        Judged(
            c.criterion.label,
            criterion_figure(c.measured, c.criterion.kind),
            criterion_figure(c.limit, c.criterion.kind),
            "–" if c.criterion.good is None else criterion_figure(c.criterion.good, c.criterion.kind),
            c.grade,
            c.where,
        )
        for c in validation.checks
    ]


def node_rows(validation: Validation) -> tuple[list[str], list[list[str]]]:
    """Heading and rows of the errors per output: RMSE and largest for each network, then all outputs together."""
    labels = [k for k in NAMES if k in validation.networks]
    head = ["output", *(f"{NAMES[k]}, {what}" for k in labels for what in ("RMSE", "largest"))]
    rows = []
    for i, output in enumerate(validation.networks["refined"].per_output):
        each = [validation.networks[k].per_output[i] for k in labels]
        rows.append([output.name, *(length(v) for e in each for v in (e.rmse, e.max))])
    whole = [validation.networks[k] for k in labels]
    rows.append(["all", *(length(v) for e in whole for v in (e.rmse, e.max))])
    rows.append(["all, of full scale", *(scientific(v) for e in whole for v in (e.relative, e.relative_max))])
    return head, rows


def timing_rows(timings: Mapping[str, float]) -> list[list[str]]:
    """Stages and how long they took, with the sum."""
    rows = [[str(stage), duration(float(seconds))] for stage, seconds in timings.items()]
    if len(rows) > 1:
        rows.append(["together", duration(float(sum(timings.values())))])
    return rows


def flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Nested mappings as dotted names and text."""
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from flat(value, f"{name}.")
        elif isinstance(value, (list, tuple)) and any(isinstance(v, Mapping) for v in value):
            yield from flat({str(i): v for i, v in enumerate(value)}, f"{name}.")
        else:
            yield name, _text(value)


def sources(validations: Sequence[Judgement]) -> list[tuple[str, str]]:
    """What was judged anywhere, and where its threshold comes from."""
    judged = {c.criterion.key: c.criterion for v in validations for c in v.checks}
    known = [c.key for c in CRITERIA]
    # in the order of the table of limits, then those of a kind's own
    keys = [k for k in known if k in judged] + [k for k in judged if k not in known]
    return [(judged[k].label, judged[k].source) for k in keys]


def _text(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return ", ".join(_text(v) for v in value)
    return str(value)
