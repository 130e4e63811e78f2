"""The region where a network was trained: the distance to its data, cheap enough for a 1 kHz loop.

A box of ranges says little in several dimensions, and units of less than full rank do not decay, so neither tells
interpolation from extrapolation. The nearest training input does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.kernels import for_rows, kernel

__all__ = ["TrainedRegion"]


_DOUBLE = np.dtype(np.float64)
_MOST = 512  # points kept, at most: a query takes a few microseconds
_MANY = 20_000  # inputs of which points are chosen; of more, so many are drawn at random
_TYPICAL = 0.99  # share of the data's own nearest-neighbour distances that a radius covers


@dataclass(frozen=True, eq=False)
class TrainedRegion:
    """The union of balls around training inputs, all in scaled inputs.

    Attributes
    ----------
    points : (S, n)
        The data, or so many of them that all others lie within the radius of one.
    radius : float
        Of each ball, in scaled inputs.
    """

    points: np.ndarray
    radius: float

    def __post_init__(self) -> None:
        own_arrays(self, "points")
        points = self.points
        if (
            points.ndim != 2
            or not points.size
            or not np.isfinite(points).all()
            or not 0 <= self.radius < np.inf
        ):
            raise UsageError(
                f"Points of shape {points.shape} and a radius of {self.radius} are no region.",
                why="It is the union of balls about finite points (S, n), one row each.",
                fix="Make it of the training inputs (N, n), also where there is one: TrainedRegion.of(X[:, None]).",
            )

    @classmethod
    def of(cls, X: np.ndarray, *, groups: np.ndarray | None = None, most: int = _MOST) -> TrainedRegion:
        """The region of scaled training inputs X (N, n).

        More than `most` are thinned by farthest-point selection (Gonzalez 1985), of more than 20,000 so many at
        random. The radius is what 99 % of the data are from their nearest other kept point, as each was left out, and
        never less than what it takes to hold all data.

        Parameters
        ----------
        X : (N, n)
            Scaled training inputs, one row a sample.
        groups : (N,) int, optional
            What is one sample and is left out as a whole: depths pressed over one place, with their mirror images.
            They are nearer to each other than any new input is to them. By default each row is one.
        most : int
            Points kept.

        Raises
        ------
        UsageError
            If X is empty, not finite or no table, there is no group for each row, or no point may be kept.
        """
        if most < 1:
            raise UsageError(f"A region of {most} points is none.", fix="Keep one point at least.")
        everything = cls(X, 0.0).points  # checked
        own = np.arange(len(everything)) if groups is None else np.asarray(groups)
        if own.shape != (len(everything),):
            raise UsageError(
                f"Groups of shape {own.shape} do not say which of {len(everything)} inputs are one sample.",
                fix="Give one number for each row of X.",
            )
        some = everything
        if len(everything) > _MANY:
            rows = np.sort(np.random.default_rng(0).choice(len(everything), _MANY, replace=False))
            some, own = everything[rows], own[rows]
        kept, squared = _farthest(some, min(most, len(some)))
        cover = float(np.sqrt(squared))
        if some is not everything:
            cover = float(_distances(everything, some[kept]).max())
        gaps = _gaps(some, own, some[kept], own[kept])
        gaps = gaps[np.isfinite(gaps)]  # the only sample kept of one place has no other
        typical = float(np.quantile(gaps, _TYPICAL)) if gaps.size else 0.0
        return cls(some[kept], max(typical, cover))

    def distance(self, x: np.ndarray) -> float:
        """Distance from a scaled input x (n,) to the nearest point; infinite where x is not finite.

        Raises
        ------
        UsageError
            If x has another shape.
        """
        return float(_distance(self._checked(x), self.points))

    def distances(self, X: np.ndarray) -> np.ndarray:
        """Distances (N,) from scaled inputs X (N, n) to the nearest points.

        Raises
        ------
        UsageError
            If X has another number of columns.
        """
        X = np.ascontiguousarray(X, dtype=np.float64)
        if X.ndim != 2 or X.shape[1] != self.points.shape[1]:
            raise self._refused(X, "(N, {n})")
        return np.asarray(for_rows(_distances, len(X))(X, self.points))

    def inside(self, x: np.ndarray) -> bool:
        """True where a scaled input x (n,) is within the radius of a training input.

        Raises
        ------
        UsageError
            If x has another shape.
        """
        return bool(_distance(self._checked(x), self.points) <= self.radius)

    def _checked(self, x: np.ndarray) -> np.ndarray:
        """The point as the compiled loop takes it: that one looks at no bounds."""
        if type(x) is not np.ndarray or x.dtype is not _DOUBLE:
            x = np.asarray(x, dtype=np.float64)
        if x.shape != self.points.shape[1:]:
            raise self._refused(x, "({n},)")
        return x

    def _refused(self, x: np.ndarray, wanted: str) -> UsageError:
        n = self.points.shape[1]
        return UsageError(
            f"Inputs of shape {x.shape} have no distance to points of {n} inputs.",
            why="Distances are between scaled inputs, all of them.",
            fix=f"Pass an array of shape {wanted.format(n=n)}, scaled as the training inputs were.",
        )


@kernel(allocates=True)
def _distance(x: np.ndarray, points: np.ndarray) -> float:
    S, n = points.shape
    best = np.inf
    for i in range(S):
        q = 0.0
        for j in range(n):
            d = x[j] - points[i, j]
            q += d * d
        best = min(best, q)
    return float(np.sqrt(best))


@kernel(allocates=True)
def _distances(X: np.ndarray, points: np.ndarray) -> np.ndarray:
    out = np.empty(len(X))
    for i in range(len(X)):
        out[i] = _distance(X[i], points)
    return out


@kernel(allocates=True)
def _farthest(X: np.ndarray, count: int) -> tuple[np.ndarray, float]:
    """Indices of points far from each other, the first near the middle, and the largest squared gap left."""
    N, n = X.shape
    middle = np.zeros(n)
    for i in range(N):
        middle += X[i] / N
    chosen = np.empty(count, np.int64)
    gap = np.full(N, np.inf)
    first, least = 0, np.inf
    for i in range(N):
        q = ((X[i] - middle) ** 2).sum()
        if q < least:
            first, least = i, q
    chosen[0] = first
    for k in range(count):
        last, farthest, widest = chosen[k], 0, -1.0
        for i in range(N):
            q = 0.0
            for j in range(n):
                d = X[i, j] - X[last, j]
                q += d * d
            gap[i] = min(gap[i], q)
            if gap[i] > widest:
                farthest, widest = i, gap[i]
        if widest == 0.0:  # what is left are copies
            return chosen[: k + 1], widest
        if k + 1 < count:
            chosen[k + 1] = farthest
    return chosen, widest


@kernel(allocates=True)
def _gaps(X: np.ndarray, own: np.ndarray, points: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Distance (N,) of each row of X, of its own group (N,), to the nearest kept point of another group."""
    out = np.empty(len(X))
    for i in range(len(X)):
        best = np.inf
        for k in range(len(points)):
            if groups[k] != own[i]:
                q = ((X[i] - points[k]) ** 2).sum()
                best = min(best, q)
        out[i] = np.sqrt(best)
    return out
