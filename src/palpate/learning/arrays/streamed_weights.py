"""Least squares over any number of rows: normal equations added up block by block, in memory that rows do not change.

With regressors Φ (N, c) of units that stay as they are, the weights of N rows follow from two sums,

    (ΦᵀΦ + λ N) C = Φᵀ Y,

of which a block of rows is a part. They are added up in double precision, always in the same order, so that the number
of threads changes no bit. Solving them squares the condition of Φ; passes that solve the same equations for what the
residual still holds give the digits back (Björck 1996, section 2.9.3), at the cost of a product with Φ each.

The units move by Gauss–Newton steps whose matrix is made of sums too. With D the derivatives of the regressors by the
units' numbers, B = ΦᵀD and W the weights, it is (DᵀD − Bᵀ (ΦᵀΦ + λ N)⁻¹ B) ∘ (W Wᵀ): Kaufman's form of variable
projection (see `palpate.rbf.refinement.projection`). Only DᵀD is formed in single precision: damping covers it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from palpate.network.network_kernels import pattern, regressor_rows_into
from palpate.network.radial import HEAD, RADIAL_FUNCTIONS, RadialFunction, constants
from palpate.rbf.refinement.levenberg import MORE, DampedSystem, bounded_step, next_damping
from palpate.rbf.regressors import Regressors

__all__ = [
    "Moments",
    "OutOfTime",
    "RegressorRows",
    "RowStream",
    "UnitFit",
    "moments_root",
    "newton_steps",
    "project_units",
    "solve_weights",
    "step_work",
]

_BLOCK = 2_000_000
"""Numbers in the largest array of a block, 16 MB; a few of them are held at a time."""
_MOST_ROWS = 8192
_TAIL_RIDGE = 1e-24  # of round-off's size, so that an input that never changes leaves an inverse
_FUNCTIONS = 60  # multiplications that an entry of the derivatives takes as long as
_TRIES = 8  # dampings, each four times the last
_NO_GAIN = 1e-5  # of the cost: a step that gains less is the last


class OutOfTime(Exception):
    """The limit on time passed while rows were added up."""


class RegressorRows:
    """Regressors [1, x, φ] of units that stay as they are, compiled as the runtime has them.

    Units have factors A (h, r, n) and shifts b (h, r) in scaled inputs; `columns` counts those of the tail and the
    units.
    """

    def __init__(self, factors: np.ndarray, shifts: np.ndarray, radial: RadialFunction) -> None:
        n, entries = factors.shape[2], pattern(factors)
        self.tail, self.units = 1 + n, len(factors)
        code = RADIAL_FUNCTIONS.index(radial)
        self._layout = np.ascontiguousarray(np.vstack([[[code, 0]], entries]), dtype=np.int64)
        self._numbers = np.ascontiguousarray(
            np.vstack([factors[:, entries[:, 0], entries[:, 1]].T, shifts.T]), dtype=np.float64
        )
        self._scales = np.vstack([np.zeros(n), np.ones(n), np.zeros(n)])  # inputs are scaled already
        self.columns = self.tail + self.units
        self._lines = HEAD + shifts.shape[1] + 2 * (1 + n)

    def __call__(self, X: np.ndarray) -> np.ndarray:
        """Return the regressors (B, 1 + n + h) at scaled inputs X (B, n)."""
        rows = np.empty((len(X), self.columns))
        work = np.zeros((self._lines, self.columns))
        constant = (self._layout, self._scales, self._numbers, constants(np.float64))
        regressor_rows_into(np.ascontiguousarray(X), rows, work, work.view(np.int64), *constant)
        return rows


@dataclass(frozen=True, eq=False)
class Moments:
    """The sums that decide the weights."""

    gram: np.ndarray  # (c, c), ΦᵀΦ
    cross: np.ndarray  # (c, k), ΦᵀY
    square: float  # sum of the squares of Y
    rows: int

    def __add__(self, other: Moments) -> Moments:
        return Moments(
            self.gram + other.gram,
            self.cross + other.cross,
            self.square + other.square,
            self.rows + other.rows,
        )

    def factor(self, ridge: float, tail: int) -> tuple[np.ndarray, bool]:
        """Return the Cholesky factor of the Gram matrix with its ridge, which grows where rounding asks for it.

        The ridge λ is relative to the number of rows; the `tail` leading columns have none.
        """
        c, penalty = len(self.gram), np.full(len(self.gram), ridge * self.rows)
        penalty[:tail] = _TAIL_RIDGE * self.rows
        jitter, size = 0.0, float(np.trace(self.gram)) / max(c, 1)
        while True:
            trial = self.gram.copy()
            trial[np.diag_indices(c)] += penalty + jitter
            try:
                factor, lower = cho_factor(trial, lower=True, overwrite_a=True, check_finite=False)
                return factor, bool(lower)
            except LinAlgError:
                jitter = max(10.0 * jitter, 1e-15 * size)

    def squares(self, coefficients: np.ndarray) -> float:
        """Return the sum of the squared errors of coefficients (c, k) over the rows."""
        fitted = self.gram @ coefficients - 2.0 * self.cross
        return max(self.square + float((coefficients * fitted).sum()), 0.0)


@dataclass(frozen=True, eq=False)
class RowStream:
    """Rows of samples, scaled inputs and latent outputs, that are looked at block by block."""

    X: np.ndarray  # (N, n)
    Y: np.ndarray  # (N, k)
    workers: int = 1  # threads; results are the same with any number
    deadline: float = math.inf  # of `time.monotonic`; past it `OutOfTime` is raised

    def first(self, count: int) -> RowStream:
        """Return the first rows alone."""
        return self if count >= len(self.X) else replace(self, X=self.X[:count], Y=self.Y[:count])

    def moments(self, regressors: RegressorRows) -> Moments:
        """Return the sums for regressors."""

        def of_block(X: np.ndarray, Y: np.ndarray) -> list[np.ndarray]:
            rows = regressors(X)
            return [rows.T @ rows, rows.T @ Y, np.array((Y**2).sum())]

        gram, cross, square = self.sums(of_block, regressors.columns)
        return Moments(gram, cross, float(square), len(self.X))

    def sums(
        self, of_block: Callable[[np.ndarray, np.ndarray], list[np.ndarray]], width: int
    ) -> list[np.ndarray]:
        """Return the arrays that a function makes of each block, added up in double precision."""
        total: list[np.ndarray] = []
        for parts in self._blocks(of_block, max(1, min(_MOST_ROWS, _BLOCK // max(width, 1)))):
            if not total:
                total = [np.array(part, dtype=np.float64) for part in parts]
                continue
            for whole, part in zip(total, parts, strict=True):
                whole += part
        return total

    def _blocks(
        self, of_block: Callable[[np.ndarray, np.ndarray], list[np.ndarray]], size: int
    ) -> Iterator[list[np.ndarray]]:
        """Yield what the function makes of each block, in order; as many at a time as there are threads."""
        begins = range(0, len(self.X), size)
        if self.workers == 1 or len(begins) == 1:
            for i in begins:
                self._check_time()
                yield of_block(self.X[i : i + size], self.Y[i : i + size])
            return
        with ThreadPoolExecutor(self.workers) as threads:
            for k in range(0, len(begins), self.workers):
                self._check_time()
                some = [slice(i, i + size) for i in begins[k : k + self.workers]]
                yield from threads.map(lambda rows: of_block(self.X[rows], self.Y[rows]), some)

    def _check_time(self) -> None:
        if time.monotonic() > self.deadline:
            raise OutOfTime


def solve_weights(
    stream: RowStream, regressors: RegressorRows, moments: Moments, ridge: float, *, corrections: int = 1
) -> np.ndarray:
    """Return the coefficients (c, k) of least squares with a ridge on the units' weights.

    The ridge λ is relative to the number of rows. The moments are those of the stream's rows by these regressors;
    `corrections` passes take out what rounding left.
    """
    tail = regressors.tail
    factor = moments.factor(ridge, tail)
    coefficients = np.asarray(cho_solve(factor, moments.cross, check_finite=False))
    penalty = np.full((len(coefficients), 1), ridge * moments.rows)
    penalty[:tail] = _TAIL_RIDGE * moments.rows
    for _ in range(corrections):
        last = coefficients

        def of_block(X: np.ndarray, Y: np.ndarray, last: np.ndarray = last) -> list[np.ndarray]:
            rows = regressors(X)
            return [rows.T @ (Y - rows @ last)]

        left = stream.sums(of_block, regressors.columns)[0] - penalty * last
        coefficients = last + cho_solve(factor, left, check_finite=False)
    return coefficients


@dataclass(frozen=True, eq=False)
class UnitFit:
    """Units, and the best tail and weights for them over the rows of a stream."""

    regressors: Regressors  # kind of the units, with an affine tail
    theta: np.ndarray  # (h, p)
    moments: Moments
    ridge: float  # λ, relative to the number of rows
    coefficients: np.ndarray  # (1 + n + h, k), of the tail, then of the units
    cost: float  # squared errors, and the ridge's part

    @cached_property
    def rows(self) -> RegressorRows:
        """The compiled regressors of the units."""
        return RegressorRows(*self.regressors.form.factors(self.theta), self.regressors.radial)

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Return latent outputs (N, k) at scaled inputs X (N, n)."""
        return np.asarray(self.rows(X) @ self.coefficients)


def project_units(stream: RowStream, regressors: Regressors, theta: np.ndarray, ridge: float) -> UnitFit:
    """Return units (h, p) with the best tail and weights for them."""
    rows = RegressorRows(*regressors.form.factors(theta), regressors.radial)
    moments = stream.moments(rows)
    factor = moments.factor(ridge, rows.tail)
    coefficients = np.asarray(cho_solve(factor, moments.cross, check_finite=False))
    penalty = ridge * moments.rows * float((coefficients[rows.tail :] ** 2).sum())
    cost = moments.squares(coefficients) + penalty
    return UnitFit(regressors, theta, moments, ridge, coefficients, cost)


def moments_root(moments: Moments, ridge: float) -> np.ndarray:
    """Return G (c, c) where G Gᵀ times a noise's variance is the covariance of the coefficients that it causes."""
    s, V = np.linalg.eigh(moments.gram)
    s = np.maximum(s, 0.0)
    return np.asarray(V * (np.sqrt(s) / (s + ridge * moments.rows)))


def step_work(rows: int, fit: UnitFit, units: int | None = None) -> float:
    """Return the multiplications, or what takes as long, of a step of the units, or of so many such, on some rows."""
    h = len(fit.theta) if units is None else units
    numbers, columns = float(h * fit.theta.shape[1]), float(fit.rows.tail + h)
    return rows * (numbers**2 / 4 + numbers * (columns + _FUNCTIONS) + 2 * columns**2) + numbers**3 / 3


def newton_steps(stream: RowStream, start: UnitFit, *, damping: float = 1e-2) -> Iterator[UnitFit]:
    """Yield the fit after each step of the units that lowers the cost, until hardly any step does."""
    fit = start
    while fit.theta.size:
        system = DampedSystem(*_gauss_newton(stream, fit))
        for _ in range(_TRIES):
            step = system.step(damping)
            if step is not None:
                step = bounded_step(fit.regressors.form, fit.theta, step.reshape(fit.theta.shape))
                new = project_units(stream, fit.regressors, fit.theta + step, fit.ridge)
                if new.cost < fit.cost:
                    break
            damping *= MORE
        else:
            return
        gain = fit.cost - new.cost
        damping = next_damping(damping, gain / max(system.predicted_gain(step.ravel()), 1e-300))
        fit = new
        yield fit
        if gain < _NO_GAIN * fit.cost:
            return


def _gauss_newton(stream: RowStream, fit: UnitFit) -> tuple[np.ndarray, np.ndarray]:
    """Return the Gauss–Newton matrix (h p, h p), and the right-hand side (h p,) of the descent."""
    (h, p), tail = fit.theta.shape, fit.regressors.tail_size
    W = fit.coefficients[tail:]

    def of_block(X: np.ndarray, Y: np.ndarray) -> list[np.ndarray]:
        rows, D = fit.rows(X), np.empty((len(X), h * p))
        fit.regressors.scaled_by_theta(X, fit.theta, np.ones(len(X)), D.reshape(len(X), h, p))
        residual = (Y - rows @ fit.coefficients) @ W.T
        descent = np.einsum("nk,nkp->kp", residual, D.reshape(len(X), h, p)).ravel()
        single = D.astype(np.float32)
        return [descent, rows.T @ D, single.T @ single]

    descent, B, G = stream.sums(of_block, h * p)
    G -= B.T @ cho_solve(fit.moments.factor(fit.ridge, tail), B, check_finite=False)
    diagonal = np.diag_indices(h * p)
    G[diagonal] = np.maximum(G[diagonal], 0.0)  # where rounding left less than nothing
    blocks = G.reshape(h, p, h, p)
    blocks *= (W @ W.T)[:, None, :, None]
    return np.asfortranarray(G.astype(np.float32)), descent
