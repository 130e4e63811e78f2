"""The posterior of the linear weights of ℓ, and the factor that makes it cover the errors of solves left out.

Given the units, the weights have the covariance M = (ΦᵀΦ + λ)⁻¹ times a variance. Leaving a group i of solves
out, such as a column of depths, its rows have the covariance H_ii (I − H_ii)⁻¹ (Cook & Weisberg 1982), and the
force of each solve the relative error that its left-out residual has. The variance is chosen such that nine
tenths of those errors are below 1.645 deviations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.learning.energy.search import Problem
from palpate.learning.energy.written import Solves
from palpate.learning.refinement.leave_one_out import left_out_rows
from palpate.learning.refinement.projection import project, span_of_units
from palpate.learning.refinement.refine import Refined
from palpate.learning.refinement.rows import Rows

__all__ = ["Trust", "trust_of"]

_NINE_TENTHS = 1.645  # standard deviations that hold 90 % of a Gaussian's errors
_MOST = 0.98


@dataclass(frozen=True, eq=False)
class Trust:
    """What leaving solves out has shown.

    Attributes
    ----------
    root : (c, c)
        Of the covariance of the coefficients, tail first; calibrated.
    errors : (N,)
        Relative force error of each solve whose force is known, when it is left out.
    """

    root: np.ndarray
    errors: np.ndarray


def trust_of(refined: Refined, problem: Problem, samples: Solves) -> Trust:
    """From the solves that the network was refined on."""
    known: dict[str, Any] = dict(problem.rows)
    rows = Rows.of(refined.regressors, problem.X, known.pop("Y"), **known)
    fit = project(rows, refined.theta, problem.ridge * rows.total)
    span = span_of_units(rows, refined.theta, fit) if len(refined.theta) else None
    missed = left_out_rows(rows, fit, basis=span, most=_MOST) @ rows.modes
    Q = fit.Q
    to_force, at = _to_force(rows, samples), _slope_rows(rows)
    errors, sizes = np.empty(len(at)), np.empty(len(at))
    together = rows.groups[rows.samples]
    for group in np.unique(rows.groups[[i for i, _ in at]]):
        members = np.flatnonzero(together == group)
        values, V = np.linalg.eigh(Q[members] @ Q[members].T)
        values = np.clip(values, 0.0, _MOST)
        spread = V * np.sqrt(values / (1.0 - values))
        for k, (i, first) in enumerate(at):
            if rows.groups[i] == group:
                block = np.r_[i, first + np.arange(3)]
                errors[k] = np.linalg.norm(to_force[k] @ missed[block, 0])
                sizes[k] = np.linalg.norm(to_force[k] @ spread[np.searchsorted(members, block)])
    ratio = float(np.quantile(errors / np.maximum(sizes, 1e-300), 0.9)) / _NINE_TENTHS
    triangle = np.linalg.cholesky(fit.inverse + 1e-14 * np.trace(fit.inverse) * np.eye(len(fit.tau)))
    return Trust(ratio * triangle, errors)


def _slope_rows(rows: Rows) -> list[tuple[int, int]]:
    """Samples whose force is known, and the first row of each one's slopes: the first three are the force's."""
    counts = (rows.slope_scale > 0).sum(axis=1)
    starts = len(rows.X) + np.cumsum(counts) - counts
    return [(int(i), int(start)) for i, start in zip(rows.sloped, starts, strict=True)]


def _to_force(rows: Rows, samples: Solves) -> np.ndarray:
    """(S, 3, 4): what errors of a solve's weighted value and slope rows make of its force, relative to its size."""
    known = rows.sloped
    force = samples.force[known, :3]
    size = np.linalg.norm(force, axis=1)
    found = np.zeros((len(known), 3, 4))
    found[:, :, 0] = force / (size * rows.scale[known])[:, None]
    half = samples.half[:3]
    for i in range(3):
        found[:, i, 1 + i] = -samples.energy[known] / (size * rows.slope_scale[:, i] * half[i])
    return found
