"""The mean of several networks of one kind: what each misses by chance partly cancels (Perrone & Cooper 1993).

A sum of networks whose units are of one kind is a network, so the mean costs no second kind of surrogate: its units
are all of theirs, each weight divided by their number, and its tail is the mean of their tails.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.learning.energy.search import LeftOut
from palpate.rbf.refinement.refine import Refined
from palpate.rbf.regressors import Regressors

__all__ = ["Average", "average"]

_AS_GOOD = 1.1  # the error of solves left out flatters the one network that it has chosen
_UNITS = 320  # of a mean, images counted: a query costs about 25 ns for each


@dataclass(frozen=True, eq=False)
class Average:
    """Networks of one kind, at least one, as one, in scaled quantities.

    Attributes
    ----------
    members : tuple of Refined
        The best one first; rows and fit of what follows are its.
    left_out : LeftOut
        What their mean misses of solves that each was refined again without.
    closed : LeftOut
        What it misses of solves left out by the closed form.
    """

    members: tuple[Refined, ...]
    left_out: LeftOut
    closed: LeftOut

    @property
    def error(self) -> float:
        """Geometric mean of what is missed, over solves, by refining again and by the closed form."""
        return math.sqrt(self.left_out.mean * self.closed.mean)

    @property
    def networks(self) -> int:
        """How many."""
        return len(self.members)

    @property
    def regressors(self) -> Regressors:
        """Of all of them."""
        return self.members[0].regressors

    @cached_property
    def theta(self) -> np.ndarray:
        """Units (h, p) of all of them, the best one's first."""
        return np.vstack([one.theta for one in self.members])

    @cached_property
    def coefficients(self) -> np.ndarray:
        """Of tail and units (p_t + h, 1)."""
        tails = np.mean([one.tail for one in self.members], axis=0)
        weights = np.vstack([one.weights for one in self.members]) / self.networks
        return np.vstack([tails, weights])

    @property
    def units(self) -> int:
        """Of all of them, images counted."""
        return self.regressors.copies * len(self.theta)

    def with_one(self, other: Average) -> Average:
        """The mean of these networks and one more."""

        def mean(own: LeftOut, new: LeftOut) -> LeftOut:
            return replace(own, errors=(self.networks * own.errors + new.errors) / (self.networks + 1))

        left_out, closed = mean(self.left_out, other.left_out), mean(self.closed, other.closed)
        return Average((*self.members, *other.members), left_out, closed)


def average(judged: Sequence[Average], most: int, units: int = _UNITS) -> Average:
    """The mean of 1, 2, … or `most` networks of one kind that misses least of what is left out.

    To the best network of a kind is added, one after another, the one with which the mean misses least (Caruana,
    Niculescu-Mizil, Crew & Ksikes 2004): one that errs elsewhere, where the next best often only grew from the best.
    It is of as many as miss no more than a tenth more than the least, and have no more than `units`, images counted.
    """
    kinds: dict[tuple[str, str], list[Average]] = defaultdict(list)
    for one in judged:
        kinds[one.regressors.form.name, one.regressors.radial].append(one)
    means = [_means(same, most, units) for same in kinds.values()]
    least, kind = min((min(one.error for one in kind), i) for i, kind in enumerate(means))
    return next(one for one in reversed(means[kind]) if one.error <= _AS_GOOD * least)


def _means(same: list[Average], most: int, units: int) -> list[Average]:
    """Means of 1, 2, … networks of a kind, while they have no more than so many units."""
    pool = sorted(same, key=lambda one: one.error)
    means = [pool.pop(0)]
    while len(means) < most:
        fitting = [one for one in pool if means[-1].units + one.units <= units]
        if not fitting:
            break
        tried = [means[-1].with_one(one) for one in fitting]
        least = int(np.argmin([one.error for one in tried]))
        means.append(tried[least])
        pool.remove(fitting[least])
    return means
