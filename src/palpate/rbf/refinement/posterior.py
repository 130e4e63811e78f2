"""From a refined network back to the filter: the Gauss–Newton posterior, from which learning goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.rbf.filter.covariance import Blocks, Covariance, Full, NoCovariance, Shared
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State, initial
from palpate.rbf.refinement.inverse import inverse
from palpate.rbf.refinement.laplace import Posterior
from palpate.rbf.refinement.refine import Refined
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.units.regressors import Regressors

__all__ = ["posterior"]

Given = dict[str, Any]  # weights of values, slopes and curvatures, as `Rows.blank` takes them


def posterior(
    refined: Refined,
    X: np.ndarray,
    settings: Settings,
    *,
    modes: np.ndarray | None = None,
    weights: np.ndarray | None = None,
    slope_weight: float | np.ndarray | None = None,
    curvature_weight: float | np.ndarray | None = None,
) -> State:
    """The filter's state that a refined network stands for.

    With the rows H_i = ∂f(x_i)/∂z of all samples and of their slopes, P₀ the settings' prior and r the mean
    squared residual, not below the settings' noise,

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
    weights : (N,), optional
        How many ordinary samples each one counts as.
    slope_weight : float, (N,) or (N, n), optional
        As in `refine`, if slopes were given there: their rows ∂²f/∂z∂x count as the values' do.
    curvature_weight : float, (N,) or (N, n(n+1)/2), optional
        The same for curvatures.

    Returns
    -------
    State

    Raises
    ------
    UsageError
        If the settings' units or tail are of another kind than the refined network's, or the samples do not fit.
    """
    theta, m, n = refined.theta, refined.coefficients.shape[1], refined.regressors.form.inputs
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
        mode_coefficients=None if modes is None else refined.coefficients @ modes,
    )
    given = {"weights": weights, "slope_weight": slope_weight, "curvature_weight": curvature_weight}
    return replace(mean, covariance=_COVARIANCES[settings.update](mean, refined, X, given, settings))


def _kind(r: Regressors) -> tuple[object, ...]:
    return r.form.name, r.form.inputs, getattr(r.form, "log", None), r.radial, r.tail


def _full(mean: State, refined: Refined, X: np.ndarray, given: Given, settings: Settings) -> Covariance:
    m, h, a, p = mean.outputs, mean.units, mean.tail.size, mean.theta.shape[1]
    F, D = _rows(refined, X, given)
    FF, FD = F.T @ F, F.T @ D
    unit = a + np.arange(h)[:, None] * mean.unit_size
    by_theta = (unit + m + np.arange(p)).ravel()
    information = np.diag(1.0 / _prior(mean, settings)) * _variance(refined, settings)
    for j, weights in enumerate(mean.weights.T):  # the outputs meet only through the units' shapes
        by_coefficient = np.r_[j * (a // m) + np.arange(a // m), (unit + j).ravel()]
        across = FD * np.repeat(weights, p)
        information[np.ix_(by_coefficient, by_coefficient)] += FF
        information[np.ix_(by_coefficient, by_theta)] = across
        information[np.ix_(by_theta, by_coefficient)] = across.T
    shapes = (D.T @ D).reshape(h, p, h, p) * (mean.weights @ mean.weights.T)[:, None, :, None]
    information[np.ix_(by_theta, by_theta)] += shapes.reshape(h * p, h * p)
    return Full(np.asfortranarray(_variance(refined, settings) * inverse(information)), a)


def _blocks(mean: State, refined: Refined, X: np.ndarray, given: Given, settings: Settings) -> Covariance:
    m, a, p = mean.outputs, mean.tail.size, mean.theta.shape[1]
    F, D = _rows(refined, X, given)
    p_t = F.shape[1] - mean.units
    tail, phi = F[:, :p_t], F[:, p_t:]
    b, prior, variance = mean.unit_size, 1.0 / _prior(mean, settings), _variance(refined, settings)
    units = np.empty((mean.units, b, b))
    for k, weights in enumerate(mean.weights):
        Dk = D[:, k * p : (k + 1) * p]
        across = np.outer(weights, phi[:, k] @ Dk)
        information = np.block(
            [
                [(phi[:, k] @ phi[:, k]) * np.eye(m), across],
                [across.T, (weights @ weights) * (Dk.T @ Dk)],
            ]
        )
        units[k] = inverse(information / variance + np.diag(prior[mean.block(k)]))
    return Blocks(inverse(np.kron(np.eye(m), tail.T @ tail) / variance + np.diag(prior[:a])), units)


def _rows(refined: Refined, X: np.ndarray, given: Given) -> tuple[np.ndarray, np.ndarray]:
    """Weighted regressors (R, p_t + h) and ∂φ_k/∂θ_k (R, h p) of values and slopes."""
    rows = Rows.blank(refined.regressors, X, **given)
    return rows.matrix(refined.theta), rows.derivatives(refined.theta)


def _shared(mean: State, refined: Refined, X: np.ndarray, given: Given, settings: Settings) -> Covariance:
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
        **given,
    )
    return Shared(np.asfortranarray(variance * found.coefficients), np.asfortranarray(found.shapes))


def _nothing(mean: State, refined: Refined, X: np.ndarray, given: Given, settings: Settings) -> Covariance:
    return NoCovariance()


_COVARIANCES: dict[str, Callable[[State, Refined, np.ndarray, Given, Settings], Covariance]] = {
    "full": _full,
    "decoupled": _blocks,
    "winner": _blocks,
    "shared": _shared,
    "gradient": _nothing,
}


def _variance(refined: Refined, settings: Settings) -> float:
    return max(settings.noise, refined.rms**2)


def _shape_prior(state: State, settings: Settings) -> np.ndarray:
    """Prior variances (p,) of a unit's shape."""
    return settings.regressors(state.inputs).form.variances(settings.prior, settings.width_prior)


def _prior(state: State, settings: Settings) -> np.ndarray:
    """Prior variances (d,) of the parameters."""
    unit = np.concatenate([np.full(state.outputs, settings.prior), _shape_prior(state, settings)])
    return np.concatenate([np.full(state.tail.size, settings.tail_prior), np.tile(unit, state.units)])
