"""Retained samples of a stream: a bounded sample of all of it, or of its recent past."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from palpate.errors import UsageError
from palpate.rbf.filter.observation import Observation

__all__ = ["Keeping", "Reservoir"]

Keeping = Literal["uniform", "fading", "latest"]


class Reservoir:
    """At most R samples of a stream of (x, y), in scaled quantities.

    uniform   after t samples each of them is kept with probability R/t (algorithm R, Vitter 1985)
    fading    every new one is kept, in a random place: ages are geometric with mean R (Aggarwal 2006)
    latest    the last R

    The seed decides which. A sample at exactly the inputs of a retained one takes its place: a second sight of it must
    not count twice against the others. Memory: R (n + m + 2) numbers, R (m + 1) n more once a sample comes
    with slopes, and R (m + 1) n (n + 1)/2 once one comes with curvatures.

    Parameters
    ----------
    capacity : int
        R.
    inputs, outputs : int
        n and m.
    keeping : {"uniform", "fading", "latest"}
        The rule that decides which samples stay, see above.
    seed : int
        Decides the random choices.

    Raises
    ------
    UsageError
        If the capacity is not positive, or there is no such way of keeping.
    """

    def __init__(
        self, capacity: int, inputs: int, outputs: int, *, keeping: Keeping = "uniform", seed: int = 0
    ) -> None:
        if capacity < 1 or keeping not in get_args(Keeping):
            raise UsageError(
                f"There is no reservoir of {capacity} samples that keeps {keeping!r} ones.",
                fix=f"Give it room for one at least, and one of {', '.join(get_args(Keeping))}.",
            )
        self.capacity, self.keeping = capacity, keeping
        self.seen = self.fresh = 0  # samples shown, and those at inputs that were not held
        self._rng = np.random.default_rng(seed)
        self._x, self._y = np.empty((capacity, inputs)), np.empty((capacity, outputs))
        self._times = np.empty(capacity, np.int64)
        self._weights = np.ones(capacity)
        self._slopes: np.ndarray | None = None
        self._slope_weights: np.ndarray | None = None
        self._curvatures: np.ndarray | None = None
        self._curvature_weights: np.ndarray | None = None

    def __len__(self) -> int:
        return min(self.fresh, self.capacity)

    @property
    def X(self) -> np.ndarray:
        """Inputs (N, n), in no order."""
        return self._x[: len(self)]

    @property
    def Y(self) -> np.ndarray:
        """Outputs (N, m)."""
        return self._y[: len(self)]

    @property
    def ages(self) -> np.ndarray:
        """Count of the samples that came after each, (N,)."""
        return np.asarray(self.seen - 1 - self._times[: len(self)])

    @property
    def weights(self) -> np.ndarray:
        """(N,)."""
        return self._weights[: len(self)]

    @property
    def slopes(self) -> np.ndarray | None:
        """∂y/∂x (N, m, n), where any sample came with them."""
        return None if self._slopes is None else self._slopes[: len(self)]

    @property
    def slope_weights(self) -> np.ndarray | None:
        """(N, n), zero for samples without slopes; none where no sample came with them."""
        return None if self._slope_weights is None else self._slope_weights[: len(self)]

    @property
    def curvatures(self) -> np.ndarray | None:
        """∂²y/∂x_i∂x_j (N, m, n(n+1)/2), where any sample came with them."""
        return None if self._curvatures is None else self._curvatures[: len(self)]

    @property
    def curvature_weights(self) -> np.ndarray | None:
        """(N, n(n+1)/2), zero for samples without curvatures; none where no sample came with them."""
        return None if self._curvature_weights is None else self._curvature_weights[: len(self)]

    @property
    def numbers(self) -> int:
        """Count of the numbers that there is room for."""
        first = (self._slopes, self._slope_weights)
        second = (self._curvatures, self._curvature_weights)
        parts = (self._x, self._y, self._times, self._weights, *first, *second)
        return sum(p.size for p in parts if p is not None)

    def add(self, observation: Observation) -> bool:
        """Show one more sample, in scaled quantities; True where it was kept."""
        o, place = observation, self._place(observation.x)
        self.seen += 1
        if place >= self.capacity:
            return False
        self._x[place], self._y[place] = o.x, o.y
        self._times[place] = self.seen - 1
        self._weights[place] = o.weight
        self._slopes, self._slope_weights = _put(
            *(place, self.capacity, self._slopes, self._slope_weights), o.slopes, o.slope_weight
        )
        self._curvatures, self._curvature_weights = _put(
            *(place, self.capacity, self._curvatures, self._curvature_weights),
            o.curvatures,
            o.curvature_weight,
        )
        return True

    def _place(self, x: np.ndarray) -> int:
        same = np.flatnonzero((x == self.X).all(axis=1))
        if same.size:
            return int(same[0])
        self.fresh += 1
        if self.fresh <= self.capacity:
            return self.fresh - 1
        if self.keeping == "latest":
            return (self.fresh - 1) % self.capacity
        # a place past the last means that the sample is not kept
        return int(self._rng.integers(self.capacity if self.keeping == "fading" else self.fresh))


def _put(
    place: int,
    capacity: int,
    kept: np.ndarray | None,
    weights: np.ndarray | None,
    new: np.ndarray | None,
    weight: float | np.ndarray,
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Derivatives (R, m, q) and their weights (R, q) with a new sample's, room being made for the first."""
    if new is not None and (kept is None or weights is None):
        kept, weights = np.zeros((capacity, *new.shape)), np.zeros((capacity, new.shape[1]))
    if kept is not None and weights is not None:
        weights[place] = 0.0 if new is None else weight
        if new is not None:
            kept[place] = new
    return kept, weights
