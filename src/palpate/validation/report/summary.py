"""Plain words on top of a chapter: what was solved, what was learnt, how good it is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast

from palpate.dataset import Dataset
from palpate.format import count, interval, length, plain, scientific, share
from palpate.input_words import input_in_words
from palpate.surrogates.rigid_ball import pad_part_of
from palpate.validation.figures.by_load import worse_than_filter
from palpate.validation.figures.history_following import HistoryErrors
from palpate.validation.limits import FAINT, FAINT_JND, FORCE_JND
from palpate.validation.report.body_words import body_words, solid_words, strain_words
from palpate.validation.report.chapter import Chapter
from palpate.validation.validate import Validation

__all__ = ["Fact", "Story", "felt", "story"]

NOTICED = (
    f"a difference of {share(FORCE_JND)}, or of {share(FAINT_JND)} below {plain(FAINT)} N "
    "(Jones 1989; Pang, Tan & Durlach 1991)"
)
"""The just noticeable difference of a force in words."""


@dataclass(frozen=True)
class Fact:
    """One figure that stands for many: large, with a line of what it is."""

    figure: str
    meaning: str


@dataclass(frozen=True)
class Story:
    """One body in plain words.

    A verdict; a paragraph that says by what it was judged, how good it is for a hand, and what to do; figures that
    stand for many; and a paragraph on each of three subjects.
    """

    verdict: str
    passed: bool
    lead: str
    facts: tuple[Fact, ...]
    solved: str
    learnt: str
    good: str


def story(chapter: Chapter) -> Story:
    """Tell a chapter's results to a person."""
    v = chapter.validation
    verdict = "Every limit kept" if v.passed else f"{len(v.failures)} of {len(v.checks)} limits missed"
    if v.caution:
        verdict += f" on only {count(v.samples, 'unseen solve')}"
    facts = tuple(_facts(chapter))
    return Story(
        verdict, v.passed, _lead(chapter), facts, _solves_in_words(chapter), _learnt(chapter), _good(v)
    )


def _lead(chapter: Chapter) -> str:
    """Return what was judged, how good it is in words of a hand, and what to do, in one paragraph."""
    v = chapter.validation
    if v.answers is not None:
        return f"{chapter.name} is judged here by {count(v.samples, 'solve')} that it never saw. {_what_to_do(chapter)}"
    unseen = v.histories.count if v.histories is not None else v.samples
    kind = ("history", "histories") if v.histories is not None else ("finite-element solve",)
    learnt = len(chapter.learnt_from)
    from_these = f"; it was learnt from {count(learnt, 'other solve')}" if learnt else ""
    return (
        f"The learnt body {chapter.name} is judged here by {count(unseen, *kind)} that it never saw{from_these}. "
        f"{_felt_error(v)} {_what_to_do(chapter)}"
    )


def _felt_error(v: Validation) -> str:
    """Return how far the force is off, measured by what a hand notices."""
    if v.histories is not None:
        return (
            f"Its force is off by {share(v.histories.median)} of the largest at the median, and by at most "
            f"{share(v.histories.p95)} for 95 of 100 samples. A hand notices {NOTICED}."
        )
    if v.force is None or v.force.p95 is None:
        return "No touch in the test was strong enough to judge its force in relative terms."
    return (
        f"The force that a hand feels is off by {share(v.force.median)} at the median, and by at most "
        f"{share(v.force.p95)} for 95 of 100 solves: {felt(v.force.p95_jnd)}. A hand notices {NOTICED}."
    )


def _what_to_do(chapter: Chapter) -> str:
    """Return the next step for whoever reads the report."""
    v = chapter.validation
    if not v.passed and chapter.advice:
        return f"To do: {chapter.advice}."
    if not v.passed:
        return "To do: see below which limits were missed and where; ask for less there, or solve more and learn again."
    if v.caution:
        return f"To do: judge it by more solves before you rely on it. {v.caution}"
    if v.answers is not None:
        return "Every limit is kept: it is ready to be asked (`palpate ask`) and exported (`palpate export`)."
    return "Every limit is kept: it is ready to be touched (`palpate view`) and exported (`palpate export`)."


def _facts(chapter: Chapter) -> Iterator[Fact]:
    v, subject = chapter.validation, chapter.subject
    for one in v.answers or ():
        yield Fact(share(one.p95), f"error of {one.name} over its range, for 95 of 100 values")
    model = chapter.surrogate
    if model is not None and (line := model.line) is not None:
        ends = model.hand_energy.inputs[: len(line.touched)]
        reach = math.hypot(*(max(abs(r.low), abs(r.high)) for r in ends))
        yield Fact(length(reach), "farthest trained displacement of the held node")
    if subject.function is not None and subject.function.depth is not None:
        depth = float(subject.function.depth(subject.X).max())
        yield Fact(f"{plain(1e3 * depth, 3)} mm", "deepest touch in the test")
    errors = v.histories or v.force
    if errors is not None:
        largest = errors.largest_force if v.histories else errors.largest
        yield Fact(f"{plain(largest, 3)} N", "largest force on the hand in the test")
    energy = None if model is None else model.energy
    part = None if energy is None else pad_part_of(energy, chapter.meta)
    if part is not None:
        yield Fact(share(part.depth_share), str(part))
    if v.networks is not None:
        refined = v.networks.refined
        outputs = len(refined.per_output)
        yield Fact(count(refined.units, "unit"), f"of network “nodes” answer for {outputs} displacements")
        yield Fact(length(refined.rmse), f"RMSE at the nodes, {scientific(refined.relative)} of full scale")
    if learnt := len(chapter.learnt_from) or int(chapter.meta.get("solves", 0)):
        yield Fact(count(learnt, "solve"), "to learn from")
    if v.force is not None and v.force.p95 is not None:
        yield Fact(share(v.force.median), "force error at the median")
        yield Fact(share(v.force.p95), f"force error at most, for 95 of 100 solves: {felt(v.force.p95_jnd)}")
    if v.torque is not None:
        yield Fact(share(v.torque.p95), "torque error over force times the tool's size, for 95 of 100 solves")
    if v.whole_force_error is not None and v.mesh_part is not None:
        yield Fact(share(v.whole_force_error), f"force error with the mesh's, which is {share(v.mesh_part)}")
    if v.histories is not None:
        yield Fact(share(v.histories.median), "force error at the median, of the largest force")
        yield Fact(share(v.histories.p95), "force error at most, for 95 of 100 samples")
        more = v.histories.elastic_p95 / v.histories.p95
        yield Fact(f"{plain(more, 3)} ×", "as much error without a memory")


def _solves_in_words(chapter: Chapter) -> str:
    v, subject = chapter.validation, chapter.subject
    if v.histories is not None:
        text = f"{v.histories.count} histories by finite elements that the body never saw, {v.samples} samples in all."
    elif v.answers is not None:
        within = ", ".join(interval(r) for r in subject.ranges)
        text = f"{count(v.samples, 'solve')} that the surrogate never saw, within {within}."
    elif subject.loads is not None:
        text = _solved_by_load(chapter)
    else:
        within = ", ".join(interval(r) for r in subject.ranges)
        body = solid_words(chapter.test if chapter.train is None else chapter.train)
        text = (
            f"{body} {count(v.samples, 'solve')} by finite elements that the surrogate never saw, within {within}; "
            f"{v.force.light_count} of them are light, up to f₀ = {plain(v.force.light)} N."
        ).lstrip()
    return text


def _solved_by_load(chapter: Chapter) -> str:
    test = cast("Dataset", chapter.test)  # the subject's own check
    train = test if chapter.train is None else chapter.train
    loads = ", ".join(
        f"{input_in_words(r.name)} from {r.low:g} to {r.high:g} {r.unit}".rstrip()
        for r in chapter.subject.ranges
    )
    failed = len(train) + len(test) - len(train.ok) - len(test.ok)
    text = (
        f"{body_words(train.provenance)} was solved by finite elements under loads {loads}: "
        f"{len(train.ok)} solves to learn from and {chapter.validation.samples} that the networks never saw."
    )
    if failed:
        text += f" {count(failed, 'solve')} did not converge and were left out."
    return f"{text} {strain_words(train, test)}".rstrip()


def _learnt(chapter: Chapter) -> str:
    v = chapter.validation
    if v.networks is None:
        return f"{chapter.model}.".replace("\n", "; ").replace("..", ".")
    used = chapter.meta.get("refinement", {}).get("used")
    own, refined = v.networks.filter, v.networks.refined
    text = ""
    if own is not None and chapter.filter is not None:
        text = (
            f"A sequential filter met the solves one at a time, {count(chapter.filter.units.size, 'observation')} in "
            f"{count(chapter.filter.passes, 'pass', 'passes')}, ended with {count(own.units, 'unit')} and came within "
            f"{length(own.rmse)} (root mean square). "
        )
    solves = f" from {used} of them" if isinstance(used, int) and used != len(chapter.learnt_from) else ""
    return (
        f"{text}Refinement{solves} gave the network “nodes” {count(refined.units, 'unit')}, and it came within "
        f"{length(refined.rmse)}; the largest error at any node is {length(refined.max)} ({refined.worst})."
        f"{_shortfall(v)}"
    )


def _shortfall(v: Validation) -> str:
    """Return where refinement did no good, or not enough."""
    text = "" if (worse := worse_than_filter(v.networks)) is None else f" {worse}"
    missed = next((c for c in v.failures if c.criterion.key == "rmse"), None)
    if missed is not None:
        text += (
            f" The refined network misses its target: {scientific(missed.measured)} of full scale measured, "
            f"{scientific(missed.most)} asked."
        )
    return text


def _good(v: Validation) -> str:
    parts = []
    if v.shape is not None:
        parts.append(
            f"The shape on the screen is off by {length(v.shape.mean)} on average and {length(v.shape.max)} at worst."
        )
    if v.histories is not None:
        parts.append(_good_histories(v.histories))
    elif v.answers is not None:
        parts += [f"{line[:1].upper()}{line[1:]}." for line in v.answers.lines()]
    elif v.force is not None and v.force.p95 is not None:
        if v.stiffness is not None:
            parts.append(f"The stiffness is off by at most {share(v.stiffness.p95)} for 95 of 100.")
        if v.force.direction_p95 is not None:
            direction = plain(v.force.direction_p95)
            parts.append(f"Its direction is within {direction}° for 95 of 100; a person notices 25° to 35°.")
        if v.coverage is not None:
            inside = share(v.coverage.share)
            parts.append(f"Of {v.coverage.count} errors {inside} lie within the 90 % interval.")
        works = [w.max for w in (v.loops, v.border_loops) if w is not None]
        if works:
            parts.append(f"Closed paths return at most {share(max(works))} of the energy given on the way.")
    return " ".join(parts)


def _good_histories(errors: HistoryErrors) -> str:
    text = (
        f"Without a memory its force would be off by {share(errors.elastic_median)} at the median and by "
        f"{share(errors.elastic_p95)} for 95 of 100 samples."
    )
    if errors.residual_median is not None and errors.residual_largest is not None:
        text += (
            f" Let go, it stays up to {length(errors.residual_largest)} away; this place is off by "
            f"{length(errors.residual_median)} at the median."
        )
    return text + " No step gave lost energy back." if errors.gives == 0 else text


def felt(jnd: float) -> str:
    """Return an error in just noticeable differences, in words."""
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
