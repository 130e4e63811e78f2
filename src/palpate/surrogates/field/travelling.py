"""What travels with the probe, at any places of the touched surface, of many touches at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.surrogates.field.dimple import Dimple
from palpate.surrogates.field.kernels import profile_into, travelling_into
from palpate.surrogates.field.variation import OFFSETS

__all__ = ["profiling", "travelling_values"]


def profiling(dimple: Dimple | None, deepest: float) -> tuple[Any, ...]:
    """(s*, table, varied, powers, axes, scales, chebyshev, weights): what `profile_into` takes last."""
    table = np.zeros((1, 4, 4)) if dimple is None else dimple.table
    own = None if dimple is None else dimple.variation
    if own is None:
        none = (np.zeros((0, 0)), np.zeros((0, 0), np.int64), np.zeros((0, 3)), np.zeros((2, 0)))
        return deepest, table, *none, np.zeros((0, 2)), np.zeros(4)
    q, m = own.table.shape[:2]
    degrees = np.zeros((own.powers.shape[1], max(int(own.powers.max(initial=0)), 1) + 1))
    known = (own.table.reshape(q * m, -1), own.powers, own.axes, own.scales)
    return deepest, table, *known, degrees, np.zeros(4 + 5 * m)


def travelling_values(dimple: Dimple, deepest: float, touches: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The dimple (N, P, components), f included, as if all points were on the touched surface.

    Parameters
    ----------
    dimple : Dimple
    deepest : float
        s* of the rise, m.
    touches : (N, 8 + p)
        Depth s (m), f, foot (m), normal, further inputs.
    points : (P, 3)
        At rest, m.
    """
    components = 1 if len(dimple.table) == 1 else 3
    known = profiling(dimple, deepest)
    profile = np.zeros((dimple.table.shape[1], OFFSETS, components))
    out, line = np.zeros((len(touches), len(points), components)), np.zeros(OFFSETS * components)
    points, every = np.ascontiguousarray(points), np.arange(len(points))
    for touch, values in zip(np.ascontiguousarray(touches), out, strict=True):
        profile_into(profile, touch, *known)
        travelling_into(values.reshape(-1), touch, profile, line, dimple.reach, every, points)
    return out
