"""The analysis of an experiment's folder: each person first, then the group."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.experiments.experiment_plan import Plan
from palpate.experiments.groups import Equivalence, GroupMean, deviation_of, equivalence, group_mean
from palpate.experiments.psychometric import Answers
from palpate.experiments.ratings import RatingResult, rate
from palpate.experiments.study_folder import MISSING, StudyFolder, read_table

__all__ = ["Analysis", "GroupResult", "PersonResult", "analyse"]

_FEW = 20  # counted answers below which a person isn't fitted
_ATTENDS = 0.75  # of the catch trials, below which it is said
_UNSEEN = 0.2  # posterior weight at the ends of the grid from which on the levels show no slope
_BAD_FIT = 0.025


@dataclass(frozen=True)
class PersonResult:
    """The results of one person in one condition: intervals are lower end, median, upper end."""

    participant: str
    condition: str
    trials: int  # counted answers
    location: tuple[float, float, float]  # point of equality or threshold μ, in the unit of the levels
    spread: tuple[float, float, float]  # JND of discrimination, else σ, in the unit of the levels
    lapse: float  # median of λ
    deviance: float
    p: float  # share of repetitions from the fitted function whose deviance is larger
    notes: tuple[str, ...]  # a sentence on each thing that makes the estimate doubtful
    points: tuple[tuple[float, float, int], ...]  # level, share that is drawn over it, number of answers


@dataclass(frozen=True)
class GroupResult:
    """The results of the people of one condition together."""

    condition: str
    location: GroupMean  # of μ
    log_spread: GroupMean  # of ln JND or ln σ
    same: Equivalence | None  # test that the body is felt as the reference is


@dataclass(frozen=True)
class Analysis:
    """The results of an experiment: people, groups, and ratings where those were asked.

    Attributes
    ----------
    plan : Plan
        The experiment's plan.
    people : tuple of PersonResult
        Results of each person in each condition.
    groups : tuple of GroupResult
        Results of each condition with two people or more.
    ratings : tuple of RatingResult
        By statement, condition and expertise: quartiles, people, and the odds of a higher rating than the reference's.
    left_out : tuple of str
        A sentence on each sitting or person that does not count.
    """

    plan: Plan
    people: tuple[PersonResult, ...]
    groups: tuple[GroupResult, ...]
    ratings: tuple[RatingResult, ...]
    left_out: tuple[str, ...]

    def __str__(self) -> str:
        count = len({p.participant for p in self.people})
        lines = [f"{self.plan.name}: {self.plan.question}" + (f", {count} people" if count else "")]
        lines += [f"  left out   {text}" for text in self.left_out]
        lines += [line for person in self.people for line in self._of_person(person)]
        for group in self.groups:
            lines += self._of_group(group)
        return "\n".join(lines + [str(r) for r in self.ratings])

    def _shown(self, interval: tuple[float, float, float]) -> str:
        """Return a median with its interval, in what the plan varies."""
        low, middle, high = (self.plan.value(x) for x in interval)
        return f"{middle:.4g} ({low:.4g} … {high:.4g})"

    def _of_person(self, r: PersonResult) -> list[str]:
        if self.plan.question == "discrimination":
            weber = [np.expm1(x) for x in r.spread]
            ends = f"({weber[0]:.1%} … {weber[2]:.1%})"
            own = f"equal at ×{self._shown(r.location)}, Weber fraction {weber[1]:.1%} {ends}"
        else:
            own = f"threshold {self._shown(r.location)}, σ {r.spread[1]:.3g}"
        line = f"  {r.participant} {r.condition}: {own}, lapses {r.lapse:.1%}, deviance p {r.p:.2g}, {r.trials} trials"
        return [line, *(f"    note: {note}" for note in r.notes)]

    def _of_group(self, g: GroupResult) -> list[str]:
        m, s = g.location, g.log_spread
        lines = [
            f"  group {g.condition}, {m.people} people: {self._shown((m.low, m.mean, m.high))} (random effects)"
        ]
        if self.plan.question == "discrimination":
            with np.errstate(over="ignore"):  # of two people the end may be beyond all numbers
                low, mean, high = np.expm1(np.exp([s.low, s.mean, s.high]))
            lines.append(f"    Weber fraction {mean:.1%} ({low:.1%} … {high:.1%})")
        if g.same is not None:
            verdict = "shown" if g.same.holds(self.plan.wanted.level) else "not shown"
            lines.append(
                f"    the same as the reference within {g.same.margin:g} JND: {verdict} "
                f"(shift {g.same.shift:+.2f} JND, p = {g.same.p:.3g})"
            )
        return lines

    def as_dict(self) -> dict[str, Any]:
        """Return the results as data for a program."""
        return {
            "name": self.plan.name,
            "question": self.plan.question,
            "people": [vars(p) for p in self.people],
            "groups": [
                {
                    "condition": g.condition,
                    "location": vars(g.location),
                    "log_spread": vars(g.log_spread),
                    "equivalence": None if g.same is None else vars(g.same),
                }
                for g in self.groups
            ],
            "ratings": [vars(r) for r in self.ratings],
            "left_out": list(self.left_out),
        }


def analyse(folder: StudyFolder) -> Analysis:
    """Return the analysis of all sittings in a folder; runs of one person are pooled.

    Raises
    ------
    UsageError
        If there is no sitting with enough answers.
    """
    rows = defaultdict[tuple[str, str], list[dict[str, str]]](list)
    for label, table in folder.tables():
        for row in read_table(table):
            rows[label, row["condition"]].append(row)
    if not rows:
        raise UsageError(
            f"{folder.root} holds no sitting.",
            fix="Run one with `palpate experiment run`, or simulate the plan.",
        )
    plan = folder.plan
    if plan.question == "rating":
        return Analysis(plan, (), (), tuple(_ratings(folder, rows)), ())
    people, left_out = list[PersonResult](), list[str]()
    for (label, condition), own in sorted(rows.items()):
        counted = [r for r in own if r["kind"] == "trial"]
        if len(counted) < _FEW:
            left_out.append(f"{label} {condition}: {len(counted)} answers, {_FEW} are needed")
            continue
        people.append(_person(plan, label, condition, own, counted))
    return Analysis(plan, tuple(people), _groups(plan, people), (), tuple(left_out))


def _person(
    plan: Plan, label: str, condition: str, rows: list[dict[str, str]], counted: list[dict[str, str]]
) -> PersonResult:
    x = np.array([float(r["level"]) for r in counted])
    levels, index = np.unique(x, return_inverse=True)
    targets = np.array([_target(r["intervals"]) for r in counted])
    signed = plan.question == "discrimination"
    order = np.where(targets == 2, 1, -1) if signed else np.zeros(len(x), int)
    response = np.array([int(r["response"]) for r in counted])
    yes = response == targets
    answers = Answers.of_trials(levels, index[None], order[None], yes[None], np.ones((1, len(x)), bool))
    function = plan.function
    estimate, good = function.estimate(answers), function.goodness(answers)
    notes = []
    catch = [r["correct"] == "1" for r in rows if r["kind"] == "catch"]
    if catch and np.mean(catch) < _ATTENDS:
        notes.append(f"{sum(catch)} of {len(catch)} catch trials were answered rightly")
    if estimate.edge[0] > _UNSEEN:
        notes.append("the levels do not show the slope: bring them closer to the threshold")
    if good.p < _BAD_FIT:
        notes.append("the function fits badly; see whether the person changed how they answered")
    if hit := sum(r["limits_hit"] == "1" for r in counted):
        notes.append(f"the limit of force acted in {hit} trials")
    if jumps := sum(r["clock_jump"] != "0" for r in rows):
        notes.append(f"the machine's clock jumped in {jumps} trials; times are steady")
    count = np.bincount(index)
    points = zip(levels.tolist(), (np.bincount(index, yes) / count).tolist(), count.tolist(), strict=True)
    low, middle, high = estimate.location[0].tolist()
    s_low, s_middle, s_high = estimate.spread[0].tolist()
    return PersonResult(
        label, condition, len(x), (low, middle, high), (s_low, s_middle, s_high),
        float(estimate.lapse[0, 1]), good.deviance, good.p, tuple(notes), tuple(points),
    )  # fmt: skip


def _target(intervals: str) -> int:
    return next((k for k, body in enumerate(intervals.split(","), 1) if body != "reference"), 0)


def _groups(plan: Plan, people: list[PersonResult]) -> tuple[GroupResult, ...]:
    groups = []
    for name in (c.name for c in plan.comparison):
        own = [p for p in people if p.condition == name]
        if len(own) < 2:
            continue
        location, spread = np.array([p.location for p in own]), np.array([p.spread for p in own])
        log = np.log(spread)
        same = None
        if plan.question == "discrimination":
            same = equivalence(location[:, 1], spread[:, 1], plan.wanted.margin)
        mean = group_mean(location[:, 1], deviation_of(location))
        groups.append(GroupResult(name, mean, group_mean(log[:, 1], deviation_of(log)), same))
    return tuple(groups)


def _ratings(folder: StudyFolder, rows: dict[tuple[str, str], list[dict[str, str]]]) -> list[RatingResult]:
    people = folder.root / "participants.tsv"
    own = {row["participant_id"]: row["expertise"] for row in read_table(people)} if people.exists() else {}
    expertise = {label: own.get(label, MISSING) for label, _ in rows}
    results = []
    for rating in folder.plan.rating:
        answers = {
            key: [int(r[rating.name]) for r in table if r["kind"] == "trial"] for key, table in rows.items()
        }
        counted = {key: values for key, values in answers.items() if values}
        results += rate(counted, rating.name, expertise) if counted else []
    return results
