"""The quantities that colour a body, at its nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["COLOURS", "NodalField", "largest_stretch_strain", "nodal_field"]

COLOURS = ("displacement", "von_mises", "largest_strain")


@dataclass(frozen=True, eq=False)
class NodalField:
    """A scalar at the nodes.

    Attributes
    ----------
    title : str
    values : (node,) array
        In `unit`.
    unit : str
        SI.
    """

    title: str
    values: np.ndarray
    unit: str


def nodal_field(solution: Any, name: str) -> NodalField:
    """The field called `name`, one of `COLOURS`, of a solution.

    Raises
    ------
    UsageError
        If there is no such field, or the solution was computed without its stresses.
    """
    if name == "displacement":
        return NodalField("displacement", np.linalg.norm(solution.displacement, axis=1), "m")
    if name == "largest_strain":
        strain = largest_stretch_strain(solution.mesh.points, solution.mesh.tetrahedra, solution.displacement)
        return NodalField("largest strain", strain, "")
    if name == "von_mises":
        stress = getattr(solution, "von_mises", None)
        if stress is None:
            raise UsageError(
                "This solution has no stresses at its nodes.",
                why="They cost time, so a solver computes them only when asked.",
                fix="Solve with fields=True, or colour by 'displacement' or 'largest_strain'.",
            )
        return NodalField("von Mises stress", np.asarray(stress, dtype=float), "Pa")
    raise UsageError(
        f"There is no colour {name!r}.", fix=f"Choose one of {', '.join(map(repr, COLOURS))}, or None."
    )


def largest_stretch_strain(
    points: np.ndarray, tetrahedra: np.ndarray, displacement: np.ndarray
) -> np.ndarray:
    """Largest principal strain |λ − 1| at each node, λ being the principal stretches.

    The deformation gradient is constant on each straight tetrahedron; a node takes the mean of those around it,
    weighted by volume.

    Parameters
    ----------
    points, displacement : (node, 3) array
        m.
    tetrahedra : (e, 4) int array

    Returns
    -------
    (node,) array
    """
    rest = points[tetrahedra]
    moved = rest + displacement[tetrahedra]
    before = np.moveaxis(rest[:, 1:] - rest[:, :1], 1, 2)
    after = np.moveaxis(moved[:, 1:] - moved[:, :1], 1, 2)
    stretches = np.linalg.svd(after @ np.linalg.inv(before), compute_uv=False)
    strain, volume = np.abs(stretches - 1).max(axis=1), np.abs(np.linalg.det(before))
    corners, count = tetrahedra.ravel(), len(points)
    sums = np.bincount(corners, np.repeat(strain * volume, 4), minlength=count)
    weights = np.bincount(corners, np.repeat(volume, 4), minlength=count)
    return np.asarray(sums / np.where(weights > 0, weights, 1.0))
