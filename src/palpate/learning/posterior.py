"""From a refined network back to the filter: the Gauss–Newton posterior, from which learning goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from palpate.errors import UsageError
from palpate.learning.covariance import Blocks, Covariance, Full, Nothing, Shared
from palpate.learning.laplace import Posterior
from palpate.learning.model import jacobian
from palpate.learning.observation import Observation
from palpate.learning.refine import Refined
from palpate.learning.regressors import Regressors
from palpate.learning.settings import Settings
from palpate.learning.state import State, initial

__all__ = ["posterior"]


def posterior(
    refined: Refined, X: np.ndarray, settings: Settings, *, modes: np.ndarray | None = None
) -> State:
    """The filter's state that a refined network stands for.

    With the rows H_i = ∂f(x_i)/∂z of all samples, P₀ the settings' prior and r the mean squared residual, not
    below the settings' noise,

    - the full filter gets P = (Σ_i H_iᵀ H_i / r + P₀⁻¹)⁻¹: for a linear model, the covariance that it reaches
      itself after the same samples;
    - the decoupled and the winner rule get the inverses of that matrix's diagonal blocks;
    - the shared-weight rule gets r (ΦᵀΦ + r P₀⁻¹)⁻¹ and the shapes' part of the structured posterior (see
      `laplace`), which cost (p_t + h)² + (h p)² numbers.

    Parameters
    ----------
    refined : Refined
        With h units, n inputs, m outputs; units and tail must be of the settings' kind.
    X : (N, n)
        Scaled inputs it was refined on.
    settings : Settings
    modes : (m, r), optional
        Orthonormal output directions for the shared-weight rule.

    Returns
    -------
    State

    Raises
    ------
    UsageError
        If the settings' units or tail are of another kind than the refined network's.
    """
    theta, m, n = refined.theta, refined.coefficients.shape[1], X.shape[1]
    if _kind(settings.regressors(n)) != _kind(refined.regressors):
        r = refined.regressors
        raise UsageError(
            f"The network has {r.form.name} {r.radial} units and tail {r.tail}; the filter's settings differ.",
            fix=f"Use settings with form={r.form.name!r}, radial={r.radial!r}, tail={r.tail!r}.",
        )
    mean = replace(
        initial(n, m, settings, modes),
        coefficients=refined.coefficients,
        theta=theta,
        places=refined.regressors.form.centres(theta),
        silent=np.zeros(len(theta), dtype=np.int64),
        count=len(X),
        innovation=refined.rms**2,
        in_modes=None if modes is None else refined.coefficients @ modes,
    )
    return replace(mean, covariance=_COVARIANCES[settings.update](mean, refined, X, settings))


def _kind(r: Regressors) -> tuple[object, ...]:
    return r.form.name, r.form.inputs, getattr(r.form, "log", None), r.radial, r.tail


def _full(mean: State, refined: Refined, X: np.ndarray, settings: Settings) -> Covariance:
    information = np.diag(1.0 / _prior(mean, settings))
    root = 1.0 / np.sqrt(_variance(refined, settings))
    for x in X:
        H = root * jacobian(mean, Observation(x, np.zeros(mean.outputs)), settings)[1]
        information += H.T @ H
    return Full(np.asfortranarray(_inverse(information)), mean.tail.size)


def _blocks(mean: State, refined: Refined, X: np.ndarray, settings: Settings) -> Covariance:
    r, m, a = refined.regressors, mean.outputs, mean.tail.size
    tail = np.kron(np.eye(m), r.tail_rows(X).T @ r.tail_rows(X))
    phi, D = r.by_theta(X, mean.theta)
    b, prior, variance = mean.unit_size, 1.0 / _prior(mean, settings), _variance(refined, settings)
    units = np.empty((mean.units, b, b))
    for k, w in enumerate(mean.weights):
        across = np.outer(w, phi[:, k] @ D[:, k])
        information = np.block(
            [
                [(phi[:, k] @ phi[:, k]) * np.eye(m), across],
                [across.T, (w @ w) * (D[:, k].T @ D[:, k])],
            ]
        )
        units[k] = _inverse(information / variance + np.diag(prior[mean.block(k)]))
    return Blocks(_inverse(tail / variance + np.diag(prior[:a])), units)


def _shared(mean: State, refined: Refined, X: np.ndarray, settings: Settings) -> Covariance:
    variance = _variance(refined, settings)
    prior = np.r_[
        np.full(refined.regressors.tail_size, settings.tail_prior), np.full(mean.units, settings.prior)
    ]
    found = Posterior.of(
        refined,
        X,
        noise=np.full(mean.outputs, variance),
        ridge=variance / prior,
        prior=_shape_prior(mean, settings),
    )
    return Shared(np.asfortranarray(variance * found.coefficients), np.asfortranarray(found.shapes))


def _nothing(mean: State, refined: Refined, X: np.ndarray, settings: Settings) -> Covariance:
    return Nothing()


_COVARIANCES: dict[str, Callable[[State, Refined, np.ndarray, Settings], Covariance]] = {
    "full": _full,
    "decoupled": _blocks,
    "winner": _blocks,
    "shared": _shared,
    "gradient": _nothing,
}


def _variance(refined: Refined, settings: Settings) -> float:
    return max(settings.noise, refined.rms**2)


def _inverse(information: np.ndarray) -> np.ndarray:
    if not information.size:
        return information
    covariance = np.asarray(cho_solve(cho_factor(information), np.eye(len(information))))
    return (covariance + covariance.T) / 2


def _shape_prior(state: State, settings: Settings) -> np.ndarray:
    """Prior variances (p,) of a unit's shape."""
    return settings.regressors(state.inputs).form.variances(settings.prior, settings.width_prior)


def _prior(state: State, settings: Settings) -> np.ndarray:
    """Prior variances (d,) of the parameters."""
    unit = np.concatenate([np.full(state.outputs, settings.prior), _shape_prior(state, settings)])
    return np.concatenate([np.full(state.tail.size, settings.tail_prior), np.tile(unit, state.units)])
