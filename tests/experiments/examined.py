"""A body to be examined: a slab whose energy is known in closed form, with fields, and its surface."""

from __future__ import annotations

import functools

import numpy as np

import pressed
from palpate.experiments.exam_touch import ExamSurface, ExamTouch
from palpate.runtime.touchable import Touchable, touchable


@functools.cache
def slab() -> Touchable:
    return touchable(pressed.surrogate())


def plane(side: float = 0.1, cells: int = 100) -> ExamSurface:
    """A flat square of `side` m that can be pressed everywhere, by a ball of 10 mm to 6 mm."""
    t = np.linspace(-side / 2, side / 2, cells + 1)
    x, y = (v.ravel() for v in np.meshgrid(t, t, indexing="ij"))
    k = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    halves = np.stack([k, k + cells + 1, k + cells + 2], 1), np.stack([k, k + cells + 2, k + 1], 1)
    points = np.stack([x, y, 0.0 * x], axis=1)
    return ExamSurface(points, np.vstack(halves), np.ones(len(points), bool), 0.010, 0.006)


def touch_along(places: np.ndarray, depth: float = 0.004, pause: float = 0.1) -> ExamTouch:
    """Presses at places (k, 2) of a plane, each as long as the lift after it, s, at 1 kHz."""
    ticks = round(1000 * pause)
    at = np.repeat(np.column_stack([places, np.zeros(len(places))]), 2 * ticks, axis=0)
    down = np.tile(np.repeat([1.0, 0.0], ticks), len(places))
    return ExamTouch(1e-3 * np.arange(len(at)), at, depth * down, 2.0 * down)
