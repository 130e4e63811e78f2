"""The effort G = −∂U/∂w with which a body pushes two jaws apart, w their opening.

It is a fourth-order difference of the learnt energy: over a way of a few micrometres that leaves 1e-9 of the effort.
"""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates.arguments import rows_of
from palpate.surrogates.energy import LearntEnergy
from palpate.tools.gripper import OPENING

__all__ = ["efforts"]

STEP = 2e-6  # m
WAYS = ((1, -8.0), (-1, 8.0), (2, 1.0), (-2, -1.0))  # steps and weights of minus the slope, over 12


def efforts(energy: LearntEnergy, X: np.ndarray) -> np.ndarray:
    """Return G (N,) in N at inputs X (N, 4); a body without an opening is refused."""
    names = [r.name for r in energy.inputs]
    if OPENING not in names:
        raise UsageError(
            "This body has no effort of jaws.",
            why=f"Its inputs are {', '.join(names)}; an effort belongs to an opening.",
            fix="Sweep under a pp.Pinch, and learn from that.",
        )
    rows, way = rows_of(X, energy.inputs, "learnt body"), np.zeros(len(names))
    way[names.index(OPENING)] = STEP
    return np.asarray(sum(weight * energy.energy(rows + many * way) for many, weight in WAYS) / (12 * STEP))
