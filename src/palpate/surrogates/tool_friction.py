"""Friction on a learnt energy: how its normal force grows with depth, and how deep it was pressed.

Where U goes with s^(m+1), the force F goes with s^m and U K/F² = m/(m + 1), K being ∂F/∂s. So m is known at each place
from energy, force and stiffness there, and the depth is s = (m + 1) U/F, whatever the tool and the body.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates.baselines import require_one_tool
from palpate.surrogates.memories import Friction, Memory
from palpate.surrogates.memories.friction import MINDLIN, require_coefficients

if TYPE_CHECKING:
    from palpate.surrogates.energy import LearntEnergy

__all__ = ["with_friction"]

_PLACES = 200  # at which the exponent is looked at: few enough that no kernel is compiled for them
_FELT = 0.1  # of the largest force: below it the exponent is that of the pad alone
_STEEPEST = 4.0  # largest m, far above a cone's 2
_BEYOND = 1.2  # deepest press that the springs share out, over the deepest of the trained ones


def with_friction(
    energy: LearntEnergy,
    memory: Memory | None,
    kinetic: float,
    static: float | None = None,
    *,
    ratio: float = MINDLIN,
) -> Memory | None:
    """Return what a body remembers with a tool's friction on it; without it for a coefficient of zero.

    The coefficients are pure numbers, the static one at least the kinetic one, which it is by default; `ratio` is the
    tangential over the normal stiffness of the contact. A body that is held is refused: nothing slides on it.
    """
    static = kinetic if static is None else static
    require_coefficients(static, kinetic)
    under = None if memory is None else memory.of_body
    if static == 0.0:
        return under
    if energy.baseline.holds:
        raise UsageError(
            "A body that is held has no friction.",
            why="The hand holds a place of it, and no tool slides on its surface.",
            fix="Learn the body under a ball or another tool that presses it.",
        )
    require_one_tool(energy.baseline, "have friction")
    exponent, depth = _press(energy)
    return Friction.over(depth, kinetic, static, exponent=exponent, ratio=ratio, under=under)


def _press(energy: LearntEnergy) -> tuple[float, float]:
    """Return m and the deepest press in m, over the places that the energy was learnt from."""
    X = energy.trained_rows()
    if energy.region is not None:  # places that were learnt from, where it has them
        X = X[-len(energy.region.points) :]
    X = X[:: -(-len(X) // _PLACES)]
    U, F, K = energy.response(X)
    size = np.linalg.norm(F, axis=1)
    good = (U > 0) & (size > _FELT * size.max(initial=0.0))
    if not good.any():
        raise UsageError(
            "No friction can be put on this body.",
            why="No tool at the places that it was learnt from presses it.",
            fix="Learn it from solves in contact.",
        )
    U, F, K, size = U[good], F[good], K[good], size[good]
    along = -np.einsum("ni,nij,nj->n", F, K, F) / size**2
    share = np.clip(U * along / size**2, 0.5, _STEEPEST / (1.0 + _STEEPEST))
    exponent = float(np.median(share / (1.0 - share)))
    return exponent, _BEYOND * float(((exponent + 1.0) * U / size).max())
