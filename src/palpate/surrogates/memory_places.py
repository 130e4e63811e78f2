"""Places of the touched surface that remember, laid out over the mesh of a field."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates.memories import Patches
from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.surrogates.energy import LearntEnergy
    from palpate.surrogates.fields import FieldSurrogate

__all__ = ["memory_places"]

_SAMPLES = 4096  # places in the trained ranges, among which a typical press is found


def memory_places(energy: LearntEnergy, shown: FieldSurrogate | None, spacing: float) -> Patches:
    """Return places of a touched surface, `spacing` (m) apart, of the size that a typical press has.

    `shown` is a field on that surface; a body without one is refused.
    """
    baseline = energy.baseline
    if shown is None or baseline.surface is None:
        raise UsageError(
            "This body has no drawn surface to keep a memory on.",
            why="Places that remember are laid out over the mesh of a field.",
            fix="Learn it with its shape, or leave `spacing` out.",
        )
    corners = shown.triangles
    if shown.local_mode is not None:
        corners = corners[shown.touched[corners].all(axis=1)]
    depth, typical = _typical_press(energy)
    own = baseline.radius_input
    radius = baseline.radius if own is None else (energy.inputs[own].low + energy.inputs[own].high) / 2.0
    width = Patches.width_at(radius, depth)
    return Patches.over(shown.points, corners, spacing, width=width, energy=typical)


def _typical_press(energy: LearntEnergy) -> tuple[float, float]:
    """Return half the deepest trained depth, m, and the energy of a press to about there, J."""
    low, high = bounds(energy.inputs)
    X = np.random.default_rng(0).uniform(low, high, (_SAMPLES, len(low)))
    X = X[energy.inside(X)]
    s, deepest = energy.depth(X), energy.going.deepest
    depth = (deepest if np.isfinite(deepest) else float(s.max())) / 2.0
    near = int(np.argmin(np.abs(s - depth)))
    return depth, float(energy.energy(X[near : near + 1])[0])
