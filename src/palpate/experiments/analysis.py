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
from palpate.experiments.study_folder import StudyFolder, read_table

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
    ratings : dict
        By condition and statement: median, quartiles, people, and p against the reference.
    left_out : tuple of str
        A sentence on each sitting or person that does not count.
    """

    plan: Plan
    people: tuple[PersonResult, ...]
    groups: tuple[GroupResult, ...]
    ratings: dict[str, dict[str, dict[str, Any]]]
    left_out: tuple[str, ...]

    def __str__(self) -> str:
        lines = [
            f"{self.plan.name}: {self.plan.question}, {len({p.participant for p in self.people})} people"
        ]
        lines += [f"  left out   {text}" for text in self.left_out]
        lines += [line for person in self.people for line in self._of_person(person)]
        for group in self.groups:
            lines += self._of_group(group)
        for condition, items in self.ratings.items():
            for item, r in items.items():
                beside = "" if r["p"] is None else f", against the reference p = {r['p']:.3g}"
                lines.append(
                    f"  {condition:12} {item:14} median {r['median']:g}, quartiles {r['low']:g} … {r['high']:g}, "
                    f"{r['people']} people{beside}"
                )
        return "\n".join(lines)

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
            low, mean, high = (np.expm1(np.exp(x)) for x in (s.low, s.mean, s.high))
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
            "ratings": self.ratings,
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
        return Analysis(plan, (), (), _ratings(plan, rows), ())
    people, left_out = list[PersonResult](), list[str]()
    for (label, condition), own in sorted(rows.items()):
        counted = [r for r in own if r["kind"] == "trial"]
        if len(counted) < _FEW:
            left_out.append(f"{label} {condition}: {len(counted)} answers, {_FEW} are needed")
            continue
        people.append(_person(plan, label, condition, own, counted))
    return Analysis(plan, tuple(people), _groups(plan, people), {}, tuple(left_out))


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
    low, middle, high = estimate.location[0].tolist()
    s_low, s_middle, s_high = estimate.spread[0].tolist()
    return PersonResult(
        label, condition, len(x), (low, middle, high), (s_low, s_middle, s_high),
        float(estimate.lapse[0, 1]), good.deviance, good.p, tuple(notes),
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


def _ratings(
    plan: Plan, rows: dict[tuple[str, str], list[dict[str, str]]]
) -> dict[str, dict[str, dict[str, Any]]]:
    """Return median and quartiles over people's own medians, with Wilcoxon's signed-rank test against the reference."""
    from scipy.stats import wilcoxon

    medians = defaultdict[tuple[str, str], dict[str, float]](dict)
    for (label, condition), own in rows.items():
        counted = [r for r in own if r["kind"] == "trial"]
        for rating in plan.rating:
            if counted:
                answers = [int(r[rating.name]) for r in counted]
                medians[condition, rating.name][label] = float(np.median(answers))
    results = defaultdict[str, dict[str, dict[str, Any]]](dict)
    for (condition, item), own_medians in sorted(medians.items()):
        values = np.array(list(own_medians.values()))
        beside = medians.get(("reference", item), {})
        both = [own_medians[k] - beside[k] for k in own_medians if k in beside]
        tested = condition != "reference" and len(both) > 1 and any(both)
        low, middle, high = np.quantile(values, [0.25, 0.5, 0.75]).tolist()
        results[condition][item] = {
            "median": middle,
            "low": low,
            "high": high,
            "people": len(values),
            "p": float(wilcoxon(both).pvalue) if tested else None,
        }
    return dict(results)
