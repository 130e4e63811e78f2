"""Numbers that follow from inputs: a network, how far it may be off, and where it was trained.

What `palpate.fit` makes of arrays is this, and so are the numbers of a dataset, such as a largest temperature, and the
coefficients of a field's modes.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from palpate.errors import UsageError
from palpate.format import count
from palpate.network import Network, TrainedRegion
from palpate.network.influence import Influence
from palpate.network.uncertainty import Uncertainty
from palpate.surrogates.arguments import rows_of
from palpate.tables import column_names, columns_in_order
from palpate.units import Quantity, Range

__all__ = ["LearntQuantities"]

_ASTRAY = 3.0  # calibrated deviations that members may be apart where they are trusted


@dataclass(frozen=True, eq=False)
class LearntQuantities:
    """Numbers of the inputs as a value, kept in the file of a surrogate.

    Attributes
    ----------
    network : Network
        n inputs → m outputs, SI units; its inputs' ranges are the trained ones.
    uncertainty : Uncertainty, optional
        Of the network; without it `deviation` is not-a-number.
    region : TrainedRegion, optional
        Of the scaled training inputs; without it the ranges alone are the trained region.
    members : tuple of Network
        The networks whose mean answers; none where one alone does.
    influence : Influence, optional
        How the answers hang on single samples, where these were few.
    level : float
        Share of unseen samples that the intervals are calibrated to hold.

    Raises
    ------
    UsageError
        If the parts do not fit together.
    """

    network: Network
    uncertainty: Uncertainty | None = None
    region: TrainedRegion | None = None
    members: tuple[Network, ...] = ()
    influence: Influence | None = None
    level: float = 0.9

    def __post_init__(self) -> None:
        if fault := self._fault():
            raise UsageError(
                f"These quantities can't be made: {fault}.",
                why="Network, uncertainty, region and members must be of the same inputs and outputs.",
                fix="Let `palpate.fit` or `palpate.learn` make them of one set of samples.",
            )

    def _fault(self) -> str:
        """Return the fault by which parts do not fit; "" if there is none."""
        n, m = len(self.network.inputs), len(self.network.outputs)
        sure = None if self.uncertainty is None else self.uncertainty.network
        if sure is not None and (len(sure.inputs), len(sure.outputs)) != (n, m):
            return "the uncertainty is of another network"
        if self.region is not None and self.region.points.shape[1] != n:
            return f"the region is of {self.region.points.shape[1]} inputs, the network of {n}"
        if any((len(one.inputs), len(one.outputs)) != (n, m) for one in self.members):
            return "a member has other inputs or outputs"
        if not 0.0 < self.level < 1.0:
            return f"a level of {self.level} is no probability"
        if self.influence is None:
            return ""
        G, missed = self.influence.coefficients, self.influence.missed
        fits = G.shape == (1 + n + self.network.units, len(missed)) and missed.shape[1:] == (m,)
        return "" if fits else "the influence of samples is on another network"

    def __str__(self) -> str:
        names = ", ".join(f"{q.name} ({q.unit})" if q.unit else q.name for q in self.outputs[:6])
        more = f" and {len(self.outputs) - 6} more" if len(self.outputs) > 6 else ""
        return f"{names}{more}: {count(self.network.units, 'unit')}"

    __repr__ = __str__

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names, units and trained ranges of the n inputs."""
        return self.network.inputs

    @property
    def outputs(self) -> tuple[Quantity, ...]:
        """Names and units of the m outputs."""
        return self.network.outputs

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Return the outputs (N, m) at inputs X (N, n); a table's columns are matched by name, here and below.

        Raises
        ------
        UsageError
            If X has another number of columns; so do all that take X.
        """
        return self.network.predict(self._checked(X))

    def deviation(self, X: np.ndarray) -> np.ndarray:
        """Return the calibrated standard deviation (N, m) of what would be solved or measured at X (N, n).

        It is the members' disagreement where that is more, and not-a-number without an uncertainty.
        """
        X = self._checked(X)
        if self.uncertainty is None:
            return np.full((len(X), len(self.outputs)), np.nan)
        return np.asarray(np.maximum(self.uncertainty.deviation(X), self.disagreement(X)))

    def disagreement(self, X: np.ndarray) -> np.ndarray:
        """Return the standard deviation (N, m) of the members' answers at X (N, n); zero for a single network."""
        if not self.members:
            return np.zeros((len(X), len(self.outputs)))
        return np.asarray(np.std([member.predict(X) for member in self.members], axis=0))

    def interval(self, X: np.ndarray, level: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds (N, m) for what would be solved or measured at X (N, n).

        Parameters
        ----------
        X : (N, n)
            Inputs, SI units.
        level : float, optional
            By default the one that was calibrated for; another one stretches the widths by a normal law.

        Raises
        ------
        UsageError
            If X has another number of columns, the level is no probability, or there is no uncertainty.
        """
        if self.uncertainty is None:
            raise UsageError(
                "There are no intervals.",
                why="This network was learnt without an uncertainty.",
                fix="Learn it with `palpate.fit` or `palpate.learn`.",
            )
        X, level = self._checked(X), self.level if level is None else level
        low, high = self.uncertainty.interval(X, level)
        half, middle = (high - low) / 2.0, (high + low) / 2.0
        half = np.maximum(half, NormalDist().inv_cdf((1.0 + level) / 2.0) * self.disagreement(X))
        return middle - half, middle + half

    def trusted(self, X: np.ndarray) -> np.ndarray:
        """Return which of X (N, n) are like the training samples, (N,) bool.

        They are as near to a sample as those are to each other, and the networks whose mean answers agree there to
        three standard deviations; of few samples, the answers without one of them do, as they do not beside a kink.
        """
        X = self._checked(X)
        scaled = self.network.scaling.scale_inputs(X)
        if self.region is None:
            near = (np.abs(scaled) <= 1.0 + 1e-9).all(axis=1)
        else:
            near = self.region.distances(scaled) <= self.region.radius
        if self.uncertainty is None:
            return np.asarray(near)
        apart = self.disagreement(X)
        if self.influence is not None:
            apart = np.maximum(apart, self.influence.deviation(self.network, X))
        # written so that a point that is not a number is not trusted
        agree = (apart <= _ASTRAY * self.uncertainty.deviation(X)).all(axis=1)
        return np.asarray(near & agree)

    def _checked(self, X: np.ndarray) -> np.ndarray:
        if column_names(X):
            X = columns_in_order("Inputs X", X, [r.name for r in self.inputs])
        # a number that is not finite is answered with none, and not trusted
        X = np.ascontiguousarray(X, dtype=np.float64)
        if X.ndim != 2 or X.shape[1] != len(self.inputs):
            rows_of(X, self.inputs, "network")  # which refuses it, with the reason
        return X
