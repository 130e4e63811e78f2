"""How much of what a hand feels is the pad, not the body.

A pad of stiffness k lies in series with the body, and a soft one makes every body feel alike. For a spring in
series d ln K/d ln k is the pad's share of the compliance, and so are d ln F/d ln k and d ln U/d ln k at a given
displacement. For a curved contact the three differ, and each tells the share in its own quantity.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import SolverError, UsageError
from palpate.physics.advice import ModelWarning

__all__ = ["PadShare", "pad_share"]

CHANGE = 0.2  # of ln k: right to about 1e-3, h²/24 times the share's curvature in ln k
# A tangent jumps a little wherever a quadrature point comes into contact. So the stiffness is taken from forces, at
# the inputs and where the force is less by about this share: there equilibria are sure to exist.
NEAR = 0.1


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
        d ln |∂F/∂q|/d ln k along the force: the pad's share of the compliance.
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
    aside = _aside(_converged(problem.open(), x))
    less, more = (_logarithms(_with_pads(problem, np.exp(s * CHANGE / 2)), x, aside) for s in (-1, 1))
    energy, force, stiffness = ((more - less) / CHANGE).tolist()
    return PadShare(energy, force, stiffness)


def _aside(solution: Any) -> np.ndarray:
    """Step of the inputs (n,) along the force that lessens it by about a tenth."""
    force = solution.response
    size = float(np.linalg.norm(force))
    if size == 0.0:
        raise UsageError(
            f"The pads do nothing at {solution.inputs}.",
            why="Without a force there is no share of it.",
            fix="Ask at inputs at which the pads are pressed.",
        )
    along = force / size
    change = float(along @ solution.response_gradient @ along)  # of the force, per length along it
    step: np.ndarray = -NEAR * size / change * along
    return step


def _with_pads(problem: Any, factor: float) -> Any:
    parts = tuple(
        replace(part, pad=part.pad * factor) if hasattr(part, "pad") else part
        for part in problem.interactions
    )
    with warnings.catch_warnings():  # whoever asks for the pad's share knows
        warnings.simplefilter("ignore", ModelWarning)
        return replace(problem, interactions=parts)


def _logarithms(problem: Any, x: Any, aside: np.ndarray) -> np.ndarray:
    """Logarithms of energy, force and stiffness, shape (3,)."""
    solver, place = problem.open(), np.asarray(x, dtype=float)
    less, here = (_converged(solver, q) for q in (place + aside, place))
    sizes = [here.potential_energy, *np.linalg.norm([here.response, here.response - less.response], axis=1)]
    return np.log(sizes)


def _converged(solver: Any, x: Any) -> Any:
    solution = solver.solve(x)
    if solution.converged:
        return solution
    raise SolverError(
        f"The solve at {x} did not converge.",
        why=solution.message,
        fix="Ask at inputs that the problem can solve.",
    )
