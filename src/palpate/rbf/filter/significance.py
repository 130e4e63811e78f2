"""A unit's significance: the mean of what it contributes over all inputs (GAP-RBF, GGAP-RBF).

    E(k) = ‖w_k‖ (∫ φ_k(x)^q p(x) dx)^(1/q)

With inputs uniform over [−1, 1]ⁿ, q = 1 and a Gaussian, the integral over all space is πⁿᐟ²/(|det A| 2ⁿ), taken
in logarithms because it overflows for many inputs (Huang, Saratchandran & Sundararajan 2004, whose 1.8 σ is
√π σ). Elsewhere it is the root mean square over the remembered inputs, q = 2 (the same authors, 2005).
"""

from __future__ import annotations

import math

import numpy as np

from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = ["significance"]


def significance(state: State, theta: np.ndarray, sizes: np.ndarray, settings: Settings) -> np.ndarray:
    """E (k,) of units θ (k, p) with weight norms (k,)."""
    of = settings.regressors(state.inputs)
    if settings.density == "uniform" and of.radial == "gaussian" and of.form.rank == of.form.inputs:
        A = of.form.factors(theta)[0]
        log_share = of.form.inputs * math.log(math.sqrt(math.pi) / 2.0) - np.linalg.slogdet(A)[1]
        return np.asarray(sizes * np.exp(np.minimum(log_share, 700.0)))
    seen = state.seen[:, : state.inputs]
    if not len(seen):
        return sizes
    return np.asarray(sizes * np.sqrt((of.phi(seen, theta) ** 2).mean(axis=0)))
