"""Predictive standard deviations of a network, and intervals that hold on data it has not seen.

    var f_j(x) = s_j² (1 + φ̃ᵀ M φ̃) + ‖Σ_k w_kj e_k U_k‖²,   e = ∂φ̃/∂(A, b) − φ̃ᵀ B

with φ̃ = [1, x, φ(x)], noise s_j², coefficient covariance s_j² M, and U Uᵀ the covariance of the units' factors
(Laplace's approximation; MacKay 1992). A posterior knows nothing of the model's own misfit, so the deviations are
scaled on data kept apart: with the conformal quantile of n scores |y − f|/σ, the ⌈(n + 1) level⌉-th smallest, an
interval of that level covers unseen data with at least that probability whatever the distribution
(Vovk, Gammerman & Shafer 2005; Lei, G'Sell, Rinaldo, Tibshirani & Wasserman 2018).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from statistics import NormalDist
from typing import Annotated, Any

import numpy as np

from palpate.errors import UsageError
from palpate.format import count
from palpate.network.network import Network
from palpate.network.radial import radial

__all__ = ["Uncertainty"]

_PREFIX = "uncertainty_"
_ARRAYS = ("noise", "coefficients", "root", "through", "factor")
_CHUNK = 32  # points at a time: memory stays at 32 h (h p) numbers


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """The uncertainty of a network's outputs at any input.

    Attributes
    ----------
    network : Network
        h units with e entries each on the factors' pattern and r shifts, m outputs; c regressors.
    noise : (m,)
        s_j² of the scaled outputs.
    coefficients : (c, c)
        M, tail first; (0, 0) where all but the noise is taken as certain.
    root : (h (e + r), z)
        U: any root of the covariance of the entries of A_k and of b_k, unit by unit; (0, 0) where the units
        are taken as certain.
    through : (c, h (e + r))
        B: how the coefficients follow the units; then (c, 0).
    pattern : (2, e) int
        Rows and columns of the entries of A_k that may differ from zero.
    factor : (m,)
        What calibration multiplies the deviations by; ones before.
    """

    network: Network
    noise: np.ndarray
    coefficients: np.ndarray
    root: np.ndarray
    through: np.ndarray
    pattern: Annotated[np.ndarray, np.int64]
    factor: np.ndarray = field(default_factory=lambda: np.ones(1))

    def deviation(self, X: np.ndarray) -> np.ndarray:
        """Standard deviation (N, m) of what would be measured at X (N, n), in SI units.

        Raises
        ------
        UsageError
            If X has another number of columns.
        """
        s = self.network.scaling
        xs = s.scale_inputs(_table("Inputs", X, len(self.network.inputs)))
        parts = [self._variance(xs[i : i + _CHUNK]) for i in range(0, len(xs), _CHUNK)]
        variance = np.vstack(parts) if parts else np.zeros((0, len(self.noise)))
        return np.asarray(np.sqrt(variance) * self.factor * s.output_scale)

    def interval(self, X: np.ndarray, level: float = 0.9) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (N, m), in SI units, that hold what would be measured with probability `level`.

        At the level that it was calibrated for, the conformal guarantee holds; others follow a normal law.
        """
        half = _quantile(level) * self.deviation(X)
        middle = self.network.predict(X)
        return middle - half, middle + half

    def calibrated(self, X: np.ndarray, Y: np.ndarray, level: float = 0.9) -> Uncertainty:
        """Scaled, output by output, so that intervals of `level` hold on data kept apart from training.

        Parameters
        ----------
        X, Y : (N, n), (N, m)
            In SI units, neither trained on nor used to choose the network.
        level : float
            Share of unseen samples that the intervals shall hold.

        Raises
        ------
        UsageError
            If there are too few samples for the level: N must be at least level/(1 − level). If X and Y do not fit
            together or are not finite, or a deviation is zero, which no factor can widen.
        """
        X = _table("Inputs", X, len(self.network.inputs))
        Y = _table("Outputs", Y, len(self.network.outputs))
        if len(X) != len(Y) or not (np.isfinite(X).all() and np.isfinite(Y).all()):
            raise UsageError(
                f"{len(X)} rows of inputs and {len(Y)} of outputs, or some that are not finite, calibrate nothing.",
                why="Each row is one measurement: its error is compared with its deviation.",
                fix="Pass finite X (N, n) and Y (N, m) with the same N.",
            )
        z, rank = _quantile(level), _ceil((len(X) + 1) * level)
        if rank > len(X):
            raise UsageError(
                f"{count(len(X), 'sample')} can't calibrate intervals of {level:.0%}.",
                fix=f"Keep at least {_ceil(level / (1.0 - level))} apart from training.",
            )
        deviation = self.deviation(X)
        if not (deviation > 0).all():
            raise UsageError(
                "Some deviations are zero.",
                why="No factor widens an interval of no width.",
                fix="Make the posterior with a noise above zero.",
            )
        scores = np.abs(Y - self.network.predict(X)) / deviation
        return replace(self, factor=self.factor * np.sort(scores, axis=0)[rank - 1] / z)

    def attached(self) -> Network:
        """The network with this uncertainty among its further arrays, so that it travels in the network file."""
        arrays: dict[str, Any] = {_PREFIX + k: np.asarray(getattr(self, k), float) for k in _ARRAYS}
        arrays[_PREFIX + "pattern"] = self.pattern.astype(float)
        return replace(self.network, extras={**self.network.extras, **arrays})

    @classmethod
    def of(cls, network: Network) -> Uncertainty | None:
        """The uncertainty that travels with a network, or None.

        Raises
        ------
        UsageError
            If its arrays do not fit the network.
        """
        parts = {
            k: network.extras[_PREFIX + k] for k in (*_ARRAYS, "pattern") if _PREFIX + k in network.extras
        }
        if not parts:
            return None
        if len(parts) <= len(_ARRAYS) or any(np.ndim(v) == 0 for v in parts.values()):
            raise UsageError("The uncertainty's arrays are not complete.", fix="Make it anew.")
        parts["pattern"] = np.asarray(parts["pattern"]).astype(np.int64)
        return cls(network, **parts)

    def __post_init__(self) -> None:
        h, r, n = self.network.factors.shape
        m, q, c = len(self.network.outputs), self.pattern.shape[-1] + r, len(self.coefficients)
        moved = h * q if self.root.size or self.through.size else 0  # numbers of units that are uncertain
        shapes = {
            "noise": (self.noise.shape, (m,)),
            "coefficients": (self.coefficients.shape, (c, c)),
            "root": (self.root.shape[:1], (moved,)),
            "through": (self.through.shape, (c, moved)),
            "pattern": (self.pattern.shape, (2, q - r)),
            "factor": (self.factor.shape, (m,) if self.factor.size != 1 else (1,)),
        }
        wrong = [k for k, (found, wanted) in shapes.items() if found != wanted]
        if wrong or not (c == 0 or h <= c <= h + 1 + n):
            raise UsageError(
                f"The uncertainty's {', '.join(wrong) or 'coefficients'} do not fit the network's "
                f"{h} units and {m} outputs.",
                fix="Make it anew from the network's own posterior.",
            )
        inside = (self.pattern >= 0) & (self.pattern < np.array([[r], [n]]))
        if not inside.all() or not (self.noise >= 0).all():
            raise UsageError("The uncertainty's pattern or noise is not one.", fix="Make it anew.")

    def _variance(self, xs: np.ndarray) -> np.ndarray:
        """Variance of the scaled outputs (N, m) at scaled inputs (N, n)."""
        if not self.coefficients.size:
            return np.tile(self.noise, (len(xs), 1))
        phi, D = _by_factors(self.network, self.pattern, xs)
        N, h, q = D.shape
        tail = np.hstack([np.ones((N, 1)), xs])[:, : len(self.coefficients) - h]
        row = np.hstack([tail, phi])
        linear = (
            self.noise * (1.0 + np.einsum("ni,ij,nj->n", row, self.coefficients, row, optimize=True))[:, None]
        )
        if not self.root.size:
            return np.asarray(linear)
        e = D - (row @ self.through).reshape(N, h, q)
        moved = e.transpose(1, 0, 2) @ self.root.reshape(h, q, -1)  # (h, N, z)
        basis, W = self.network.basis, self.network.weights
        W = W if basis is None else basis @ W  # (m, h)
        if len(W) <= h:
            return np.asarray(linear + ((W @ moved.reshape(h, -1)).reshape(len(W), N, -1) ** 2).sum(axis=2).T)
        a = moved.transpose(1, 0, 2)
        T = a @ a.transpose(0, 2, 1)
        return np.asarray(linear + np.stack([((W @ t) * W).sum(axis=1) for t in T]))


def _by_factors(network: Network, pattern: np.ndarray, xs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """φ (N, h) and its derivatives (N, h, e + r) by the entries of A_k on the pattern, and b_k."""
    A, (rows, columns) = network.factors, pattern
    v = np.einsum("kri,ni->nkr", A, xs) - network.shifts
    g, g1, _ = radial(network.radial, (v * v).sum(axis=2))
    by_v = 2.0 * g1[..., None] * v
    return g, np.concatenate([by_v[..., rows] * xs[:, None, columns], -by_v], axis=2)


def _table(what: str, given: np.ndarray, columns: int) -> np.ndarray:
    """A table of that many columns, as doubles."""
    found = np.asarray(given, dtype=np.float64)
    if found.ndim != 2 or found.shape[1] != columns:
        raise UsageError(
            f"{what} of shape {found.shape} came to a network of {columns} {what.lower()}.",
            why="Each row is one point, each column one of them.",
            fix=f"Pass an array of shape (N, {columns}).",
        )
    return found


def _quantile(level: float) -> float:
    """Half-width of a normal interval of a level, in standard deviations."""
    if not 0.0 < level < 1.0:
        raise UsageError(
            f"A level of {level} is no probability.", fix="Choose one between 0 and 1, such as 0.9."
        )
    return NormalDist().inv_cdf((1.0 + level) / 2.0)


def _ceil(number: float) -> int:
    """The next whole number, of one that rounding may have lifted just above its own."""
    return math.ceil(number - 1e-9)
