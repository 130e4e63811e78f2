"""The mean of several networks of one kind: what each misses by chance partly cancels (Perrone & Cooper 1993).

A sum of networks whose units are of one kind is a network, so the mean costs no second kind of surrogate: its units
are all of theirs, each weight divided by their number, and its tail is the mean of their tails.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.learning.energy.judging import Judged
from palpate.learning.energy.search import LeftOut
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
    judged : Judged
        The best one first; rows and fit are of it.
    """

    judged: Judged

    @property
    def members(self) -> tuple[Refined, ...]:
        """The networks."""
        return self.judged.networks

    @property
    def left_out(self) -> LeftOut:
        """What the mean misses of solves that it was refined again without."""
        return self.judged.left_out

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
    def error(self) -> float:
        """Of solves left out, as `Judged` has it."""
        return self.judged.error


def average(judged: Sequence[Judged], most: int, units: int = _UNITS) -> Average:
    """The mean of 1, 2, … or `most` networks of one kind that misses least of what is left out.

    To the best network of a kind is added, one after another, the one with which the mean misses least (Caruana,
    Niculescu-Mizil, Crew & Ksikes 2004): one that errs elsewhere, where the next best often only grew from the best.
    It is of as many as miss no more than a tenth more than the least, and have no more than `units`, images counted.
    """
    kinds: dict[tuple[str, str], list[Judged]] = defaultdict(list)
    for one in judged:
        of = one.networks[0].regressors
        kinds[of.form.name, of.radial].append(one)
    means = [_means(same, most, units) for same in kinds.values()]
    least, kind = min((min(one.error for one in kind), i) for i, kind in enumerate(means))
    return Average(next(one for one in reversed(means[kind]) if one.error <= _AS_GOOD * least))


def _means(same: list[Judged], most: int, units: int) -> list[Judged]:
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
