"""One observation: what the filter is shown at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

__all__ = ["Observation"]


@dataclass(frozen=True, eq=False)
class Observation:
    """A value of the map, and possibly its slopes and curvatures, in scaled quantities.

    Attributes
    ----------
    x : (n,)
        Scaled input.
    y : (m,)
        Scaled output there.
    weight : float
        How many ordinary observations this one counts as: its measurement variance is R/weight.
    slopes : (m, n), optional
        ∂y/∂x. A force is the slope of an energy; a stiffness that of a force.
    slope_weight : float or (n,)
        How many ordinary values a slope counts as, on top of the observation's weight. A slope of no weight is
        not looked at, and may be not-a-number.
    curvatures : (m, n(n+1)/2), optional
        ∂²y/∂x_i∂x_j, i ≤ j (see `palpate.rbf.regressors.pairs`).
    curvature_weight : float or (n(n+1)/2,)
        The same for curvatures. Those off the diagonal count twice, as they stand twice in the matrix.
    """

    x: np.ndarray
    y: np.ndarray
    weight: float = 1.0
    slopes: np.ndarray | None = None
    slope_weight: float | np.ndarray = 1.0
    curvatures: np.ndarray | None = None
    curvature_weight: float | np.ndarray = 1.0

    @property
    def flaw(self) -> str:
        """The reason why nothing can be learnt from it; empty if something can."""
        shares = [np.ravel(s) for s in (self.slope_weight, self.curvature_weight)]
        weights = np.concatenate([[self.weight], *shares])
        if not (np.isfinite(weights).all() and self.weight > 0 and (weights >= 0).all()):
            return "its weight is not positive and finite"
        known = np.isfinite(self.x).all() and np.isfinite(self.targets()).all()
        return "" if known else "not finite"

    @property
    def finite(self) -> bool:
        """True where something can be learnt from it."""
        return not self.flaw

    @property
    def plain(self) -> bool:
        """True for a value alone."""
        return self.slopes is None and self.curvatures is None

    @property
    def counts(self) -> np.ndarray:
        """Mask of the numbers of y, slopes and curvatures, row by row, that have a weight."""
        return np.asarray(self._shares() > 0)

    def targets(self) -> np.ndarray:
        """All that was observed, (q,): y, then the slopes row by row, then the curvatures, if they have a weight."""
        if self.plain:
            return self.y
        return np.asarray(np.concatenate([p.ravel() for p in self._parts()])[self.counts])

    def variances(self, r: float) -> np.ndarray:
        """Measurement variances (q,) for an R of `r`."""
        shares = self._shares()
        return np.asarray(r / (self.weight * shares[shares > 0]))

    def minus(self, others: np.ndarray) -> Observation:
        """The observation less what something else explains of its targets, (q,)."""
        if self.plain:
            return replace(self, y=self.y - others)
        whole = np.zeros(self.counts.size)
        whole[self.counts] = others
        ends = np.cumsum([p.size for p in self._parts()])[:-1]
        names = [n for n in ("y", "slopes", "curvatures") if getattr(self, n) is not None]
        left = {
            n: getattr(self, n) - part.reshape(getattr(self, n).shape)
            for n, part in zip(names, np.split(whole, ends), strict=True)
        }
        return replace(self, **left)

    def _parts(self) -> list[np.ndarray]:
        return [p for p in (self.y, self.slopes, self.curvatures) if p is not None]

    def _shares(self) -> np.ndarray:
        """The count of ordinary values that each number stands for."""
        shares = [np.ones(self.y.size)]
        if self.slopes is not None:
            shares.append(np.broadcast_to(self.slope_weight, self.slopes.shape).ravel())
        if self.curvatures is not None:
            diagonal = np.equal(*np.triu_indices(self.x.size))
            shares.append(
                np.broadcast_to(
                    self.curvature_weight * np.where(diagonal, 1.0, 2.0), self.curvatures.shape
                ).ravel()
            )
        return np.concatenate(shares)
