"""The rows of a least-squares problem: values, slopes and curvatures of many outputs, weighted, in their modes.

    value row of sample i      √w_i φ(x_i)ᵀ C ≈ √w_i y_i
    slope rows of sample i     √(w_i s_il) ∂φ(x_i)/∂x_l C ≈ √(w_i s_il) ∂y_i/∂x_l,   l = 1 … n
    curvature rows             √(w_i e c_ilk) ∂²φ(x_i)/∂x_l∂x_k C ≈ √(w_i e c_ilk) ∂²y_i/∂x_l∂x_k,   l ≤ k

with e = 1 on the diagonal and 2 off it, so that the squares add up as in the Frobenius norm of all n² entries.

An orthogonal change of the outputs leaves the cost as it is, so m outputs of rank k are fitted as k: what a fit
costs doesn't grow with m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.rbf.output_modes import every_mode
from palpate.rbf.regressors import Regressors, pairs
from palpate.rbf.sample_checks import numbers, samples, second_derivatives

__all__ = ["Rows"]


@dataclass(frozen=True, eq=False)
class Rows:
    """A weighted least-squares problem in the outputs' modes; R rows, k modes."""

    regressors: Regressors  # kind of units and tail
    X: np.ndarray  # (N, n), places where values are known
    scale: np.ndarray  # (N,), √w of the value rows
    sloped: np.ndarray  # (S,) int, samples of which some slope is known too
    slope_scale: np.ndarray  # (S, n), √(w s) of their rows; a slope of no weight has no row
    targets: np.ndarray  # (R, k), weighted: N values, then slopes sample by sample, then curvatures
    modes: np.ndarray  # (k, m), orthonormal; outputs are targets @ modes
    total: float  # sum of the weights w
    curved: np.ndarray  # (C,) int, samples of which some curvature is known too
    curvature_scale: np.ndarray  # (C, n(n+1)/2), √(w e c) of their rows
    groups: np.ndarray  # (N,) int; one group is judged together: images of one solve under a symmetry, say

    @classmethod
    def of(
        cls,
        regressors: Regressors,
        X: np.ndarray,
        Y: np.ndarray,
        *,
        weights: np.ndarray | None = None,
        slopes: np.ndarray | None = None,
        slope_weight: float | np.ndarray = 1.0,
        curvatures: np.ndarray | None = None,
        curvature_weight: float | np.ndarray = 1.0,
        groups: np.ndarray | None = None,
    ) -> Rows:
        """Return the rows of X (N, n), Y (N, m) and of all that is known of them besides.

        That is weights w (N,), slopes ∂y_j/∂x_l (N, m, n) with s (N,) or (N, n), curvatures ∂²y_j/∂x_l∂x_k
        (N, m, n(n+1)/2), l ≤ k, with c (N,) or (N, n(n+1)/2), and groups (N,); each sample is one by default. Samples
        of no weight are left out; so are slopes and curvatures of no weight, which may then be not-a-number. Weights
        are not negative, and numbers that count are finite.
        """
        n = regressors.form.inputs
        X, Y, w, slopes, s = samples(X, Y, weights, slopes, slope_weight=slope_weight, inputs=n)
        N, m = Y.shape
        kept = np.flatnonzero(w > 0)
        parts = [Y[kept] * np.sqrt(w[kept])[:, None]]
        sloped, slope_scale = _scales(w, s, n, kept)
        if slopes is not None:
            parts.append(_weighted(slopes[kept][sloped], slope_scale))
        curved, curvature_scale = np.zeros(0, int), np.zeros((0, n * (n + 1) // 2))
        if curvatures is not None:
            curvatures, c = second_derivatives(curvatures, curvature_weight, w, inputs=n, outputs=m)
            curved, curvature_scale = _scales(w, c, n * (n + 1) // 2, kept)
            curvature_scale = curvature_scale * np.sqrt(np.where(np.equal(*pairs(n)), 1.0, 2.0))
            parts.append(_weighted(curvatures[kept][curved], curvature_scale))
        latent, basis = every_mode(np.vstack(parts))
        of_each = np.arange(N) if groups is None else numbers("Groups", groups, (N,))
        return cls(
            regressors,
            np.ascontiguousarray(X[kept], float),
            np.sqrt(w[kept]),
            sloped,
            slope_scale,
            latent,
            basis,
            float(w.sum()),
            curved,
            curvature_scale,
            np.unique(of_each[kept], return_inverse=True)[1],
        )

    @classmethod
    def blank(
        cls,
        regressors: Regressors,
        X: np.ndarray,
        *,
        weights: np.ndarray | None = None,
        slope_weight: float | np.ndarray | None = None,
        curvature_weight: float | np.ndarray | None = None,
    ) -> Rows:
        """Return rows of X (N, n) whose targets do not matter, with slopes and curvatures if these have a weight."""
        X = numbers("Inputs X", X, (None, regressors.form.inputs), finite=False)
        N, n = X.shape
        known: dict[str, Any] = {}
        if slope_weight is not None:
            known |= {"slopes": np.zeros((N, 1, n)), "slope_weight": slope_weight}
        if curvature_weight is not None:
            blank = np.zeros((N, 1, n * (n + 1) // 2))
            known |= {"curvatures": blank, "curvature_weight": curvature_weight}
        return cls.of(regressors, X, np.zeros((N, 1)), weights=weights, **known)

    @property
    def samples(self) -> np.ndarray:
        """The sample of each row, (R,)."""
        slopes = np.repeat(self.sloped, (self.slope_scale > 0).sum(axis=1))
        curvatures = np.repeat(self.curved, (self.curvature_scale > 0).sum(axis=1))
        return np.concatenate([np.arange(len(self.X)), slopes, curvatures])

    def matrix(self, theta: np.ndarray, below: int = 0) -> np.ndarray:
        """Weighted regressors, tail then units (R + below, p_t + h), column by column; the last rows are zero."""
        r, N = self.regressors, len(self.X)
        t, end = r.tail_size, len(self.targets)
        F = np.zeros((end + below, t + len(theta)), order="F")
        F[:N, :t] = r.tail_rows(self.X)
        F[:N, t:] = r.phi(self.X, theta)
        F[:N] *= self.scale[:, None]
        r, at = self.regressors, N
        if len(self.sloped):
            parts = [r.tail_slopes(len(self.sloped)), r.slopes(self.X[self.sloped], theta)]
            at = _filled(F, at, np.concatenate(parts, axis=2), self.slope_scale)
        if len(self.curved):
            found = r.curvatures(self.X[self.curved], theta)
            # a tail is affine at most, and so has no curvature
            _filled(F[:, t:], at, found, self.curvature_scale)
        return F

    def derivatives(self, theta: np.ndarray, below: int = 0) -> np.ndarray:
        """Weighted ∂φ_k/∂θ_k (R + below, h p), row by row; the last rows are zero."""
        N, p = len(self.X), self.regressors.form.size
        D = np.empty((len(self.targets) + below, len(theta) * p))
        self.regressors.scaled_by_theta(self.X, theta, self.scale, D[:N].reshape(N, len(theta), p))
        end = len(self.targets)
        D[end:] = 0.0
        r, at = self.regressors, N
        if len(self.sloped):
            found = r.slopes_by_theta(self.X[self.sloped], theta)[1]
            at = _filled(D, at, found.reshape(*found.shape[:2], -1), self.slope_scale)
        if len(self.curved):
            found = r.curvatures_by_theta(self.X[self.curved], theta)[1]
            _filled(D, at, found.reshape(*found.shape[:2], -1), self.curvature_scale)
        return D


def _scales(w: np.ndarray, s: np.ndarray, count: int, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The samples among `kept` whose derivatives have any weight, and the roots of the weights (S, count)."""
    each = np.broadcast_to(s if s.ndim > 1 else s[:, None], (len(w), count))[kept]
    some = np.flatnonzero((each > 0).any(axis=1))
    return some, np.sqrt(w[kept][some, None] * each[some])


def _weighted(derivatives: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Derivatives (S, m, q) as weighted rows (·, m), those of no weight left out."""
    counts = scale > 0
    return np.asarray(derivatives.transpose(0, 2, 1)[counts] * scale[counts][:, None])


def _filled(F: np.ndarray, start: int, found: np.ndarray, scale: np.ndarray) -> int:
    """Weighted regressors (S, q, c) into the rows of F from `start`, those of no weight left out; the next row."""
    counts = scale > 0
    end = start + int(counts.sum())
    if counts.all():
        F[start:end] = (found * scale[..., None]).reshape(end - start, -1)
    else:
        F[start:end] = found[counts] * scale[counts][:, None]
    return end
