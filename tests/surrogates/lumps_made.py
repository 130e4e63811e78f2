"""A learnt contrast made by formula, over the box of `touch_made`."""

from __future__ import annotations

import numpy as np

from palpate.surrogates.lumps import LumpContrast
from palpate.surrogates.lumps.gaussian_sum import GaussianSum
from palpate.surrogates.lumps.lump_room import LumpRoom, skin_of
from palpate.units import Range, bounds
from surrogates.touch_made import BOX

ROOM = LumpRoom(
    np.array([-0.015, -0.015, -0.028]),
    np.array([0.015, 0.015, -0.010]),
    Range("radius", 0.004, 0.008, "m"),
    Range("ratio", 1.0, 10.0),
    0.001,
    skin_of(
        0.05 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    ),
)


def contrast(seed: int = 0) -> LumpContrast:
    """Return a contrast of some per cent for a lump below the ball: smooth random units on a falling power."""
    offsets = [Range(f"o_{axis}", -0.04, 0.04, "m") for axis in "xyz"]
    inputs = (*BOX, *offsets, Range("ln r", float(np.log(0.004)), float(np.log(0.008))))
    low, high = bounds(inputs)
    rng = np.random.default_rng(seed)

    def part(constant: float) -> GaussianSum:
        return GaussianSum(
            (low + high) / 2,
            (high - low) / 2,
            centres=rng.uniform(-1, 1, (20, 7)),
            widths=rng.uniform(1.5, 2.5, 7),
            weights=rng.normal(0, 0.1, 20),
            tail=np.array([constant, *rng.uniform(-0.05, 0.05, 7)]),
        )

    # (r/|o|)³ |o|⁻¹ of a lump of 6 mm at 25 mm, and of that a few per cent
    return LumpContrast(part(-4.2), part(-1.2), 4.0, 0.14, ROOM)
