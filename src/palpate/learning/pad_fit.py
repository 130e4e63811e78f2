"""A pad's baseline from solves: the stiffness S at rest that leaves ln(U/½ ‖S d‖²) most like a polynomial P.

For given S all that is observed is linear in the polynomial's coefficients, so those are the least-squares solution
and only S is searched (variable projection, Golub & Pereyra 1973). A symmetry leaves S the polynomials with
S(ζ') = M S(ζ) Mᵀ, and P those that do not change. The degrees are those that miss least of solves left out.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.format import count
from palpate.learning.energy.energy_images import images_of
from palpate.learning.energy.energy_samples import EnergySamples
from palpate.rbf.regressors import pairs
from palpate.rbf.symmetric_units import Images
from palpate.surrogates import PadBaseline, RestStiffness, Solves, Stiffening
from palpate.surrogates.baselines.rest_stiffness import MOST, monomials
from palpate.surrogates.baselines.stiffening import HIGHEST, exponents, powers

__all__ = ["fit_pad"]

_I, _J = np.triu_indices(3)
FEWEST = 4  # solves: stiffness at rest and its stiffening have to be found from them, and judged by them
_RIDGE = 1e-2  # of the polynomial's coefficients: few solves do not decide all of them
_START_RIDGE = 1e-2  # of S about its start: holds it where the polynomial of ℓ says the same
_FOLDS, _FEWEST_TO_JUDGE = 5, 6  # parts left out in turn, and solves from which that judges a degree
_QUADRATIC = 2  # degree of P while S is searched
_BETTER = 0.9  # of the error left out, for a higher degree
_SEED = 0


@dataclass(frozen=True, eq=False)
class _Fit:
    """S, what it was found with, and the coefficients of P."""

    rest: RestStiffness
    unknowns: np.ndarray
    polynomial: np.ndarray


def fit_pad(
    solves: Solves,
    *,
    degree: Literal["auto", 0, 1, 2] = "auto",
    stiffening: Literal["auto", 0, 1, 2, 3, 4, 5] = "auto",
) -> tuple[PadBaseline, dict[tuple[int, int], float]]:
    """Find the stiffness at rest S and the polynomial P of a body that is held by a pad, and what they miss.

    `degree` is that of S by place and further inputs, `stiffening` that of P by all inputs; "auto" takes the one that
    misses least of solves left out. The errors are what S and P alone miss of these, by the degrees of both.
    """
    n, axes = len(solves.inputs), solves.axes
    if len(set(axes)) != len(axes) or not set(axes) <= {0, 1, 2} or 3 + len(axes) > n:
        raise UsageError(
            f"A place along the axes {tuple(axes)} does not fit {n} inputs.",
            why="Three components of the displacement come first, then one coordinate of the place for each axis.",
            fix="Name the axes of the place's coordinates, for example (0, 1) on top of a block.",
        )
    if len(solves.X) < FEWEST:
        raise UsageError(
            f"{count(len(solves.X), 'converged solve')}: too few to learn a held body from.",
            fix=f"Sweep at least {FEWEST}, better 20 or more.",
        )
    unknown = _baseline(RestStiffness.even(np.eye(3), n - 3), n)
    samples, images = EnergySamples.of(solves, unknown), images_of(solves, unknown)
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        return _fit(samples, images, solves.symmetry, degree, stiffening)


def _fit(
    samples: EnergySamples,
    images: Images | None,
    isometries: np.ndarray,
    degree: int | str,
    stiffening: int | str,
) -> tuple[PadBaseline, dict[tuple[int, int], float]]:
    n, enough = len(samples.inputs), len(samples) >= _FEWEST_TO_JUDGE
    highest = MOST if n > 3 and enough else 0
    search = {d: _Search(d, images, isometries, n - 3) for d in range(MOST + 1)}
    fits, errors = {}, {}
    for d in range(highest + 1) if isinstance(degree, str) else [degree]:
        fits[d] = search[d].fit(samples)
        errors[d, _QUADRATIC] = search[d].left_out(samples, fits[d].unknowns) if enough else 0.0
    d = _least({d: errors[d, _QUADRATIC] for d in fits})
    if isinstance(stiffening, str):
        for q in range(_QUADRATIC + 1, HIGHEST + 1) if enough else ():
            errors[d, q] = search[d].of_degree(q).left_out(samples, fits[d].unknowns, rounds=0)
        best = _least({q: errors[d, q] for _, q in errors if (d, q) in errors})
    else:
        best = stiffening
        errors[d, best] = (
            search[d].of_degree(best).left_out(samples, fits[d].unknowns, rounds=0) if enough else 0.0
        )
    fit = search[d].of_degree(best).fit(samples, fits[d].unknowns, rounds=0 if best > MOST else 30)
    polynomial = Stiffening.of(search[d].of_degree(best).kept @ fit.polynomial, n, best)
    return PadBaseline(fit.rest, polynomial), errors


def _baseline(rest: RestStiffness, inputs: int) -> PadBaseline:
    """Return a pad of that stiffness at rest, without a polynomial."""
    return PadBaseline(rest, Stiffening.none(inputs))


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
        isometries: np.ndarray,
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
        """Return the fit for P of another degree."""
        other = copy.copy(self)
        other._set(degree)
        return other

    def fit(self, samples: EnergySamples, start: np.ndarray | None = None, rounds: int = 30) -> _Fit:
        """The best S, from a start or from the mean stiffness."""
        from scipy.optimize import least_squares

        theta = self._start(samples) if start is None else start
        size = max(float(np.linalg.norm(self._start(samples))), 1e-300)
        columns = self._columns(samples)
        if not rounds:
            rest = self._rest(theta)
            return _Fit(
                rest, theta, _solve_weights(columns, samples.rows(_baseline(rest, len(samples.inputs))))[0]
            )

        def missed(unknowns: np.ndarray) -> np.ndarray:
            rows = samples.rows(_baseline(self._rest(unknowns), len(samples.inputs)))
            return np.concatenate(
                [_solve_weights(columns, rows)[1], _START_RIDGE * (unknowns - theta) / size]
            )

        solution = least_squares(missed, theta, x_scale=size, max_nfev=rounds, ftol=1e-6, xtol=1e-8).x
        rest = self._rest(solution)
        return _Fit(
            rest, solution, _solve_weights(columns, samples.rows(_baseline(rest, len(samples.inputs))))[0]
        )

    def left_out(self, samples: EnergySamples, start: np.ndarray, rounds: int = 4) -> float:
        """Root of the mean over solves of the weighted squares that they miss when left out, a fifth at a time."""
        order, total = np.random.default_rng(_SEED).permutation(len(samples)), 0.0
        for k in range(_FOLDS):
            out = np.zeros(len(samples), dtype=bool)
            out[order[k::_FOLDS]] = True
            fit = self.fit(samples.take(~out), start, rounds)
            others = samples.take(out)
            rows = others.rows(_baseline(fit.rest, len(samples.inputs)))
            A, y, w = _stacked(self._columns(others), rows)
            total += float((w * (y - A @ fit.polynomial) ** 2).sum())
        return float(np.sqrt(total / len(samples)))

    def _rest(self, unknowns: np.ndarray) -> RestStiffness:
        return RestStiffness(np.tensordot(unknowns, self.basis, 1), self.count)

    def _start(self, samples: EnergySamples) -> np.ndarray:
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

    def _columns(self, samples: EnergySamples) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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


def _solve_weights(columns: tuple[np.ndarray, ...], rows: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
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


def _equivariant(degree: int, images: Images | None, isometries: np.ndarray, count: int) -> np.ndarray:
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
