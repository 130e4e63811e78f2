"""The plain words on top: what was solved, what was learnt, how good it is."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.format import count, length, plain, scientific, share
from palpate.validation.report.body import body_words, strain_words
from palpate.validation.report.chapter import Chapter
from palpate.validation.result import Validation, worse_than_filter

__all__ = ["Fact", "Story", "felt", "story"]


@dataclass(frozen=True)
class Fact:
    """One figure that stands for many: large, with a line of what it is."""

    figure: str
    meaning: str


@dataclass(frozen=True)
class Story:
    """One body in plain words.

    Attributes
    ----------
    verdict : str
    passed : bool
    facts : tuple of Fact
    solved, learnt, good : str
        A paragraph each.
    """

    verdict: str
    passed: bool
    facts: tuple[Fact, ...]
    solved: str
    learnt: str
    good: str


def story(chapter: Chapter) -> Story:
    """Tell a chapter's results to a person."""
    v = chapter.validation
    verdict = "Every limit kept" if v.passed else f"{len(v.failures)} of {len(v.checks)} limits missed"
    return Story(verdict, v.passed, _facts(chapter), _solved(chapter), _learnt(chapter), _good(v))


def _facts(chapter: Chapter) -> tuple[Fact, ...]:
    v = chapter.validation
    refined = v.networks["refined"]
    facts = [
        Fact(length(v.field.reach), "travel of the held node, at most"),
        Fact(f"{plain(v.force.largest, 3)} N", "largest force on the hand in the test"),
        Fact(
            count(refined.units, "unit"),
            f"of network “nodes” answer for {len(refined.per_output)} displacements",
        ),
        Fact(length(refined.rmse), f"RMSE at the nodes, {scientific(refined.relative)} of full scale"),
    ]
    if v.force.p95 is not None and v.force.p95_jnd is not None:
        facts.append(
            Fact(share(v.force.p95), f"force error at most, for 95 of 100 loads: {felt(v.force.p95_jnd)}")
        )
    return tuple(facts)


def _solved(chapter: Chapter) -> str:
    loads = ", ".join(
        f"{r.name} from {r.low:g} to {r.high:g} {r.unit}".rstrip() for r in chapter.touch.inputs
    )
    failed = len(chapter.train) + len(chapter.test) - len(chapter.train.ok) - len(chapter.test.ok)
    text = (
        f"{body_words(chapter.train.provenance)} was solved by finite elements under loads {loads}: "
        f"{len(chapter.train.ok)} solves to learn from and {len(chapter.test.ok)} that the networks never saw."
    )
    if failed:
        text += f" {count(failed, 'solve')} did not converge and were left out."
    return f"{text} {strain_words(chapter.train, chapter.test)}".rstrip()


def _learnt(chapter: Chapter) -> str:
    v, meta = chapter.validation, chapter.touch.meta
    used = meta.get("refinement", {}).get("used")
    own, refined = v.networks.get("filter"), v.networks["refined"]
    text = ""
    if own is not None:
        text = (
            f"A sequential filter met the solves one at a time, {count(chapter.history.units.size, 'observation')} in "
            f"{count(chapter.history.passes, 'pass', 'passes')}, ended with {count(own.units, 'unit')} and came within "
            f"{length(own.rmse)} (root mean square). "
        )
    solves = f" from {count(used, 'solve')}" if isinstance(used, int) else ""
    return (
        f"{text}Refinement{solves} gave the network “nodes” {count(refined.units, 'unit')}, and it came within "
        f"{length(refined.rmse)}; the largest error at any node is {length(refined.max)} ({refined.worst})."
        f"{_shortfall(v)}"
    )


def _shortfall(v: Validation) -> str:
    """Where refinement did no good, or not enough."""
    text = "" if (worse := worse_than_filter(v.networks)) is None else f" {worse}"
    missed = next((c for c in v.failures if c.criterion.key == "rmse"), None)
    if missed is not None:
        text += (
            f" The refined network misses its target: {scientific(missed.measured)} of full scale measured, "
            f"{scientific(missed.most)} asked."
        )
    return text


def _good(v: Validation) -> str:
    force = v.force
    seen = f"The shape on the screen is off by {length(v.field.mean)} on average and {length(v.field.max)} at worst."
    if force.median is None or force.p95 is None or force.p95_jnd is None:
        return f"{seen} No touch in the test was strong enough to judge its force in relative terms."
    text = (
        f"{seen} The force that a hand feels is off by {share(force.median)} at the median and by at most "
        f"{share(force.p95)} for 95 of 100 loads: {felt(force.p95_jnd)}."
    )
    if force.direction_p95 is not None:
        text += f" Its direction is within {plain(force.direction_p95)}° for 95 of 100; a person notices 25° to 35°."
    if v.loops is not None:
        text += (
            f" The force network is not the gradient of an energy, so closed paths are watched: of "
            f"{v.loops.loops}, the worst returned {share(v.loops.max)} of the energy given on the way."
        )
    return text


def felt(jnd: float) -> str:
    """An error in just noticeable differences, in words."""
    if jnd >= 1:
        return f"{plain(jnd)} times what a person notices"
    if jnd == 0:
        return "no error at all"
    times = 1 / jnd
    if times >= 1e6:
        return (
            "a million times less than a person notices"
            if times < 2e6
            else "millions of times less than a person notices"
        )
    shown = f"{float(f'{times:.2g}'):,.0f}" if times >= 10 else plain(times)
    return f"{shown} times less than a person notices"
