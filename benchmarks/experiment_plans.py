"""Plans of experiments on simulated people: coverage, bias, trials saved by adaptive placement, equivalence, ratings.

    python -m benchmarks.experiment_plans [--quick] [--record]

The rival of adaptive placement is the method of constant stimuli in the same run. There people differ as people do: σ
by 30 % about 0.2, the bias by 0.05. Constant stimuli can't know that beforehand.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import expit

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.experiments import (
    JND,
    Adaptive,
    Constant,
    Course,
    Observer,
    Population,
    Psychometric,
    Staircase,
    equivalence,
    simulate_course,
)
from palpate.experiments.psychometric import Estimate
from palpate.experiments.ratings import cumulative_logit
from palpate.experiments.simulation import simulate_people

__all__ = ["simulate_raters", "tables"]

SIGNED = Psychometric("signed")
LEVELS = np.linspace(-0.6, 0.6, 25)
STRENGTHS = np.geomspace(0.02, 0.6, 16)
PERSON = Observer(location=0.05, spread=0.2, lapse=0.02, side=0.04)
TIRED = "adaptive, 100; σ 30 % larger at first and at last"
_TRIALS = 140
_SAVED = 0.7  # share of the trials of constant stimuli
_GROUP = 12
_RATED = 4  # ratings of each body by each rater
_EFFECTS = (0.7, -0.8, 0.4)  # logits
_CUTS = np.array([-3.0, -1.8, -0.8, 0.2, 1.2, 2.4])  # thresholds between ratings of simulated raters, logits


def _courses() -> dict[str, tuple[Course, Observer]]:
    odd, two = Psychometric("correct", guess=1 / 3), Psychometric("correct", guess=0.5)
    wide, middle = np.linspace(-3.5, 0.0, 25), Observer(-1.8, 0.4, 0.02)
    adaptive = Course(Adaptive(LEVELS, SIGNED), SIGNED, 100, 4)
    return {
        "constant, 7 × 20": (Course(Constant(np.linspace(-0.45, 0.45, 7), 140), SIGNED, 140), PERSON),
        "adaptive, 100": (adaptive, PERSON),
        "2 down 1 up, 100": (Course(Staircase(STRENGTHS), SIGNED, 100), PERSON),
        "weighted 3:1, 100": (Course(Staircase(STRENGTHS, 1, 3), SIGNED, 100), PERSON),
        TIRED: (adaptive, replace(PERSON, fatigue=0.3, learning=0.3)),
        "odd one out, adaptive, 150": (Course(Adaptive(wide, odd), odd, 150), middle),
        "two intervals, right or wrong, 150": (Course(Adaptive(wide, two), two, 150), middle),
    }


def _plans(people: int, quick: bool) -> Table:
    rows, claims = list[dict[str, Any]](), list[Claim]()
    for name, (course, observer) in _courses().items():
        s = simulate_course(course, observer, people)
        covers = {"location": 100 * s.location_coverage, "spread": 100 * s.spread_coverage}
        reversals = None if s.reversals_bias is None else 100 * s.reversals_bias
        rows.append(
            {
                "plan": name,
                "trials": s.trials,
                **covers,
                "bias": 100 * s.bias,
                "scatter": s.scatter,
                "reversals": reversals,
            }
        )
        if name in {"constant, 7 × 20", "adaptive, 100"}:
            away = max(abs(c - 95.0) for c in covers.values())
            claims += [
                Claim(f"{name}: coverage off 95 %", (away,), 2.0, ".1f"),
                Claim(f"{name}: bias of the JND, %", (abs(100 * s.bias),), 3.0, ".1f"),
            ]
    columns = (
        Column("plan", "plan"),
        Column("trials", "trials"),
        Column("location", "covers μ, %", ".1f"),
        Column("spread", "covers the JND, %", ".1f"),
        Column("bias", "bias of the JND, %", "+.1f"),
        Column("scatter", "scatter of ln JND", ".2f"),
        Column("reversals", "bias of the reversals, %", "+.0f"),
    )
    notes = (
        f"σ 0.2, μ 0.05, lapses 2 %, preference 0.04; {people} simulated people a plan; intervals of 95 %",
        "of answers that are right or wrong, the JND stands for σ, 0.4",
    )
    title = f"Plans on simulated people{quick_mark(quick)}"
    return Table("experiment_plans", title, columns, rows, [] if quick else claims, notes)


def _estimates(course: Course, middle: Observer, people: int, seed: int) -> Estimate:
    """Return the estimates of people who differ."""
    rng = np.random.default_rng(seed)
    location, spread = Population(middle, 0.05, 0.3).draw(people, rng)
    state = simulate_people(course, middle, people, rng, location, spread)
    return course.function.estimate(course.counts(state))


def _width(course: Course, people: int) -> float:
    spread = _estimates(course, PERSON, people, 3).spread
    return float(np.log(spread[:, 2] / spread[:, 0]).mean())


def _saved(people: int, quick: bool) -> Table:
    rows, widths = list[dict[str, Any]](), dict[str, float]()
    for name, end in (("constant to ±0.45", 0.45), ("constant to ±0.6", 0.6), ("constant to ±0.8", 0.8)):
        course = Course(Constant(np.linspace(-end, end, 7), _TRIALS), SIGNED, _TRIALS)
        widths[name] = _width(course, people)
        rows.append({"plan": name, "trials": _TRIALS, "width": widths[name]})
    few = round(_SAVED * _TRIALS)
    adaptive = _width(Course(Adaptive(LEVELS, SIGNED), SIGNED, few), people)
    rows.append({"plan": "adaptive to ±0.6", "trials": few, "width": adaptive})
    columns = (
        Column("plan", "plan"),
        Column("trials", "trials"),
        Column("width", "ln(upper/lower) of the JND", ".3f"),
    )
    claims = [
        Claim(f"width of adaptive over {name}, {_SAVED:g} of the trials", (adaptive / w,), 1.0, ".3f")
        for name, w in widths.items()
    ]
    title = f"Trials that adaptive placement saves, people who differ{quick_mark(quick)}"
    return Table("experiment_saved", title, columns, rows, [] if quick else claims)


def _equivalence(groups: int, quick: bool) -> Table:
    """Return how often groups show equivalence where the shift is exactly the margin, and where it is zero."""
    course, rows = Course(Adaptive(LEVELS, SIGNED), SIGNED, 80, 4), list[dict[str, Any]]()
    margin = 0.5 * JND * 0.2 * float(np.exp(0.3**2 / 2))
    for name, shift in (("exactly half a JND", margin), ("none", 0.0)):
        e = _estimates(course, replace(PERSON, location=shift), _GROUP * groups, 4)
        parts = [slice(k * _GROUP, (k + 1) * _GROUP) for k in range(groups)]
        shown = [equivalence(e.location[g, 1], e.spread[g, 1], 0.5).holds() for g in parts]
        rows.append(
            {"shift": name, "people": _GROUP, "groups": groups, "shown": 100.0 * float(np.mean(shown))}
        )
    columns = (
        Column("shift", "shift"),
        Column("people", "people"),
        Column("groups", "groups"),
        Column("shown", "equivalence shown, %", ".1f"),
    )
    chance = 2.0 * 100.0 * (0.05 * 0.95 / groups) ** 0.5
    claims = [Claim("shown at the margin, %", (rows[0]["shown"],), 5.0 + round(chance, 1), ".1f")]
    title = f"Two one-sided tests at 5 %, margin half a JND, 80 adaptive trials{quick_mark(quick)}"
    return Table("experiment_equivalence", title, columns, rows, [] if quick else claims)


def simulate_raters(
    rng: np.random.Generator,
    people: int,
    ratings: int,
    effects: tuple[float, float, float],
    between: float = 1.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Return counts (people, 2, 7) and the design of simulated raters of a reference and another body.

    Every second one is an expert. `effects` are, in logits, an expert's intercept, and the other body's effect on other
    people and on experts; people differ by `between`. Each rates each body so many times.
    """
    expert = np.arange(people) % 2 == 1
    design = np.zeros((people, 2, 3))
    design[expert, :, 0], design[~expert, 1, 1], design[expert, 1, 2] = 1.0, 1.0, 1.0
    leaning = design @ np.array(effects) + between * rng.standard_normal((people, 1))
    below = expit(_CUTS - leaning[..., None])
    share = np.diff(below, axis=2, prepend=0.0, append=1.0)
    return rng.multinomial(ratings, share).astype(float), design


def _ratings(studies: int, quick: bool) -> Table:
    """Return how often the ordinal model's intervals hold the true effects on simulated raters, experts apart."""
    names = ("experts apart from others", "other body, rated by others", "other body, rated by experts")
    rng, rows = np.random.default_rng(5), list[dict[str, Any]]()
    drawn = [simulate_raters(rng, _GROUP, _RATED, _EFFECTS) for _ in range(studies)]
    effects = np.stack([cumulative_logit(*study, 2)[0] for study in drawn])
    for k, (name, true) in enumerate(zip(names, _EFFECTS, strict=True)):
        low, middle, high = effects[:, k].T
        covers = 100.0 * float(((low <= true) & (true <= high)).mean())
        rows.append({"effect": name, "true": true, "covers": covers, "bias": float(middle.mean()) - true})
    columns = (
        Column("effect", "effect"),
        Column("true", "true, logits", "+.1f"),
        Column("covers", "covers it, %", ".1f"),
        Column("bias", "bias, logits", "+.3f"),
    )
    notes = (
        f"{_GROUP} raters a study, half of them experts, who rate both bodies {_RATED} times",
        f"people differ by 1 logit; {studies} simulated studies; intervals of 95 %",
    )
    away = max(abs(row["covers"] - 95.0) for row in rows)
    claims = [
        Claim("coverage off 95 %", (away,), 2.0 + round(200.0 * (0.05 * 0.95 / studies) ** 0.5, 1), ".1f")
    ]
    title = f"Ordinal model of ratings{quick_mark(quick)}"
    return Table("experiment_ratings", title, columns, rows, [] if quick else claims, notes)


def tables(*, quick: bool) -> list[Table]:
    """Return the tables of plans, of trials saved, of the equivalence test, and of ratings."""
    people = 50 if quick else 1000
    return [
        _plans(people, quick),
        _saved(people, quick),
        _equivalence(10 if quick else 200, quick),
        _ratings(4 if quick else 200, quick),
    ]


if __name__ == "__main__":
    sys.exit(main(only="experiment_plans"))
