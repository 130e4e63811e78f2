"""The stiffness at rest and the stiffening from solves: the S that leaves ln(U/½ ‖S d‖²) most like a polynomial.

For given S all that is observed is linear in the polynomial's coefficients, so those are the least-squares solution
and only S is searched (variable projection, Golub & Pereyra 1973). A symmetry leaves S the polynomials with
S(ζ') = M S(ζ) Mᵀ, and P those that do not change. The degrees are those that miss least of solves left out.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from palpate.learning.grasp.samples import GraspSamples
from palpate.rbf.regressors import pairs
from palpate.rbf.symmetric_units import Images
from palpate.surrogates.grasp.rest import MOST, RestStiffness, monomials
from palpate.surrogates.grasp.stiffening import HIGHEST, Stiffening, exponents, powers

__all__ = ["FoundLaw", "found_law"]

_I, _J = np.triu_indices(3)
_RIDGE = 1e-2  # of the polynomial's coefficients: few solves do not decide all of them
_FIRST = 1e-2  # holds S where the polynomial of ℓ says the same
_FOLDS, _LEAST = 5, 6
_QUADRATIC = 2  # degree of P while S is searched
_BETTER = 0.9  # of the error left out, for a higher degree
_SEED = 0


@dataclass(frozen=True, eq=False)
class _Fit:
    """S, what it was found with, and the coefficients of P."""

    rest: RestStiffness
    unknowns: np.ndarray
    polynomial: np.ndarray


@dataclass(frozen=True, eq=False)
class FoundLaw:
    """S and P, and what they miss of solves left out, by the degrees of both."""

    rest: RestStiffness
    stiffening: Stiffening
    errors: dict[tuple[int, int], float]


def found_law(
    samples: GraspSamples,
    images: Images | None,
    isometries: Sequence[np.ndarray],
    degree: int | None = None,
    stiffening: int | None = None,
) -> FoundLaw:
    """S and P of given degrees, or of those whose error on solves left out is least."""
    n, enough = len(samples.inputs), len(samples) >= _LEAST
    highest = MOST if n > 3 and enough else 0
    search = {d: _Search(d, images, isometries, n - 3) for d in range(MOST + 1)}
    fits, errors = {}, {}
    for d in range(highest + 1) if degree is None else [degree]:
        fits[d] = search[d].fitted(samples)
        errors[d, _QUADRATIC] = search[d].left_out(samples, fits[d].unknowns) if enough else 0.0
    d = _least({d: errors[d, _QUADRATIC] for d in fits})
    for q in (range(_QUADRATIC + 1, HIGHEST + 1) if enough else ()) if stiffening is None else [stiffening]:
        errors[d, q] = search[d].of_degree(q).left_out(samples, fits[d].unknowns, rounds=0) if enough else 0.0
    best = (
        _least({q: errors[d, q] for _, q in errors if (d, q) in errors}) if stiffening is None else stiffening
    )
    found = search[d].of_degree(best).fitted(samples, fits[d].unknowns, rounds=0 if best > MOST else 30)
    polynomial = Stiffening.of(search[d].of_degree(best).kept @ found.polynomial, n, best)
    return FoundLaw(found.rest, polynomial, errors)


def _least(errors: dict[int, float]) -> int:
    """The degree of least error; a higher one must be better by a tenth."""
    best = min(errors)
    for d in sorted(errors):
        best = d if errors[d] < _BETTER * errors[best] else best
    return best


class _Search:
    """Variable projection over S of one degree."""

    def __init__(
        self,
        degree: int,
        images: Images | None,
        isometries: Sequence[np.ndarray],
        count: int,
    ) -> None:
        self.count, self.images = count, images
        self.basis = _equivariant(degree, images, isometries, count)
        self._set(_QUADRATIC)

    def _set(self, degree: int) -> None:
        self.exponents = exponents(3 + self.count, degree)
        self.kept = _unchanged(self.images, self.exponents)

    @cache  # noqa: B019 - lives as long as the search for one law
    def of_degree(self, degree: int) -> _Search:
        """The same for P of another degree."""
        other = copy.copy(self)
        other._set(degree)
        return other

    def fitted(self, samples: GraspSamples, start: np.ndarray | None = None, rounds: int = 30) -> _Fit:
        """The best S, from a start or from the mean stiffness."""
        from scipy.optimize import least_squares

        theta = self._start(samples) if start is None else start
        size = max(float(np.linalg.norm(self._start(samples))), 1e-300)
        columns = self._columns(samples)
        if not rounds:
            rest = self._rest(theta)
            return _Fit(rest, theta, _solved(columns, samples.rows(rest))[0])

        def missed(unknowns: np.ndarray) -> np.ndarray:
            rows = samples.rows(self._rest(unknowns))
            return np.concatenate([_solved(columns, rows)[1], _FIRST * (unknowns - theta) / size])

        found = least_squares(missed, theta, x_scale=size, max_nfev=rounds, ftol=1e-6, xtol=1e-8).x
        rest = self._rest(found)
        return _Fit(rest, found, _solved(columns, samples.rows(rest))[0])

    def left_out(self, samples: GraspSamples, start: np.ndarray, rounds: int = 4) -> float:
        """Root of the mean over solves of the weighted squares that they miss when left out, a fifth at a time."""
        order, total = np.random.default_rng(_SEED).permutation(len(samples)), 0.0
        for k in range(_FOLDS):
            out = np.zeros(len(samples), dtype=bool)
            out[order[k::_FOLDS]] = True
            fit = self.fitted(samples.take(~out), start, rounds)
            others = samples.take(out)
            rows = others.rows(fit.rest)
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
        value, slope, bend = powers(samples.scaled, self.exponents)
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


def _unchanged(images: Images | None, E: np.ndarray) -> np.ndarray:
    """Orthonormal basis (m, r) of the polynomials of exponents E (m, n) that the images leave as they are."""
    m, n = E.shape
    if images is None:
        return np.eye(m)
    X = np.random.default_rng(_SEED).uniform(-1, 1, (3 * m, n))
    many = images.of(X)
    mean = np.linalg.lstsq(_values(X, E), np.mean([_values(Y, E) for Y in many], axis=0), rcond=None)[0]
    U, sizes, _ = np.linalg.svd(mean)  # columns of `mean` are the averaged polynomials
    return np.asarray(U[:, sizes > 0.5])


def _values(X: np.ndarray, E: np.ndarray) -> np.ndarray:
    """Monomials (N, m)."""
    table = X[:, :, None] ** np.arange(E.max(initial=0) + 1)
    return np.asarray(np.prod([table[:, i, E[:, i]] for i in range(E.shape[1])], axis=0))


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
