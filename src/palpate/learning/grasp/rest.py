"""The stiffness at rest from solves: where ℓ is a quadratic polynomial, which S leaves it the least to explain.

For given S all that is observed is linear in the polynomial's coefficients, so those are the least-squares solution
and only S is searched (variable projection, Golub & Pereyra 1973). A symmetry leaves S the polynomials with
S(ζ') = M S(ζ) Mᵀ, and ℓ those that do not change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.learning.grasp.samples import GraspSamples
from palpate.learning.units.regressors import pairs
from palpate.learning.units.symmetric import Images
from palpate.surrogates.grasp.rest import MOST, RestStiffness, monomials

__all__ = ["found_rest"]

_I, _J = np.triu_indices(3)
_RIDGE = 1e-3  # of the polynomial's coefficients: few solves do not decide all of them
_FIRST = 1e-2  # holds S where the polynomial of ℓ says the same
_FOLDS, _LEAST = 5, 6
_BETTER = 0.9  # of the error left out, for a higher degree
_SEED = 0


@dataclass(frozen=True, eq=False)
class _Fit:
    """S, what it was found with, and the coefficients of ℓ."""

    rest: RestStiffness
    unknowns: np.ndarray
    polynomial: np.ndarray


def found_rest(
    samples: GraspSamples,
    images: Images | None,
    isometries: Sequence[np.ndarray],
    degree: int | None = None,
    **shares: float,
) -> tuple[RestStiffness, dict[int, float]]:
    """S of a degree, or of that whose error on solves left out is least, and those errors by degree."""
    k = len(samples.inputs) - 3
    highest = MOST if k and len(samples) >= _LEAST else 0
    choice = range(highest + 1) if degree is None else [degree]
    fits, errors = {}, {}
    for d in choice:
        search = _Search(d, images, isometries, k, shares)
        fits[d] = search.fitted(samples)
        if len(choice) > 1:
            errors[d] = search.left_out(samples, fits[d].unknowns)
    best = choice[0]
    for d in errors:
        best = d if errors[d] < _BETTER * errors[best] else best
    return fits[best].rest, errors


class _Search:
    """Variable projection over S of one degree."""

    def __init__(
        self,
        degree: int,
        images: Images | None,
        isometries: Sequence[np.ndarray],
        count: int,
        shares: dict[str, float],
    ) -> None:
        self.count, self.shares = count, shares
        self.basis = _equivariant(degree, images, isometries, count)
        self.kept = _unchanged(images, 3 + count)

    def fitted(self, samples: GraspSamples, start: np.ndarray | None = None, rounds: int = 30) -> _Fit:
        """The best S, from a start or from the mean stiffness."""
        from scipy.optimize import least_squares

        theta = self._start(samples) if start is None else start
        size = max(float(np.linalg.norm(self._start(samples))), 1e-300)
        columns = self._columns(samples)

        def missed(unknowns: np.ndarray) -> np.ndarray:
            rows = samples.rows(self._rest(unknowns), **self.shares)
            return np.r_[_solved(columns, rows)[1], _FIRST * (unknowns - theta) / size]

        found = least_squares(missed, theta, x_scale=size, max_nfev=rounds, ftol=1e-6, xtol=1e-8).x
        rest = self._rest(found)
        return _Fit(rest, found, _solved(columns, samples.rows(rest, **self.shares))[0])

    def left_out(self, samples: GraspSamples, start: np.ndarray) -> float:
        """Root of the mean over solves of the weighted squares that they miss when left out, a fifth at a time."""
        order, total = np.random.default_rng(_SEED).permutation(len(samples)), 0.0
        for k in range(_FOLDS):
            out = np.zeros(len(samples), dtype=bool)
            out[order[k::_FOLDS]] = True
            fit = self.fitted(samples.take(~out), start, rounds=4)
            others = samples.take(out)
            rows = others.rows(fit.rest, **self.shares)
            A, y, w = _stacked(self._columns(others), rows)
            total += float((w * (y - A @ fit.polynomial) ** 2).sum())
        return float(np.sqrt(total / len(samples)))

    def _rest(self, unknowns: np.ndarray) -> RestStiffness:
        return RestStiffness(np.tensordot(unknowns, self.basis, 1), self.count)

    def _start(self, samples: GraspSamples) -> np.ndarray:
        """The root of the mean stiffness, made positive, as far as the symmetry lets it."""
        K = -samples.stiffness[:, :3, :3]
        K = K[np.isfinite(K).all(axis=(1, 2))]
        if len(K):
            mean = np.median(K, axis=0)
        else:
            d = samples.X[samples.moved, :3]
            mean = np.eye(3) * np.median(2 * samples.energy[samples.moved] / (d**2).sum(axis=1))
        values, V = np.linalg.eigh((mean + mean.T) / 2)
        root = (V * np.sqrt(np.maximum(values, 0.1 * values[-1]))) @ V.T
        even = np.zeros(self.basis.shape[1:])
        even[0] = root[_I, _J]
        flat = self.basis.reshape(len(self.basis), -1)
        return np.asarray(np.linalg.lstsq(flat.T, even.ravel(), rcond=None)[0])

    def _columns(self, samples: GraspSamples) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        value, slope, bend = monomials(samples.scaled, 2)
        i, j = pairs(len(samples.inputs))
        kept = self.kept
        return (
            value @ kept,
            np.einsum("nmi,mr->nir", slope, kept),
            np.einsum("nmp,mr->npr", bend[:, :, i, j], kept),
        )


def _stacked(
    columns: tuple[np.ndarray, ...], rows: dict[str, Any]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrix (R, r), targets (R,) and weights (R,) of all rows."""
    value, slope, bend = columns
    w, n = rows["weights"], slope.shape[1]
    twice = np.where(np.equal(*pairs(n)), 1.0, 2.0)
    A = np.vstack([value, slope.reshape(-1, value.shape[1]), bend.reshape(-1, value.shape[1])])
    y = np.r_[rows["Y"][:, 0], rows["slopes"][:, 0].ravel(), rows["curvatures"][:, 0].ravel()]
    weights = [
        w,
        (w[:, None] * rows["slope_weight"]).ravel(),
        (w[:, None] * rows["curvature_weight"] * twice).ravel(),
    ]
    return A, y, np.concatenate(weights)


def _solved(columns: tuple[np.ndarray, ...], rows: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of the polynomial, and the weighted residual of all rows and of the ridge."""
    A, y, w = _stacked(columns, rows)
    root = np.sqrt(w)
    ridge = np.full(A.shape[1], _RIDGE * np.sqrt(len(rows["weights"])))
    B = np.vstack([A * root[:, None], np.diag(ridge)])
    t = np.r_[y * root, np.zeros(A.shape[1])]
    coefficients = np.linalg.lstsq(B, t, rcond=None)[0]
    return coefficients, t - B @ coefficients


def _unchanged(images: Images | None, count: int) -> np.ndarray:
    """Orthonormal basis (m, r) of the quadratic polynomials of ξ (count,) that the images leave as they are."""
    m = (count + 1) * (count + 2) // 2
    if images is None:
        return np.eye(m)
    X = np.random.default_rng(_SEED).uniform(-1, 1, (3 * m, count))
    at = monomials(X, 2)[0]
    mean = np.mean([np.linalg.lstsq(at, monomials(Y, 2)[0], rcond=None)[0] for Y in images.of(X)], axis=0)
    U, sizes, _ = np.linalg.svd(mean)  # columns of `mean` are the averaged polynomials
    return np.asarray(U[:, sizes > 0.5])


def _equivariant(
    degree: int, images: Images | None, isometries: Sequence[np.ndarray], count: int
) -> np.ndarray:
    """Basis (r, m, 6) of the polynomials S with S(ζ') = M S(ζ) Mᵀ."""
    m = monomials(np.zeros((1, count)), degree)[0].shape[1]
    whole = np.eye(6 * m).reshape(-1, m, 6)
    if images is None:
        return whole
    Z = np.random.default_rng(_SEED).uniform(-1, 1, (3 * m, count))
    X = np.column_stack([np.zeros((len(Z), 3)), Z])
    at, mean = monomials(Z, degree)[0], 0.0
    for M, Y in zip(isometries, images.of(X), strict=True):
        for_each = [monomials(Y[:, 3:], degree)[0] @ C for C in whole]
        turned = [
            _entries(M.T @ RestStiffness(C, 0).root(np.zeros((1, 0)))[0] @ M) for C in np.eye(6)[:, None]
        ]
        back = np.array([np.linalg.lstsq(at, one, rcond=None)[0] for one in for_each]) @ np.array(turned)
        mean = mean + back.reshape(len(whole), -1) / len(isometries)
    _, sizes, V = np.linalg.svd(np.asarray(mean))
    return np.asarray(V[sizes > 0.5].reshape(-1, m, 6))


def _entries(S: np.ndarray) -> np.ndarray:
    return np.asarray(S[_I, _J])
