"""The structured Gauss–Newton posterior of a refined network, and the way back to the filter.

Laplace's approximation at the refined parameters (MacKay 1992), with noise of variance s_j² on output j, prior
precision λ/s_j² on its coefficients (the ridge) and Λ on the units' numbers θ. All outputs have the same
regressors Φ, so in the joint precision matrix the coefficients' blocks are (ΦᵀΦ + λ)/s_j², and with
J_j = D ∘ w_j, D = ∂φ_k/∂θ_k, Schur's complement leaves

    M = (ΦᵀΦ + λ)⁻¹                                 coefficients given the units, in units of s_j²
    P_θ = ((Dᵀ(I − Φ M Φᵀ) D) ∘ (W S⁻² Wᵀ) + Λ)⁻¹     units, coefficients integrated out
    B = M Φᵀ D                                      how coefficients follow the units

    var f_j(x) = s_j² φ̃ᵀ M φ̃ + Σ_kl w_kj w_lj e_k P_kl e_lᵀ,   e = ∂φ̃/∂θ − φ̃ᵀ B

exactly what the dense joint posterior says, with c² + (h p)² + c h p numbers for any number of outputs: megabytes
where the dense one takes hundreds. B and the derivatives are kept by the entries of A_k and b_k, of which θ_k's are a
linear chain.

`posterior` makes a state of the filter of it, from which learning goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from palpate.errors import UsageError
from palpate.network import Network
from palpate.network.uncertainty import Uncertainty
from palpate.rbf.filter.covariance import Blocks, Covariance, Full, NoCovariance, Shared
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State, initial
from palpate.rbf.forms import Form, chain_of
from palpate.rbf.refinement.refine import Refined
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import Regressors
from palpate.rbf.sample_checks import numbers, samples

__all__ = ["Posterior", "posterior"]


def _inverse(information: np.ndarray) -> np.ndarray:
    """Symmetric inverse of a positive definite information matrix whatever the data left open."""
    if not information.size:
        return information
    scale = 1.0 / np.sqrt(np.diag(information))
    scaled = information * scale[:, None] * scale
    try:
        covariance = cho_solve(cho_factor(scaled), np.eye(len(scaled)))
    except LinAlgError:
        # directions that the data do not see to working precision get the variance of what they barely see
        values, V = np.linalg.eigh(scaled)
        covariance = (V / np.maximum(values, 1e-14 * values[-1])) @ V.T
    covariance = covariance * scale[:, None] * scale
    return np.asarray((covariance + covariance.T) / 2)


_LEAST_RIDGE = 1e-14  # ridge over the sum of weights: coinciding units would leave no inverse
_LEAST_NOISE = 1e-16  # mean square of scaled outputs that is round-off


@dataclass(frozen=True, eq=False)
class Posterior:
    """A Gaussian over the parameters of a refined network, in scaled quantities.

    Attributes
    ----------
    refined : Refined
        Its mean: h units of p numbers, c = p_t + h regressors, m outputs.
    noise : (m,)
        s_j².
    coefficients : (c, c)
        M; output j's coefficients have covariance s_j² M while units rest.
    shapes : (h p, h p)
        P_θ.
    chain : (h, e + r, p)
        ∂(entries of A_k, b_k)/∂θ_k.
    through : (c, h (e + r))
        B by the entries of A and b, of which the units' numbers make one chain.
    """

    refined: Refined
    noise: np.ndarray
    coefficients: np.ndarray
    shapes: np.ndarray
    chain: np.ndarray
    through: np.ndarray

    @classmethod
    def of(
        cls,
        refined: Refined,
        X: np.ndarray,
        Y: np.ndarray | None = None,
        *,
        noise: np.ndarray | None = None,
        prior: float | np.ndarray = 1.0,
        ridge: float | np.ndarray = 0.0,
        weights: np.ndarray | None = None,
        slope_weight: float | np.ndarray | None = None,
        curvature_weight: float | np.ndarray | None = None,
    ) -> Posterior:
        """The posterior from the samples that the network was refined on.

        Parameters
        ----------
        refined : Refined
            The network whose parameters are the mean.
        X : (N, n)
            Scaled inputs.
        Y : (N, m), optional
            Scaled outputs, from whose residuals the noise is estimated where it is not given.
        noise : (m,), optional
            s_j². Estimated, it is the mean squared residual over the degrees of freedom left, not below
            round-off.
        prior : float or (p,)
            Prior variances of a unit's numbers.
        ridge : float or (c,)
            λ, tail first; the refinement's is its own ridge times the sum of the weights, on the units' weights.
        weights : (N,), optional
            As in `refine`.
        slope_weight : float, (N,) or (N, n), optional
            As in `refine`, if slopes were given there.
        curvature_weight : float, (N,) or (N, n(n+1)/2), optional
            As in `refine`, if curvatures were given there.

        Raises
        ------
        UsageError
            If there is neither noise nor Y, shapes disagree, or a variance is not positive.
        """
        r, h = refined.regressors, len(refined.theta)
        entries = Regressors(cast(Form, _Entries(r.form)), r.radial, r.tail)
        m = refined.coefficients.shape[1]
        shares = {"slope_weight": slope_weight, "curvature_weight": curvature_weight}
        rows = Rows.blank(entries, X, weights=weights, **shares)
        noise = _noise(refined, X, Y, weights) if noise is None else numbers("Noise variances", noise, (m,))
        if not ((noise > 0).all() and _positive(prior) and (np.asarray(ridge) >= 0).all()):
            raise UsageError(
                f"Noise {noise}, prior {prior} and ridge {ridge} make no Gaussian.",
                why="Variances are positive, and a ridge is not negative.",
                fix="Leave the noise out to have it estimated from Y.",
            )
        theta = _entries(refined)
        F, D = rows.matrix(theta), rows.derivatives(theta)
        penalty = np.maximum(np.broadcast_to(ridge, F.shape[1]), _LEAST_RIDGE * rows.total)
        M = _inverse(F.T @ F + np.diag(penalty))
        B = M @ (F.T @ D)
        # Dᵀ(I − Φ M Φᵀ)D as a sum of squares, so that round-off can't make it indefinite
        outside = np.vstack([D - F @ B, np.sqrt(penalty)[:, None] * B])
        chain = chain_of(refined.regressors.form, refined.theta)
        information = _shape_information(outside, chain, (refined.weights / noise) @ refined.weights.T)
        size = chain.shape[2]
        information += np.diag(np.tile(1.0 / np.broadcast_to(prior, size), h))
        return cls(refined, noise, M, _inverse(information), chain, B)

    def uncertainty(self, network: Network) -> Uncertainty:
        """The predictive variance of the network value made of this refinement.

        The units' numbers are replaced by the factors' own entries: evaluation then needs no form.
        """
        h, q, p = self.chain.shape
        root = np.linalg.cholesky(self.shapes) if h else np.zeros((0, 0))
        lifted = (self.chain @ root.reshape(h, p, h * p)).reshape(h * q, h * p)
        form = self.refined.regressors.form
        pattern = np.stack([form.rows, form.columns])
        return Uncertainty(network, self.noise, self.coefficients, lifted, self.through, pattern)


class _Entries:
    """Units whose numbers are the entries of A on a form's pattern, and b: as much of a form as regressors ask."""

    def __init__(self, form: Form) -> None:
        self.name, self.inputs, self.rank = "entries", form.inputs, form.rank
        self.rows, self.columns = form.rows, form.columns
        self.size = form.rows.size + form.rank

    def factors(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        A = np.zeros((len(theta), self.rank, self.inputs))
        A[:, self.rows, self.columns] = theta[:, : self.rows.size]
        return A, theta[:, self.rows.size :]

    def pull(self, theta: np.ndarray, by_entry: np.ndarray, by_shift: np.ndarray) -> np.ndarray:
        return np.concatenate([by_entry, by_shift], axis=-1)


def _entries(refined: Refined) -> np.ndarray:
    """The units' numbers (h, e + r) as `_Entries` has them."""
    form = refined.regressors.form
    A, b = form.factors(refined.theta)
    return np.hstack([A[:, form.rows, form.columns], b])


def _shape_information(outside: np.ndarray, chain: np.ndarray, shared: np.ndarray) -> np.ndarray:
    """(chainᵀ outsideᵀ outside chain) ∘ shared (h p, h p), the latter (h, h) unit by unit."""
    h, q, p = chain.shape
    pulled = np.einsum("nkq,kqp->nkp", outside.reshape(len(outside), h, q), chain, optimize=True)
    flat = pulled.reshape(len(outside), h * p)
    G = flat.T @ flat
    return np.asarray((G.reshape(h, p, h, p) * shared[:, None, :, None]).reshape(h * p, h * p))


def _noise(refined: Refined, X: np.ndarray, Y: np.ndarray | None, weights: np.ndarray | None) -> np.ndarray:
    """s_j² (m,) from the residuals; the units' numbers are shared by all outputs."""
    if Y is None:
        raise UsageError(
            "A posterior needs the noise or the outputs to find it from.", fix="Pass Y or noise."
        )
    n, m = refined.regressors.form.inputs, refined.coefficients.shape[1]
    X, Y, w, _, _ = samples(X, Y, weights, inputs=n, outputs=m)
    X, Y, w = X[w > 0], Y[w > 0], w[w > 0]
    squares = (w[:, None] * (Y - refined.predict(X)) ** 2).sum(axis=0)
    fitted = len(refined.coefficients) + refined.theta.size / m
    left = max(1.0 - fitted / w.sum(), 0.02)  # a network of as many numbers as samples says nothing of noise
    return np.asarray(np.maximum(squares / (w.sum() * left), _LEAST_NOISE))


def _positive(variances: float | np.ndarray) -> bool:
    """True where all are positive and finite."""
    found = np.asarray(variances, float)
    return bool(((found > 0) & np.isfinite(found)).all())


_RowWeights = dict[str, Any]  # weights of values, slopes and curvatures, as `Rows.blank` takes them


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
        Those of the filter that goes on; their noise and prior variances count.
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


def _full(mean: State, refined: Refined, X: np.ndarray, given: _RowWeights, settings: Settings) -> Covariance:
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
    return Full(np.asfortranarray(_variance(refined, settings) * _inverse(information)), a)


def _blocks(
    mean: State, refined: Refined, X: np.ndarray, given: _RowWeights, settings: Settings
) -> Covariance:
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
        units[k] = _inverse(information / variance + np.diag(prior[mean.block(k)]))
    return Blocks(_inverse(np.kron(np.eye(m), tail.T @ tail) / variance + np.diag(prior[:a])), units)


def _rows(refined: Refined, X: np.ndarray, given: _RowWeights) -> tuple[np.ndarray, np.ndarray]:
    """Weighted regressors (R, p_t + h) and ∂φ_k/∂θ_k (R, h p) of values and slopes."""
    rows = Rows.blank(refined.regressors, X, **given)
    return rows.matrix(refined.theta), rows.derivatives(refined.theta)


def _shared(
    mean: State, refined: Refined, X: np.ndarray, given: _RowWeights, settings: Settings
) -> Covariance:
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


def _nothing(
    mean: State, refined: Refined, X: np.ndarray, given: _RowWeights, settings: Settings
) -> Covariance:
    return NoCovariance()


_COVARIANCES: dict[str, Callable[[State, Refined, np.ndarray, _RowWeights, Settings], Covariance]] = {
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
