"""Several networks of one kind averaged into one network: what each misses by chance partly cancels.

A sum of networks whose units are of one kind is a network (Perrone & Cooper 1993), so the mean costs no second kind of
surrogate: its units are all of theirs, each weight divided by their number, and its tail is the mean of their tails.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.rbf.refinement.refine import Refined
from palpate.rbf.regressors import Regressors

__all__ = ["Ensemble", "ScoredNetwork", "select_members"]

_AS_GOOD = 1.1  # the error of samples left out flatters the one network that it has chosen


@dataclass(frozen=True, eq=False)
class Ensemble:
    """One network or the mean of several of one kind, in scaled quantities."""

    members: tuple[Refined, ...]  # the best one first

    @property
    def networks(self) -> int:
        """Number of members."""
        return len(self.members)

    @property
    def regressors(self) -> Regressors:
        """The kind of all units, and the tail."""
        return self.members[0].regressors

    @cached_property
    def theta(self) -> np.ndarray:
        """Units (h, p) of all members, the best one's first."""
        return np.vstack([network.theta for network in self.members])

    @cached_property
    def coefficients(self) -> np.ndarray:
        """Coefficients (p_t + h, k): the tail's, then the units' weights."""
        tail = np.mean([network.tail for network in self.members], axis=0)
        return np.vstack([tail, *(network.weights / self.networks for network in self.members)])

    @property
    def weights_and_tail(self) -> tuple[np.ndarray, np.ndarray]:
        """Weights (h, k) of the units, and the tail (p_t, k)."""
        p_t = self.regressors.tail_size
        return self.coefficients[p_t:], self.coefficients[:p_t]

    @property
    def units(self) -> int:
        """Number of units that a query evaluates: images count."""
        return self.regressors.copies * len(self.theta)


@dataclass(frozen=True, eq=False)
class ScoredNetwork:
    """A network in scaled quantities, and its errors at samples left out, computed in one or several ways."""

    network: Refined
    # of every row, for each way; the mean of networks misses the mean of these
    misses: tuple[np.ndarray, ...]


def select_members(
    networks: Sequence[ScoredNetwork],
    measure: Callable[[tuple[np.ndarray, ...]], float],
    *,
    most: int,
    units: int,
) -> tuple[tuple[ScoredNetwork, ...], tuple[np.ndarray, ...]]:
    """Return the networks of one kind whose mean misses least, and what that mean misses.

    To the best network of a kind is added, one after another, the one with which the mean misses least (Caruana,
    Niculescu-Mizil, Crew & Ksikes 2004): one that errs elsewhere, where the next best often only grew from the best.
    The mean is of as many as miss no more than a tenth more than the least, of `most` members and so many units at
    most, images counted. `measure` makes one error of what a network misses.
    """
    kinds: dict[tuple[str, str], list[ScoredNetwork]] = defaultdict(list)
    for one in networks:
        kinds[one.network.regressors.form.name, one.network.regressors.radial].append(one)
    chains = [_means(list(kind), measure, most, units) for kind in kinds.values()]
    least, k = min((min(error for *_, error in chain), k) for k, chain in enumerate(chains))
    members, misses, _ = next(mean for mean in reversed(chains[k]) if mean[2] <= _AS_GOOD * least)
    return members, misses


_Mean = tuple[tuple[ScoredNetwork, ...], tuple[np.ndarray, ...], float]


def _means(
    pool: list[ScoredNetwork], measure: Callable[[tuple[np.ndarray, ...]], float], most: int, units: int
) -> list[_Mean]:
    """Return the means of 1, 2, … networks of a kind, each with what it misses and its error."""
    copies = pool[0].network.regressors.copies
    first = min(pool, key=lambda one: measure(one.misses))
    pool.remove(first)
    chain: list[_Mean] = [((first,), first.misses, measure(first.misses))]
    while len(chain) < most:
        members, misses, _ = chain[-1]
        size, count = copies * sum(len(one.network.theta) for one in members), len(members)
        longer: list[_Mean] = []
        for other in pool:
            if size + copies * len(other.network.theta) <= units:
                both = tuple((count * a + b) / (count + 1) for a, b in zip(misses, other.misses, strict=True))
                longer.append(((*members, other), both, measure(both)))
        if not longer:
            break
        chain.append(min(longer, key=lambda mean: mean[2]))
        pool.remove(chain[-1][0][-1])
    return chain
