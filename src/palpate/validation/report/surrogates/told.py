"""All that the page shows of a touched body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from palpate.format import plain, share
from palpate.surrogates import TouchSurrogate
from palpate.validation.report.forces import plot_force_errors
from palpate.validation.report.pictures import picture
from palpate.validation.report.surrogates.chapter import SurrogateChapter
from palpate.validation.report.surrogates.curves import plot_curves
from palpate.validation.report.surrogates.maps import plot_errors, plot_trust
from palpate.validation.report.surrogates.story import surrogate_story
from palpate.validation.report.surrogates.view import deepest, further
from palpate.validation.report.svg import Picture
from palpate.validation.report.tables import flat, judged_rows, timing_rows
from palpate.validation.solves import TouchFunction
from palpate.validation.strokes import Smoothness
from palpate.validation.surrogate import SurrogateValidation, probe_samples

__all__ = ["surrogate_told"]


def surrogate_told(chapter: SurrogateChapter, key: str) -> dict[str, Any]:
    """A chapter as the template takes it."""
    v = chapter.validation
    return {
        "key": key,
        "name": chapter.name,
        "story": surrogate_story(chapter),
        "pictures": _pictures(chapter, key),
        "judged": judged_rows(v),
        "failures": [str(c) for c in v.failures],
        "notes": v.notes,
        "networks": [],
        "tables": [("Parts of the test", *_part_rows(v)), ("Worst cases", *_case_rows(v))],
        "timings": timing_rows(chapter.timings),
        "settings": list(flat(chapter.settings)),
        "provenance": list(flat(chapter.provenance or chapter.surrogate.meta)),
    }


def _pictures(chapter: SurrogateChapter, key: str) -> list[Picture]:
    surrogate, test, v = chapter.surrogate, chapter.test, chapter.validation
    samples = probe_samples(TouchFunction.of(surrogate), test)
    off = "No touch was strong enough to judge in relative terms."
    if v.force.p95 is not None and v.force.max is not None:
        off = f"95 of 100 forces are within {share(v.force.p95)}, all within {share(v.force.max)}."
    smooth = "" if v.smoothness is None else _smooth(v.smoothness)
    part = _part(surrogate)
    trust = "Colour: standard deviation of the force that the surrogate states."
    if surrogate.root is None:
        trust = "The surrogate states no deviation."
    if body := further(surrogate, deepest(surrogate, test.X)):
        trust += f" Shown for {body}."
    return [
        picture(
            f"{key}-curves",
            "Force against depth",
            f"Size of the force on the probe of {chapter.name} against its depth, surrogate and finite elements. {off}",
            f"Lines into the body along its normal, through the deepest unseen solves. {off}{smooth}",
            lambda: plot_curves(surrogate, test),
        ),
        picture(
            f"{key}-map",
            "Error on the touched surface",
            f"Force error of {chapter.name} at each unseen solve, on the surface seen from outside. {off}",
            "One dot per unseen solve, where the probe touches; forces up to f₀ are judged against f₀. Numbers mark "
            f"the worst cases of the table. {off}{part}",
            lambda: plot_errors(surrogate, test, samples),
        ),
        picture(
            f"{key}-felt",
            "Force error as a hand feels it",
            f"Share of unseen solves of {chapter.name} against force error in just noticeable differences. {off}",
            f"{off} Touches up to f₀ = {plain(v.force.light)} N ({v.force.light_count}) are judged against f₀ instead.",
            lambda: plot_force_errors(samples),
        ),
        picture(
            f"{key}-trust",
            "Where to trust it",
            f"Stated deviation of the force of {chapter.name} on the surface seen from outside, at two depths. {trust}",
            f"{trust} Hatched: outside what was trained. Dots: unseen solves.{part}",
            lambda: plot_trust(surrogate, test),
        ),
    ]


def _smooth(found: Smoothness) -> str:
    return (
        f" Along strokes at 0.1 m/s the force changes its rate from one millisecond to the next at most "
        f"{found.p95:.2f} times as much as its reference ({found.reference}), in 95 of 100 strokes."
    )


def _part(surrogate: TouchSurrogate) -> str:
    """That symmetry was used, where it was: the picture shows less than the body."""
    solves, samples = surrogate.meta.get("solves", 0), surrogate.meta.get("samples", 0)
    if not samples > solves:
        return ""
    return (
        " Solved, tested and drawn is a part of the body of which the rest is mirror images or turned copies; the "
        "surrogate answers there alike."
    )


def _part_rows(v: SurrogateValidation) -> tuple[list[str], list[list[str]]]:
    head = ["part", "solves", "above f₀", "force, median", "force, p95", "light, p95 of f₀", "stiffness, p95"]
    rows = []
    for p in v.parts:
        figures = (p.median, p.p95, p.light_p95, p.stiffness_p95)
        rows.append([p.name, str(p.count), str(p.felt), *("–" if f is None else share(f) for f in figures)])
    return head, rows


def _case_rows(v: SurrogateValidation) -> tuple[list[str], list[list[str]]]:
    named = v.worst[0].at.inputs if v.worst else ()
    where = [f"{name} / {unit}" if unit else name for name, _, unit in named]
    head = ["", "force error", "JND", "depth", "finite elements / N", "surrogate / N", *where]
    rows = []
    for i, c in enumerate(v.worst, 1):
        deep = "–" if c.depth is None else f"{plain(1e3 * c.depth, 3)} mm"
        at = [f"{value:.4g}" for _, value, _ in c.at.inputs]
        rows.append([str(i), share(c.relative), plain(c.jnd), deep, *_vectors(c.truth, c.answer), *at])
    return head, rows


def _vectors(*forces: Sequence[float]) -> list[str]:
    """Vectors in N, all to a thousandth of the longest: smaller parts of theirs say nothing."""
    longest = max(math.hypot(*force) for force in forces)
    places = max(3 - math.ceil(math.log10(longest)), 0) if longest > 0 else 0
    return [", ".join(f"{round(part, places) + 0.0:.{places}f}" for part in force) for force in forces]
