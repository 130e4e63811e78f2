"""The mean of several networks of one kind: what each misses by chance partly cancels (Perrone & Cooper 1993).

A sum of networks whose units are of one kind is a network, so the mean costs no second kind of surrogate: its units
are all of theirs, each weight divided by their number, and its tail is the mean of their tails.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.energy.search import LeftOut, Problem, Search
from palpate.learning.refinement.refine import Refined
from palpate.learning.units.regressors import Regressors

__all__ = ["Average", "average"]

_AS_GOOD = 1.1  # the error of solves left out flatters the one network that it has chosen
_UNITS = 320  # of a mean, images counted: a query costs about 25 ns for each


@dataclass(frozen=True, eq=False)
class Average:
    """Networks of one kind as one, in scaled quantities.

    Attributes
    ----------
    regressors : Regressors
    theta : (h, p)
        Units of all of them, the best one's first.
    coefficients : (p_t + h, 1)
    left_out : LeftOut
        Rows and fit of the best one, and what the mean misses of solves that are left out.
    networks : int
        How many.
    """

    regressors: Regressors
    theta: np.ndarray
    coefficients: np.ndarray
    left_out: LeftOut
    networks: int

    @property
    def error(self) -> float:
        """Leave-one-solve-out error."""
        return self.left_out.mean


def average(search: Search, most: int, units: int = _UNITS) -> Average:
    """The mean of networks of that kind of which the best 1, 2, … or `most` miss least of what is left out.

    It is of as many as miss no more than a tenth more than these, and have no more than `units`, images counted.
    """
    kinds: dict[tuple[str, str], list[tuple[float, Refined]]] = defaultdict(list)
    for error, found in search.found:
        kinds[found.regressors.form.name, found.regressors.radial].append((error, found))
    images = search.problem.images
    copies = 1 if images is None else len(images.turns)
    means = [
        _means(search.problem, sorted(same, key=lambda one: one[0])[:most], units // copies)
        for same in kinds.values()
    ]
    least, kind = min((min(one.mean for one in kind), i) for i, kind in enumerate(means))
    count = max(k for k, one in enumerate(means[kind], 1) if one.mean <= _AS_GOOD * least)
    ordered = sorted(list(kinds.values())[kind], key=lambda one: one[0])
    return _together(means[kind][count - 1], [found for _, found in ordered[:count]])


def _means(problem: Problem, best: list[tuple[float, Refined]], units: int) -> list[LeftOut]:
    """What the means of the best 1, 2, … networks miss, while they have no more than so many units."""
    means: list[LeftOut] = []
    size = 0
    for _, found in best:
        size += len(found.theta)
        if means and size > units:
            break
        one, k = problem.missed(found), len(means)
        means.append(
            one if not k else replace(means[-1], errors=(k * means[-1].errors + one.errors) / (k + 1))
        )
    return means


def _together(left_out: LeftOut, networks: list[Refined]) -> Average:
    k, tail = len(networks), len(networks[0].coefficients) - len(networks[0].theta)
    weights = np.vstack([one.coefficients[tail:] for one in networks]) / k
    tails = sum(one.coefficients[:tail] for one in networks) / k
    theta = np.vstack([one.theta for one in networks])
    return Average(networks[0].regressors, theta, np.vstack([tails, weights]), left_out, k)
