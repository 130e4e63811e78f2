"""How much of what a hand feels is the pad, not the body.

A pad of stiffness k lies in series with the body, and a soft one makes every body feel alike. For a spring in
series d ln K/d ln k is the pad's share of the compliance, and so are d ln F/d ln k and d ln U/d ln k at a given
displacement. For a curved contact the three differ, and each tells the share in its own quantity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import SolverError, UsageError

__all__ = ["PadShare", "pad_share"]

CHANGE = 0.02  # of ln k: differences are then right to about 1e-4


@dataclass(frozen=True)
class PadShare:
    """Relative change with the pad's stiffness k, at the same inputs.

    Attributes
    ----------
    energy : float
        d ln U/d ln k: for a pad whose energy is proportional to k, the share of U that the pad stores.
    force : float
        d ln |F|/d ln k.
    stiffness : float
        d ln |∂F/∂q|/d ln k: the pad's share of the compliance.
    """

    energy: float
    force: float
    stiffness: float


def pad_share(problem: Any, x: Any) -> PadShare:
    """What the pads of a problem's interactions take of energy, force and stiffness at inputs x (n,).

    Parameters
    ----------
    problem : SolidProblem
    x : (n,) array
        Inputs at which the pads are pressed.

    Returns
    -------
    PadShare
        By central differences in ln k.

    Raises
    ------
    UsageError
        If no interaction has a pad, or it does nothing at x.
    SolverError
        If a solve does not converge.
    """
    if not any(hasattr(part, "pad") for part in problem.interactions):
        raise UsageError(
            "The problem has no pad.",
            why="None of its interactions has a pad stiffness.",
            fix="Ask it of a problem with a SphereProbe or a GluedPad.",
        )
    less, more = (_logarithms(_with_pads(problem, np.exp(s * CHANGE / 2)), x) for s in (-1, 1))
    energy, force, stiffness = ((more - less) / CHANGE).tolist()
    return PadShare(energy, force, stiffness)


def _with_pads(problem: Any, factor: float) -> Any:
    parts = tuple(
        replace(part, pad=part.pad * factor) if hasattr(part, "pad") else part
        for part in problem.interactions
    )
    return replace(problem, interactions=parts)


def _logarithms(problem: Any, x: Any) -> np.ndarray:
    """Logarithms of energy, force and stiffness, shape (3,)."""
    solution = problem.open().solve(x)
    if not solution.converged:
        raise SolverError(
            f"The solve at {x} did not converge.",
            why=solution.message,
            fix="Ask at inputs that the problem can solve.",
        )
    sizes = np.array(
        [
            abs(solution.potential_energy),
            np.linalg.norm(solution.response),
            np.linalg.norm(solution.response_gradient),
        ]
    )
    if not sizes.all():
        raise UsageError(
            f"The pads do nothing at {x}.",
            why="Without a force there is no share of it.",
            fix="Ask at inputs at which the pads are pressed.",
        )
    return np.asarray(np.log(sizes))
