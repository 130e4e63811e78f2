"""The base of all tools: signed distance, support function and sizes.

A distance is written once, with the functions below, for arrays of NumPy and for coefficient functions of NGSolve. It
is negative inside. Outside and near the surface its gradient is a unit vector that varies continuously; deep inside, it
may have kinks, where no body ever gets.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

__all__ = ["Tool", "absolute", "larger", "length", "norm", "parts", "positive", "where_positive"]

TINY = 1e-9  # m; keeps lengths differentiable at zero
SAMPLES, SAME = (
    64,
    1e-6,
)  # points at which a shape and its image are compared, and their difference over the front
STEP = 1e-5  # of the difference quotient of a distance, over the tool's centre to its foremost point


def parts(point: Any) -> tuple[Any, Any, Any]:
    """Return the coordinates of points (..., 3), or of a coefficient function (3,)."""
    if isinstance(point, np.ndarray):
        return point[..., 0], point[..., 1], point[..., 2]
    return point[0], point[1], point[2]


def norm(point: Any) -> Any:
    """Return the smoothed length √(|x|² + ε²) of points (..., 3), or of a coefficient function (3,)."""
    if isinstance(point, np.ndarray):
        return length(*parts(point))
    import ngsolve

    return ngsolve.sqrt(ngsolve.InnerProduct(point, point) + TINY**2)


def length(*values: Any) -> Any:
    """Return the smoothed length √(a² + b² + … + ε²) of numbers, arrays or coefficient functions."""
    total = sum(value * value for value in values) + TINY**2
    if isinstance(total, float | np.ndarray):
        return np.sqrt(total)
    import ngsolve

    return ngsolve.sqrt(total)


def where_positive(condition: Any, then: Any, otherwise: Any) -> Any:
    """Return `then` where the condition is above zero, else the other."""
    if isinstance(condition, float | np.ndarray):
        return np.where(condition > 0, then, otherwise)
    import ngsolve

    return ngsolve.IfPos(condition, then, otherwise)


def positive(value: Any) -> Any:
    """Return the value where it is above zero, else zero."""
    return where_positive(value, value, 0.0)


def absolute(value: Any) -> Any:
    """Return the value without its sign."""
    return where_positive(value, value, -value)


def larger(first: Any, second: Any) -> Any:
    """Return the larger of two values."""
    return where_positive(first - second, first, second)


class Tool:
    """Base of tools, which are frozen dataclasses: a convex rigid shape in its own frame.

    The origin is the tool's centre, and the foremost point is (0, 0, −front).
    """

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        raise NotImplementedError

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3): max n·y over the tool; infinite along its shaft."""
        raise NotImplementedError

    @property
    def front(self) -> float:
        """Distance in m from the centre to the foremost point."""
        raise NotImplementedError

    @property
    def least_radius(self) -> float:
        """Least radius of curvature in m of what may touch: that of the edge, where there is one."""
        raise NotImplementedError

    @property
    def size(self) -> float:
        """Length in m that elements and steps are measured by: the radius, or half of a face's shorter side."""
        raise NotImplementedError

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and along y of the cut at a depth in m above the foremost point."""
        raise NotImplementedError

    @property
    def inscribed_radius(self) -> float:
        """Radius in m of a ball around the centre that is all within the tool."""
        return self.front

    def gradient(self, points: np.ndarray) -> np.ndarray:
        """Return the distance's gradient (N, 3) at points (N, 3) in m, by central differences."""
        steps = STEP * self.front * np.eye(3)
        changes = [self.distance(points + step) - self.distance(points - step) for step in steps]
        return np.asarray(np.stack(changes, axis=-1) / (2 * STEP * self.front))

    def keeps(self, matrix: np.ndarray) -> bool:
        """Return whether an isometry (3, 3) that leaves the axis z leaves the shape as it is: by its distance."""
        points = self.front * np.random.default_rng(0).normal(size=(SAMPLES, 3))
        return bool(
            np.allclose(self.distance(points), self.distance(points @ matrix.T), atol=SAME * self.front)
        )

    def describe(self) -> dict[str, Any]:
        """Return the shape as plain data for a JSON file, with its ``"type"``."""
        return {"type": type(self).__name__, **asdict(self)}  # type: ignore[call-overload]  # a subclass is a dataclass
