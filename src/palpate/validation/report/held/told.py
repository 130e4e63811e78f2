"""All that the page shows of a held body that remembers."""

from __future__ import annotations

from typing import Any

from palpate.format import length, plain, share
from palpate.validation.held import Followed, HeldValidation, follow_unseen
from palpate.validation.report.held.chapter import HeldChapter
from palpate.validation.report.held.loops import plot_energies, plot_loops
from palpate.validation.report.pictures import picture
from palpate.validation.report.summary import Fact, Story
from palpate.validation.report.svg import Picture
from palpate.validation.report.tables import flat, judged_rows, timing_rows

__all__ = ["held_told"]


def held_told(chapter: HeldChapter, key: str) -> dict[str, Any]:
    """A chapter as the template takes it."""
    v, found = chapter.validation, follow_unseen(chapter.body, chapter.test)
    return {
        "key": key,
        "name": chapter.name,
        "story": _story(chapter),
        "pictures": _pictures(chapter, found, key),
        "judged": judged_rows(v),
        "failures": [str(c) for c in v.failures],
        "notes": (*v.details(), *v.notes),
        "networks": [],
        "tables": [("Histories", *_history_rows(found, v.largest_force))],
        "timings": timing_rows(chapter.timings),
        "settings": list(flat(chapter.settings)),
        "provenance": list(flat(chapter.provenance or chapter.body.meta)),
    }


def _story(chapter: HeldChapter) -> Story:
    v = chapter.validation
    verdict = "Every limit kept" if v.passed else f"{len(v.failures)} of {len(v.checks)} limits missed"
    facts = (
        Fact(length(chapter.body.reach), "farthest trained displacement of the held node"),
        Fact(f"{plain(v.largest_force, 3)} N", "largest force in the test"),
        Fact(share(v.force_median), "force error at the median, of the largest force"),
        Fact(share(v.force_p95), "force error at most, for 95 of 100 samples"),
        Fact(f"{plain(v.elastic_p95 / v.force_p95, 3)} ×", "as much without a memory"),
    )
    solved = (
        f"{v.histories} histories by finite elements that the body never saw, {v.samples} samples in all."
    )
    return Story(verdict, v.passed, facts, solved, f"{chapter.body}.", _good(v))


def _good(v: HeldValidation) -> str:
    text = (
        f"The force is off by {share(v.force_median)} of the largest at the median and by at most {share(v.force_p95)} "
        f"for 95 of 100 samples; without a memory by {share(v.elastic_median)} and {share(v.elastic_p95)}."
    )
    if v.residual_median is not None and v.residual_largest is not None:
        text += (
            f" Let go, it stays up to {length(v.residual_largest)} away; where, is off by "
            f"{length(v.residual_median)} at the median."
        )
    return text + " No step gave lost energy back." if v.checks[-1].passed else text


def _pictures(chapter: HeldChapter, found: list[Followed], key: str) -> list[Picture]:
    v = chapter.validation
    off = f"95 of 100 forces are within {share(v.force_p95)} of the largest."
    return [
        picture(
            f"{key}-loops",
            "Force against displacement",
            f"Force that holds {chapter.name} against the displacement of the held node, learnt and solved. {off}",
            f"Unseen histories; the dashed line has no memory and is cut off where it leaves the picture. {off}",
            lambda: plot_loops(found),
        ),
        picture(
            f"{key}-energies",
            "Energy stored and lost",
            f"Energy stored and lost in {chapter.name} along a history, learnt and solved.",
            "Neither was fitted: both follow from the elements that the force gave.",
            lambda: plot_energies(found),
        ),
    ]


def _history_rows(found: list[Followed], largest: float) -> tuple[list[str], list[list[str]]]:
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
    for i, one in enumerate(found, 1):
        off = float(abs(one.force - one.path.force).max()) / largest
        stays = ("–", "–") if one.residual is None else (length(one.path.place[-1]), length(one.residual))
        far = length(float(abs(one.path.place).max()))
        rows.append([str(i), str(len(one.path)), far, share(off), *stays, plain(float(one.path.lost[-1]), 3)])
    return head, rows
