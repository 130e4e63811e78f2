"""The mean of several networks of one kind: what each misses by chance partly cancels (Perrone & Cooper 1993).

A sum of networks whose units are of one kind is a network, so the mean costs no second kind of surrogate: its units
are all of theirs, each weight divided by their number, and its tail is the mean of their tails.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.energy.search import LeftOut, Search
from palpate.learning.refinement.refine import Refined
from palpate.learning.units.regressors import Regressors

__all__ = ["Average", "average"]

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
    """The mean that misses least of what is left out, of the best 1, 2, … `most` networks of each kind.

    Further ones are added while all their units, images counted, are no more than `units`.
    """
    kinds: dict[tuple[str, str], list[tuple[float, Refined]]] = defaultdict(list)
    for error, found in search.found:
        kinds[found.regressors.form.name, found.regressors.radial].append((error, found))
    images = search.problem.images
    copies = 1 if images is None else len(images.turns)
    means: list[tuple[LeftOut, list[Refined]]] = []
    for same in kinds.values():
        members: list[Refined] = []
        for _, found in sorted(same, key=lambda one: one[0])[:most]:
            if members and copies * sum(len(one.theta) for one in (*members, found)) > units:
                break
            one = search.problem.missed(found)
            if members:
                best, k = means[-1][0], len(members)
                one = replace(best, errors=(k * best.errors + one.errors) / (k + 1))
            members = [*members, found]
            means.append((one, members))
    left_out, chosen = min(means, key=lambda one: one[0].mean)
    return _together(left_out, chosen)


def _together(left_out: LeftOut, networks: list[Refined]) -> Average:
    k, tail = len(networks), len(networks[0].coefficients) - len(networks[0].theta)
    weights = np.vstack([one.coefficients[tail:] for one in networks]) / k
    tails = sum(one.coefficients[:tail] for one in networks) / k
    theta = np.vstack([one.theta for one in networks])
    return Average(networks[0].regressors, theta, np.vstack([tails, weights]), left_out, k)
