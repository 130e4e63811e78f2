"""How far a filter's own prediction may be off, by its own covariance.

    var f_j(x) = h_j(x) P h_j(x)ᵀ + R,   h_j = ∂f_j/∂z

P is what the filter believes of its parameters: under the block rules zero between blocks, under the shared-weight
rule P_φ for each output's coefficients beside P_θ for the shapes. R is the floor of the measurement noise or the
guarded share of the running mean square of the innovation, whichever is larger, without the edge factor, which
weighs samples and is no noise. Nothing here is calibrated: a filter is sure of itself where its linearisation is
wrong, and blocks without the correlations between units that overlap say far too much.
"""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.rbf.filter.covariance import Blocks, Full, Shared, triangle
from palpate.rbf.filter.model import jacobian, regressors_at
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = ["predictive_deviation", "predictive_variance"]

_CHUNK = 64  # points at a time: memory stays at 64 m d numbers


def predictive_deviation(state: State, X: np.ndarray, settings: Settings) -> np.ndarray:
    """Standard deviation (N, m) of what would be measured at X (N, n), all scaled.

    Raises
    ------
    UsageError
        If the update rule keeps no covariance.
    """
    r = max(settings.noise, settings.noise_share * state.innovation)
    return np.asarray(np.sqrt(np.maximum(predictive_variance(state, X, settings), 0.0) + r))


def predictive_variance(state: State, X: np.ndarray, settings: Settings) -> np.ndarray:
    """Variance h P hᵀ (N, m) of the network's outputs at X (N, n), all scaled.

    Raises
    ------
    UsageError
        If the update rule keeps no covariance.
    """
    X, P = np.asarray(X, float), state.covariance
    parts = [X[i : i + _CHUNK] for i in range(0, len(X), _CHUNK)]
    if isinstance(P, Shared):
        found = [_shared(state, P, part, settings) for part in parts]
    elif isinstance(P, (Full, Blocks)):
        found = [_joint(state, P, part, settings) for part in parts]
    else:
        raise UsageError(
            "The gradient rule has no predictive variance.",
            why="It keeps no covariance of its parameters.",
            fix='Choose another update rule, such as update="full".',
        )
    return np.vstack([np.zeros((0, state.outputs)), *found])


def _joint(state: State, P: Full | Blocks, X: np.ndarray, settings: Settings) -> np.ndarray:
    rows = np.vstack([jacobian(state, Observation(x, np.zeros(state.outputs)), settings)[1] for x in X])
    found = np.einsum("qd,dq->q", rows, P.times(rows.T))
    return np.asarray(found.reshape(len(X), state.outputs))


def _shared(state: State, P: Shared, X: np.ndarray, settings: Settings) -> np.ndarray:
    row = regressors_at(state, X, settings)
    linear = np.einsum("nc,cn->n", row, triangle.product(P.regressors, row.T))[:, None]
    if not state.units:
        return np.tile(linear, (1, state.outputs))
    D = settings.regressors(state.inputs).by_theta(X, state.theta)[1]
    _, h, p = D.shape
    shapes = triangle.symmetric(P.shapes).reshape(h, p, h, p)
    # how the units' activations vary together, (N, h, h)
    together = np.einsum("nkla,nla->nkl", np.einsum("nkb,kbla->nkla", D, shapes, optimize=True), D)
    W = state.weights
    return np.asarray(linear + ((together @ W) * W).sum(axis=1))
