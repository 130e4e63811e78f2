"""Radial basis functions through the forces of palpate's own solves, component by component (SciPy).

They go over the ball's place, or over coordinates of the surface: the place (x, y) of its nearest point, and the depth
below it. There the components are those along the surface's normal and two tangents, plain or over Hertz's d^1.5. The
kernel and its width are those that best predict every fifth solve from the others.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from . import palpate_surrogate
from .palpate_surrogate import LEARNT

__all__ = ["load", "settings_of"]

FOLDS = 5
KERNELS: tuple[tuple[str, float], ...] = (
    *((kernel, 1.0) for kernel in ("linear", "thin_plate_spline", "cubic")),
    *((kernel, width) for kernel in ("gaussian", "multiquadric") for width in (0.25, 0.5, 1.0, 2.0)),
)
OVER = {"place": "", "surface": ", along the surface", "law": ", along the surface, over Hertz's law"}
POWER = 1.5  # of the depth, in Hertz's law
LEAST = 1e-4  # m: a solve less deep says little of the ratio to that law
CLOSE = 12  # points of the surface around a place whose triangles are searched for the nearest one


class _Surface:
    """Coordinates (x, y, depth) of places above the touched surface of a body, and axes along it."""

    def __init__(self, case: Any) -> None:
        from scipy.spatial import cKDTree

        from ..bodies import touched

        self._patch, self._radius = touched(case.name), case.radius
        numbers = np.unique(self._patch.triangles)
        self._tree, self._numbers = cKDTree(self._patch.points[numbers]), numbers
        self._around: list[list[int]] = [[] for _ in self._patch.points]
        for row, corners in enumerate(self._patch.triangles.tolist()):
            for corner in corners:
                self._around[corner].append(row)

    def __call__(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates (n, 3) in m, and axes (n, 3, 3): the normal and two tangents in rows."""
        coordinates, axes = np.empty((len(places), 3)), np.empty((len(places), 3, 3))
        for i, place in enumerate(places):
            surface, normal, distance = self._near(place).nearest(place)
            coordinates[i] = *surface[:2], self._radius - distance
            tangent = np.cross([0.0, 1.0, 0.0], normal)  # touched surfaces look up: never along y
            tangent /= np.linalg.norm(tangent)
            axes[i] = normal, tangent, np.cross(normal, tangent)
        return coordinates, axes

    def _near(self, place: np.ndarray) -> Any:
        close = self._tree.query(place, k=min(CLOSE, len(self._numbers)))[1]
        rows = sorted({row for number in self._numbers[close] for row in self._around[number]})
        part = type(self._patch)(self._patch.points, self._patch.triangles[rows])
        part.__dict__["node_normals"] = (
            self._patch.node_normals
        )  # those of the whole surface, at the part's rim too
        return part


class _Interpolated:
    def __init__(self, places: np.ndarray, forces: np.ndarray, over: str, surface: _Surface | None) -> None:
        self._surface, self._over, self.solves = surface, over, len(places)
        inputs, values = places, forces
        if surface is not None:
            inputs, axes = surface(places)
            kept = inputs[:, 2] > LEAST
            values = np.einsum("nij,nj->ni", axes, forces) / self._law(inputs)[:, None]
            inputs, values = inputs[kept], values[kept]
        self._low, self._width = inputs.min(axis=0), np.ptp(inputs, axis=0)
        fold = np.arange(len(inputs)) % FOLDS

        def error(choice: tuple[str, float]) -> float:
            squares = 0.0
            for k in range(FOLDS):
                model = self._fit(inputs[fold != k], values[fold != k], *choice)
                left = model(self._scale(inputs[fold == k])) - values[fold == k]
                squares += float(((left * self._law(inputs[fold == k])[:, None]) ** 2).sum())
            return squares

        kernel, width = min(KERNELS, key=error)
        self._model = self._fit(inputs, values, kernel, width)
        wide = f" of width {width:g}" if kernel in {"gaussian", "multiquadric"} else ""
        self.settings = f"{len(places)} solves, {kernel}{wide}{OVER[over]}"

    def _law(self, inputs: np.ndarray) -> np.ndarray:
        """Return what forces at coordinates are divided by, so that the rest is of the size of one."""
        if self._over != "law":
            return np.ones(len(inputs))
        return np.asarray((np.maximum(inputs[:, 2], 0.0) / 1e-3) ** POWER)

    def _scale(self, inputs: np.ndarray) -> np.ndarray:
        return np.asarray((inputs - self._low) / self._width)

    def _fit(self, inputs: np.ndarray, values: np.ndarray, kernel: str, width: float) -> Callable[..., Any]:
        from scipy.interpolate import RBFInterpolator

        model: Callable[..., Any] = RBFInterpolator(
            self._scale(inputs), values, kernel=kernel, epsilon=1.0 / width, smoothing=1e-10
        )
        return model

    def force(self, places: np.ndarray) -> np.ndarray:
        if self._surface is None:
            return np.asarray(self._model(self._scale(places)))
        inputs, axes = self._surface(places)
        values = self._model(self._scale(inputs)) * self._law(inputs)[:, None]
        values[inputs[:, 2] <= 0.0] = 0.0
        return np.asarray(np.einsum("nij,ni->nj", axes, values))


def settings_of(case: Any) -> list[dict[str, Any]]:
    """Return all coordinates with all numbers of solves."""
    counts = palpate_surrogate.settings_of(case)
    return counts + [{**count, "over": over} for over in list(OVER)[1:] for count in counts]


def load(case: Any, solves: int | None = None, over: str = "law") -> _Interpolated:
    """Return the interpolation of so many solves, by default of the most."""
    count = palpate_surrogate.settings_of(case)[-1]["solves"] if solves is None else solves
    rows = np.loadtxt(LEARNT / f"{case.name}-{count}.csv", delimiter=",", skiprows=1)
    return _Interpolated(rows[:, :3], rows[:, 3:6], over, None if over == "place" else _Surface(case))
