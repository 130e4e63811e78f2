"""A touched surface seen from outside: two directions across the mean of its normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.surrogates import TouchSurrogate

__all__ = ["View", "at_depth", "deepest", "feet", "further"]

AXES = ("x", "y", "z")
ALONG = 0.9  # cosine from which a direction of the view is called by an axis
TILT = 0.3  # a view so little off an axis is still drawn with x across: a few footprints on a dome lie on one side


@dataclass(frozen=True, eq=False)
class View:
    """Directions (3,) across and up the page, and towards who looks."""

    across: np.ndarray
    up: np.ndarray
    out: np.ndarray

    @classmethod
    def of(cls, surrogate: TouchSurrogate, X: np.ndarray) -> View:
        """From where the touches X (N, n) come."""
        out = surrogate.surface.at(X[:, :3])[1].mean(axis=0)
        length = float(np.linalg.norm(out))
        out = out / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
        # the axis that is most across becomes the page's, so that a flat block is seen as it is drawn
        axis = np.eye(3)[int(np.argmin(np.abs(out) + TILT * np.arange(3)))]
        across = axis - (axis @ out) * out
        across /= np.linalg.norm(across)
        return cls(across, np.cross(out, across), out)

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) as seen (N, 2), m."""
        return np.asarray(points @ np.stack([self.across, self.up]).T)

    def labels(self) -> tuple[str, str]:
        """What stands at the axes: those of the body where the view looks along one."""
        return _label(self.across, "across"), _label(self.up, "up")


def _label(direction: np.ndarray, otherwise: str) -> str:
    i = int(np.argmax(np.abs(direction)))
    if abs(direction[i]) < ALONG:
        return f"{otherwise} the view / mm"
    return f"{'−' if direction[i] < 0 else ''}{AXES[i]} / mm"


def deepest(surrogate: TouchSurrogate, X: np.ndarray) -> np.ndarray:
    """The inputs (n,) of the deepest of the touches X (N, n)."""
    return np.asarray(X[int(np.argmax(surrogate.depth(X)))])


def further(surrogate: TouchSurrogate, x: np.ndarray) -> str:
    """The inputs beyond the place at x (n,), in words: which body of a family it is; empty for one body."""
    named = zip(surrogate.parameters, x[3:], strict=True)
    return ", ".join(f"{r.name} = {value:.4g} {r.unit}".rstrip() for r, value in named)


def feet(surrogate: TouchSurrogate, X: np.ndarray) -> np.ndarray:
    """Points (N, 3) of the surface at rest nearest to the centres in X (N, n), m."""
    d, slope, _ = surrogate.surface.at(X[:, :3])
    return np.asarray(X[:, :3] - d[:, None] * slope)


def at_depth(
    surrogate: TouchSurrogate, view: View, places: np.ndarray, like: np.ndarray, depth: float
) -> np.ndarray:
    """Inputs (N, n) that have the probe `depth` deep where it is seen at places (N, 2); not-a-number where none.

    Parameters
    ----------
    surrogate : TouchSurrogate
    view : View
    places : (N, 2)
        m.
    like : (n,)
        An input near the surface; the further inputs are its.
    depth : float
        m.
    """
    X = np.repeat(like[None], len(places), axis=0)
    X[:, :3] = (
        places @ np.stack([view.across, view.up])
        + (like[:3] @ view.out) * np.ones((len(places), 1)) * view.out
    )
    for _ in range(60):
        miss = surrogate.depth(X) - depth
        slope = surrogate.surface.at(X[:, :3])[1] @ view.out
        X[:, :3] += np.clip(miss / np.maximum(slope, 0.2), -0.005, 0.005)[:, None] * view.out
    X[np.abs(surrogate.depth(X) - depth) > 1e-6] = np.nan
    return X
