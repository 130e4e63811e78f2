"""Smooth maps with known answers, for tests of learning."""

from __future__ import annotations

import numpy as np

from palpate.learning import Settings
from palpate.units import Quantity, Range

INPUT = (Range("x", 0.0, 5.0, "N"),)
OUTPUTS = tuple(Quantity(f"y{i}", "m") for i in range(3))


def exact(**changes: object) -> Settings:
    """A filter without guards: fixed noise, one linearisation, nothing pruned, nothing grown."""
    plain = {
        "noise": 1e-2,
        "noise_share": 0.0,
        "gate": 0.0,
        "edge_weight": 1.0,
        "iterations": 1,
        "step_bound": 0.0,
        "regression_limit": 0.0,
        "prune_after": 0,
        "error_min": 1e9,
    }
    return Settings(**(plain | changes))  # type: ignore[arg-type]


def stiffening(N: int) -> tuple[np.ndarray, np.ndarray]:
    """Loads (N, 1) and three deflections (N, 3) of a beam-like stiffening map, in closed form."""
    x = np.linspace(0.0, 5.0, N)[:, None]
    return x, np.hstack([np.tanh(0.2 * x), np.arctan(0.5 * x) / 2, 1.0 - np.exp(-0.4 * x)])
