"""Two separate tools on one body, by its learnt energy of one: U(x₁) + U(x₂) where they are far apart.

Two balls of 6 mm that press a block of 90 × 30 × 25 mm 3 mm deep, solved together, were compared with the sum of single
solves on the same mesh. Over the distance in contact radii a = √(2 R s) the force on each is off by 5.4 % at 2.5 a,
2.1 % at 3.3 a, 0.7 % at 4.2 a and 0.3 % at 5 a. So 3 % is kept from `APART` on.
"""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.surrogates.arguments import rows_of
from palpate.surrogates.baselines import require_one_tool
from palpate.surrogates.energy import LearntEnergy

__all__ = ["APART", "two_tool_forces"]

APART = 3.5  # least distance of two tools over the larger contact's radius: nearer, each feels the other


def two_tool_forces(
    energy: LearntEnergy, first: np.ndarray, second: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces (N, 3) in N on each of two tools at inputs (N, n); pairs that are too near are refused."""
    require_one_tool(energy.baseline, "be pressed by two such tools")
    X = [rows_of(rows, energy.inputs, "learnt body") for rows in (first, second)]
    if len(X[0]) != len(X[1]):
        raise UsageError(
            f"There are {len(X[0])} places of the first tool and {len(X[1])} of the second.",
            why="Both press at once: each row of one belongs to the same row of the other.",
            fix="Give as many rows of both.",
        )
    if energy.baseline.holds:
        raise UsageError(
            "A body that is held can't be held at a second place.",
            why="What two hands do to it was not compared with solves.",
            fix="Press it by tools, or learn it under both pads together.",
        )
    distance = np.linalg.norm(X[0][:, :3] - X[1][:, :3], axis=1)
    least = APART * np.maximum(*(_contact_radii(energy, rows) for rows in X))
    if (distance < least).any():
        row = int(np.argmax(least - distance))
        raise UsageError(
            f"Two tools are {millimetres(float(distance[row]))} apart in row {row}.",
            why=f"Nearer than {APART} contact radii, {millimetres(float(least[row]))} here, each feels what the other "
            "does to the body, and the learnt energy knows one tool alone: forces may be off by more than 3 %.",
            fix="Take places farther apart, or learn both tools together: body.problem([tool, tool]).",
        )
    return energy.force(X[0]), energy.force(X[1])


def _contact_radii(energy: LearntEnergy, X: np.ndarray) -> np.ndarray:
    """Return half the width (N,) in m of each tool's cut at its depth; 0 where it does not touch."""
    depths = np.maximum(energy.depth(X), 0.0)
    tool, own = getattr(energy.baseline, "posed_tool", None), energy.baseline.radius_input
    if tool is not None:
        return np.array([max(tool.shape.half_widths(float(s))) if s > 0 else 0.0 for s in depths])
    return np.asarray(np.sqrt(2 * (energy.baseline.radius if own is None else X[:, own]) * depths))
