"""Rows of the page's tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from palpate.format import criterion_figure, duration, length, plain, scientific, share
from palpate.validation.figures.by_load import NetworkErrors
from palpate.validation.figures.history_following import Followed
from palpate.validation.figures.worst_cases import Case, Part
from palpate.validation.limits import CRITERIA
from palpate.validation.report.chapter import Chapter
from palpate.validation.validate import Validation

__all__ = ["CheckRow", "check_rows", "flat", "node_rows", "sources", "tables", "timing_rows"]


@dataclass(frozen=True)
class CheckRow:
    """One line of the table of limits, all cells as text."""

    label: str
    measured: str
    limit: str
    good: str
    grade: str
    where: str


def check_rows(validation: Validation) -> list[CheckRow]:
    """Return every check as text."""
    return [
        CheckRow(
            c.criterion.label,
            criterion_figure(c.measured, c.criterion.kind),
            criterion_figure(c.limit, c.criterion.kind),
            "–" if c.criterion.good is None else criterion_figure(c.criterion.good, c.criterion.kind),
            c.grade,
            c.where,
        )
        for c in validation.checks
    ]


def tables(chapter: Chapter) -> list[tuple[str, list[str], list[list[str]]]]:
    """Return heading, head and rows of each table of numbers that the figures of a chapter give."""
    v = chapter.validation
    made = []
    if v.networks is not None:
        made.append(("Error of each displacement", *node_rows(v.networks)))
    if v.parts is not None:
        made.append(("Parts of the test", *_part_rows(v.parts)))
    if v.worst is not None:
        made.append(("Worst cases", *_case_rows(v.worst)))
    if v.histories is not None:
        made.append(("Histories", *_history_rows(chapter.followed, v.histories.largest_force)))
    return made


def node_rows(networks: NetworkErrors) -> tuple[list[str], list[list[str]]]:
    """Return head and rows of the errors per output: RMSE and largest for each network, then all together."""
    errors = networks.named()
    labels = [k for k in ("filter", "refined") if k in errors]
    head = ["output", *(f"{k}, {what}" for k in labels for what in ("RMSE", "largest"))]
    rows = []
    for i, output in enumerate(networks.refined.per_output):
        each = [errors[k].per_output[i] for k in labels]
        rows.append([output.name, *(length(v) for e in each for v in (e.rmse, e.max))])
    whole = [errors[k] for k in labels]
    rows.append(["all", *(length(v) for e in whole for v in (e.rmse, e.max))])
    rows.append(["all, of full scale", *(scientific(v) for e in whole for v in (e.relative, e.relative_max))])
    return head, rows


def timing_rows(timings: Mapping[str, float]) -> list[list[str]]:
    """Return stages and how long they took, with the sum."""
    rows = [[str(stage), duration(float(seconds))] for stage, seconds in timings.items()]
    if len(rows) > 1:
        rows.append(["together", duration(float(sum(timings.values())))])
    return rows


def flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield nested mappings as dotted names and text."""
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from flat(value, f"{name}.")
        elif isinstance(value, (list, tuple)) and any(isinstance(v, Mapping) for v in value):
            yield from flat({str(i): v for i, v in enumerate(value)}, f"{name}.")
        else:
            yield name, _text(value)


def sources(validations: Sequence[Validation]) -> list[tuple[str, str]]:
    """Return what was judged anywhere, and where its threshold comes from."""
    criteria = {c.criterion.key: c.criterion for v in validations for c in v.checks}
    known = [c.key for c in CRITERIA]
    # in the order of the table of limits, then those of a kind's own
    keys = [k for k in known if k in criteria] + [k for k in criteria if k not in known]
    return [(criteria[k].label, criteria[k].source) for k in keys]


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


def _part_rows(parts: Sequence[Part]) -> tuple[list[str], list[list[str]]]:
    head = ["part", "solves", "above f₀", "force, median", "force, p95", "light, p95 of f₀", "stiffness, p95"]
    rows = []
    for p in parts:
        figures = (p.median, p.p95, p.light_p95, p.stiffness_p95)
        rows.append([p.name, str(p.count), str(p.felt), *("–" if f is None else share(f) for f in figures)])
    return head, rows


def _case_rows(cases: Sequence[Case]) -> tuple[list[str], list[list[str]]]:
    named = cases[0].at.inputs if cases else ()
    where = [f"{name} / {unit}" if unit else name for name, _, unit in named]
    head = ["", "force error", "JND", "depth", "finite elements / N", "surrogate / N", *where]
    rows = []
    for i, c in enumerate(cases, 1):
        deep = "–" if c.depth is None else f"{plain(1e3 * c.depth, 3)} mm"
        at = [f"{value:.4g}" for _, value, _ in c.at.inputs]
        rows.append([str(i), share(c.relative), plain(c.jnd), deep, *_vectors(c.truth, c.answer), *at])
    return head, rows


def _vectors(*forces: Sequence[float]) -> list[str]:
    """Return vectors in N, all to a thousandth of the longest: smaller parts of theirs say nothing."""
    longest = max(math.hypot(*force) for force in forces)
    places = max(3 - math.ceil(math.log10(longest)), 0) if longest > 0 else 0
    return [", ".join(f"{round(part, places) + 0.0:.{places}f}" for part in force) for force in forces]


def _history_rows(followed: Sequence[Followed], largest: float) -> tuple[list[str], list[list[str]]]:
    head = [
        "history",
        "samples",
        "farthest",
        "force error, largest",
        "stays, solved",
        "stays, learnt",
        "lost / J",
    ]
    rows = []
    for i, one in enumerate(followed, 1):
        off = float(abs(one.force - one.path.force).max()) / largest
        stays = ("–", "–") if one.residual is None else (length(one.path.place[-1]), length(one.residual))
        far = length(float(abs(one.path.place).max()))
        rows.append([str(i), str(len(one.path)), far, share(off), *stays, plain(float(one.path.lost[-1]), 3)])
    return head, rows
