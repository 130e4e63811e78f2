"""In which order a search of the energy's network spends its time."""

from __future__ import annotations

import time
from typing import Literal

import numpy as np

from palpate.learning.energy.search import Problem, Search
from palpate.network.radial import RadialFunction
from palpate.rbf.refinement.refine import Refined

__all__ = ["SEARCH_SHARE", "searched", "time_for"]

SEARCH_SHARE = 0.65
"""Of the time for learning; the rest goes to `palpate.learning.energy.judging`."""

_LEAST = 60.0  # s
_FORM_SHARE = 0.35  # of the time
_FORMS = ("rotated", "axis-aligned", "rank-2")  # the last for more inputs than the position
_RADIALS: tuple[RadialFunction, ...] = ("inverse-multiquadric", "matern-5/2", "gaussian")
_FIRST = 6  # units by which forms are compared
_SAME_KIND = (
    0.5  # share of further networks that are of the best one's kind, so that a mean has some to choose from
)
_SPREAD = (0.6, 1.4)  # sizes of further networks over that of the best


def time_for(solves: int, given: float | None = None) -> float:
    """Seconds for learning from so many solves: what is given, else one for each, a minute at least.

    With the same time for any number, more solves end in worse networks: of the block in docs/benchmarks.md 80 miss
    0.25 % in 60 s (95th percentile of the force), 300 miss 0.49 %, and in 240 s 0.24 %.
    """
    return max(_LEAST, float(solves)) if given is None else given


def searched(
    problem: Problem,
    deadline: float,
    form: str,
    radial: RadialFunction | Literal["auto"],
    units_max: int,
    target: float,
    seed: int,
) -> Search:
    """Every kind of unit at one size, then growth of the best two, and what time is left for starts of any size."""
    search = Search(problem, deadline, seed)
    kinds = _kinds(form, radial, problem.X.shape[1])
    most = units_max // problem.regressors(*kinds[0]).copies
    found: list[tuple[Refined, float]] = []
    until = time.monotonic() + _FORM_SHARE * search.left
    for kind in kinds:
        of = problem.regressors(*kind)
        h = min(_FIRST, most, problem.room(of))
        if not found or time.monotonic() < until:
            found.append(search.tried(search.random(of, h), of, "kind", 80))
    found.sort(key=lambda one: one[1])
    for i, (one, error) in enumerate(found[:2]):
        rest = search.deadline
        search.deadline = time.monotonic() + max(search.left, 0.0) / (len(found[:2]) - i)
        search.grow(one, error, most, target)
        search.deadline = rest
    rng = np.random.default_rng([seed, len(found)])
    while search.left > 0 and search.error > target and search.best is not None and len(search.best.theta):
        another = found[int(rng.integers(min(3, len(found))))][0]
        of = (search.best if rng.random() < _SAME_KIND else another).regressors
        h = round(len(search.best.theta) * rng.uniform(*_SPREAD))
        search.tried(search.random(of, min(max(h, 1), most, problem.room(of))), of, "random")
    return search


def _kinds(
    form: str, radial: RadialFunction | Literal["auto"], inputs: int
) -> list[tuple[str, RadialFunction]]:
    """Forms and radial functions to try: the first of each list with all of the other."""
    forms = [f for f in _FORMS if f != "rank-2" or inputs > 3] if form == "auto" else [form]
    radials = list(_RADIALS) if radial == "auto" else [radial]
    return [(forms[0], r) for r in radials] + [(f, r) for f in forms[1:] for r in radials[:2]]
