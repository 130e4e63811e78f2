"""Radial basis functions through the forces of palpate's own solves, component by component (SciPy).

The kernel and its width are those that best predict every fifth solve from the others.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .palpate_surrogate import LEARNT, settings_of

__all__ = ["load", "settings_of"]

FOLDS = 5
KERNELS: tuple[tuple[str, float], ...] = (
    *((kernel, 1.0) for kernel in ("linear", "thin_plate_spline", "cubic")),
    *((kernel, width) for kernel in ("gaussian", "multiquadric") for width in (0.25, 0.5, 1.0, 2.0)),
)


class _Interpolated:
    def __init__(self, places: np.ndarray, forces: np.ndarray) -> None:
        self._low, self._width = places.min(axis=0), np.ptp(places, axis=0)
        self.solves = len(places)
        fold = np.arange(len(places)) % FOLDS

        def error(choice: tuple[str, float]) -> float:
            squares = 0.0
            for k in range(FOLDS):
                model = self._fit(places[fold != k], forces[fold != k], *choice)
                squares += float(((model(self._scale(places[fold == k])) - forces[fold == k]) ** 2).sum())
            return squares

        kernel, width = min(KERNELS, key=error)
        self._model = self._fit(places, forces, kernel, width)
        wide = f" of width {width:g}" if kernel in {"gaussian", "multiquadric"} else ""
        self.settings = f"{len(places)} solves, {kernel}{wide}"

    def _scale(self, places: np.ndarray) -> np.ndarray:
        return np.asarray((places - self._low) / self._width)

    def _fit(self, places: np.ndarray, forces: np.ndarray, kernel: str, width: float) -> Any:
        from scipy.interpolate import RBFInterpolator

        return RBFInterpolator(
            self._scale(places), forces, kernel=kernel, epsilon=1.0 / width, smoothing=1e-10
        )

    def force(self, places: np.ndarray) -> np.ndarray:
        return np.asarray(self._model(self._scale(places)))


def load(case: Any, solves: int | None = None) -> _Interpolated:
    """Return the interpolation of so many solves, by default of the most."""
    count = settings_of(case)[-1]["solves"] if solves is None else solves
    rows = np.loadtxt(LEARNT / f"{case.name}-{count}.csv", delimiter=",", skiprows=1)
    return _Interpolated(rows[:, :3], rows[:, 3:6])
