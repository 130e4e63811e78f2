"""The checklist's subjects: every form of unit, every radial function, every rule."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from laws.beams import exact
from palpate.learning import PRESETS, Settings, State, initial
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.rbf.filter.covariance import Blocks, Full, Shared
from palpate.rbf.filter.growth import add_unit

FORMS = ("isotropic", "axis-aligned", "rotated", "rank-1", "rank-2")
RADIAL = RADIAL_FUNCTIONS
COVARIANT = ("full", "decoupled", "winner", "shared")
RULES = tuple(PRESETS)


def populated(n: int, m: int, h: int, settings: Settings, seed: int = 0, modes=None) -> State:
    """A random state with h units and a random symmetric positive definite covariance."""
    rng = np.random.default_rng(seed)
    state = initial(n, m, settings, modes)
    for _ in range(h):
        state = add_unit(state, rng.uniform(-1, 1, n), rng.normal(size=m), settings)
    form = settings.regressors(n).form
    theta = np.array([form.unit(rng.uniform(-1, 1, n), rng.uniform(0.5, 1.5), seed=i) for i in range(h)])
    theta = theta.reshape(h, form.size) + 0.05 * rng.normal(size=(h, form.size))
    coefficients = rng.normal(size=state.coefficients.shape)
    return replace(
        state,
        coefficients=coefficients,
        theta=theta,
        covariance=randomised(state.covariance, rng),
        mode_coefficients=None if modes is None else coefficients @ modes,
    )


def randomised(covariance, rng):
    """The same covariance with random entries, still symmetric positive definite."""

    def positive(P):
        A = rng.normal(size=P.shape)
        return A @ A.swapaxes(-1, -2) / max(P.shape[-1], 1) + np.eye(P.shape[-1])

    match covariance:
        case Full():
            return replace(covariance, lower=np.asfortranarray(positive(covariance.lower)))
        case Blocks():
            return Blocks(positive(covariance.first), positive(covariance.units))
        case Shared():
            return Shared(
                *(np.asfortranarray(positive(P)) for P in (covariance.regressors, covariance.shapes))
            )
    return covariance


def frozen_shapes(state: State) -> State:
    """The state with prior variances I for weights and tail and none for shapes: a linear model."""
    P = state.covariance
    if isinstance(P, Shared):
        return replace(
            state,
            covariance=Shared(np.eye(len(P.regressors), order="F"), np.zeros(P.shapes.shape, order="F")),
        )
    rests = np.ones(state.vector().size)
    for k in range(state.units):
        rests[state.block(k)][state.outputs :] = 0.0
    return replace(state, covariance=Full(np.asfortranarray(np.diag(rests)), state.tail.size))


__all__ = [
    "COVARIANT",
    "FORMS",
    "RADIAL",
    "RULES",
    "exact",
    "frozen_shapes",
    "populated",
    "randomised",
]
