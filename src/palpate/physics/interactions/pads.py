"""The pad's share of what a hand feels.

A pad of stiffness k lies in series with the body, and a soft one makes every body feel alike.

Before anything is solved, `pad_depth` takes the body as a half-space (Hertz 1882; Johnson 1985, Contact Mechanics,
eq. 4.23), F = 4/3 E* √(R a³), and the pad as springs side by side under a flat sphere (Johnson 1985, section 4.3),
F = 2πR φ(b); both in series share the depth a + b. On a block of tissue of 9 kPa this gives 0.49, 0.33 and 0.25 of the
depth at 1, 5 and 10 mm.

`pad_share` solves. For a spring in series d ln K/d ln k is the pad's share of the compliance, and so are d ln F/d ln k
and d ln U/d ln k at a given displacement. For a curved contact the three differ, and each gives the share in its own
quantity.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import SolverError, UsageError
from palpate.format import millimetres, number
from palpate.physics.advice import ModelWarning, advise
from palpate.physics.interactions.tool_contact import REACH, pressed_energy

__all__ = ["PadShare", "advise_on_pad", "pad_depth", "pad_share"]

LARGE = 0.5  # share of the depth: from here on more of it is the pad's than the body's
SMALL = 0.1  # share that the pad advised would take
# difference h of ln k in a quotient, which is right to about 1e-3: h²/24 times the share's curvature in ln k
CHANGE = 0.2
# A tangent jumps a little wherever a quadrature point comes into contact. So the stiffness is taken from forces, at
# the inputs and where the force is less by about this share: there equilibria are sure to exist.
NEAR = 0.1


def pad_depth(probe: Any, modulus: float, depth: float) -> float:
    """Return the depth in m by which the pad of a sphere is pressed at a depth of the probe in m, positive.

    `modulus` is E* = E/(1 − ν²) of the body in Pa.
    """
    low, high = 0.0, depth if probe.stop is None else min(depth, REACH * probe.stop)
    for _ in range(50):  # the pad's force grows with its share, the body's falls
        pressed = (low + high) / 2
        pad = 2 * math.pi * probe.radius * pressed_energy(pressed, probe.pad, probe.stop)
        body = 4 / 3 * modulus * math.sqrt(probe.radius * (depth - pressed) ** 3)
        low, high = (pressed, high) if pad < body else (low, pressed)
    return low


def advise_on_pad(probe: Any, materials: dict[str, Any]) -> None:
    """Warn of a pad that takes more than half of the largest depth, on a body of these materials by region.

    Of several materials the softest counts, so the warning comes late rather than falsely.
    """
    depth = probe.depth[1]
    modulus = min(2 * m.shear_modulus / (1 - m.poisson) for m in materials.values())
    if depth <= 0 or pad_depth(probe, modulus, depth) <= LARGE * depth:
        return
    share = pad_depth(probe, modulus, depth) / depth
    advise(
        f"The pad of the probe takes about {share:.0%} of the depth of {millimetres(depth)}.",
        why=f"Its stiffness of {number(probe.pad)} N/m³ is low for a body of E/(1 − ν²) = {number(modulus)} Pa: "
        "most of what is felt is the pad.",
        fix=f"Give the probe pad={_stiffer(probe, modulus, depth):.0e} or more, which takes less than {SMALL:.0%}, "
        "or ask pad_share and state the pad with the results.",
    )


def _stiffer(probe: Any, modulus: float, depth: float) -> float:
    """Return the least stiffness 1, 2 or 5 · 10ⁿ N/m³ whose pad takes little."""
    power = math.floor(math.log10(probe.pad))
    ladder = (digit * 10.0**p for p in range(power, power + 30) for digit in (1, 2, 5))
    return next(pad for pad in ladder if pad_depth(replace(probe, pad=pad), modulus, depth) <= SMALL * depth)


@dataclass(frozen=True)
class PadShare:
    """Relative change with the pad's stiffness k, at the same inputs."""

    # d ln U/d ln k: for a pad whose energy is proportional to k, the share of U that the pad stores
    energy: float
    force: float  # d ln |F|/d ln k
    stiffness: float  # d ln |∂F/∂q|/d ln k along the force: the pad's share of the compliance


def pad_share(problem: Any, x: Any) -> PadShare:
    """Return the pads' shares of energy, force and stiffness of a problem at inputs x (n,).

    Parameters
    ----------
    problem : SolidProblem
        A body under at least one interaction with a pad.
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
    aside = _aside(_solve(problem.open(), x))
    less, more = (_logarithms(_with_pads(problem, np.exp(s * CHANGE / 2)), x, aside) for s in (-1, 1))
    energy, force, stiffness = ((more - less) / CHANGE).tolist()
    return PadShare(energy, force, stiffness)


def _aside(solution: Any) -> np.ndarray:
    """Return a step of the inputs (n,) along the force that lessens it by about a tenth."""
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
        replace(part, pad=part.pad * factor) if hasattr(part, "pad") else part for part in problem.acting
    )
    with warnings.catch_warnings():  # whoever asks for the pad's share knows
        warnings.simplefilter("ignore", ModelWarning)
        return replace(problem, interactions=parts)


def _logarithms(problem: Any, x: Any, aside: np.ndarray) -> np.ndarray:
    """Return logarithms of energy, force and stiffness, shape (3,)."""
    solver, place = problem.open(), np.asarray(x, dtype=float)
    less, here = (_solve(solver, q) for q in (place + aside, place))
    sizes = [here.potential_energy, *np.linalg.norm([here.response, here.response - less.response], axis=1)]
    return np.log(sizes)


def _solve(solver: Any, x: Any) -> Any:
    solution = solver.solve(x)
    if solution.converged:
        return solution
    raise SolverError(
        f"The solve at {x} did not converge.",
        why=solution.message,
        fix="Ask at inputs that the problem can solve.",
    )
