"""Positions of the probe's centre, from depths pressed at a place."""

from __future__ import annotations

import numpy as np

from palpate.dataset.measured import Measurements
from palpate.errors import UsageError
from palpate.surrogates import TouchedSurface

__all__ = ["probe_positions"]

_STEPS, _HALVINGS = 64, 60


def probe_positions(measured: Measurements, surface: TouchedSurface, radius: float) -> Measurements:
    """Return the record with positions in place of depths.

    A depth of 0 is where the rigid probe, moved through the place along the direction, first meets the surface.

    Records of positions come back as they are.

    Raises
    ------
    UsageError
        If a probe that is moved like that never meets the surface.
    """
    if not measured.pressed:
        return measured
    position = measured.position.copy()
    starts: dict[bytes, np.ndarray] = {}
    for i in np.flatnonzero(np.isfinite(measured.depth)):
        place, direction = measured.position[i], -measured.along[i]
        key = place.tobytes() + direction.tobytes()
        if key not in starts:
            starts[key] = _first_touch(surface, radius, place, direction)
        position[i] = starts[key] + measured.depth[i] * direction
    return Measurements(
        position, measured.force, measured.along, np.full(len(measured), np.nan), measured.time
    )


def _first_touch(
    surface: TouchedSurface, radius: float, place: np.ndarray, direction: np.ndarray
) -> np.ndarray:
    """The first centre on the line, from three radii before the place to one behind it, at a depth of zero."""
    along = np.linspace(-3.0 * radius, radius, _STEPS)
    depths = surface.depth(place + along[:, None] * direction, radius)
    after = int(np.argmax(depths > 0))
    if not depths[after] > 0 or after == 0:
        raise UsageError(
            f"A probe pressed at {np.array2string(1e3 * place, precision=4)} mm along "
            f"{np.array2string(direction, precision=3)} does not meet the surface from outside.",
            why="Depths are counted from the first touch of the model's surface.",
            fix="Give a place on the surface, in the model's frame, and the direction of pressing.",
        )
    low, high = along[after - 1], along[after]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        if surface.depth((place + middle * direction)[None], radius)[0] > 0:
            high = middle
        else:
            low = middle
    return np.asarray(place + high * direction)
