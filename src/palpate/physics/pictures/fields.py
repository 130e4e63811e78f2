"""The quantities that colour a body, at its nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.pictures.fine import EDGES, FineBody, middles_of

__all__ = ["COLOURS", "NodalField", "nodal_field", "nodal_strain"]

DISPLACEMENT = "displacement"
OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])  # corners but each one
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

    def over(self, body: FineBody) -> np.ndarray:
        """The values at all nodes of what is drawn."""
        if self.title == DISPLACEMENT:
            return np.asarray(np.linalg.norm(body.displacement, axis=1))
        return body.spread(self.values)


def nodal_field(solution: Any, name: str) -> NodalField:
    """The field called `name`, one of `COLOURS`, of a solution.

    Raises
    ------
    UsageError
        If there is no such field, or the solution was computed without its stresses.
    """
    if name == "displacement":
        return NodalField(DISPLACEMENT, np.linalg.norm(solution.displacement, axis=1), "m")
    if name == "largest_strain":
        return NodalField("largest strain\n|λ − 1|", nodal_strain(solution), "")
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


def nodal_strain(solution: Any) -> np.ndarray:
    """Largest |λ − 1| of the principal stretches λ at each node, shape (node,).

    F is taken at the corners of each element, of second order where the solution has mid-side nodes; a node takes the
    mean of the elements around it, weighted by volume. `SolidSolution.largest_strain` is the same at
    a quadrature point, so the two maxima differ by some percent.
    """
    mesh, between = solution.mesh, getattr(solution, "mid_sides", None)
    points, displacement = mesh.points, np.asarray(solution.displacement, dtype=float)
    before, after = points[mesh.tetrahedra], (points + displacement)[mesh.tetrahedra]
    middles_before, middles_after = ((p[:, :, None] + p[:, None]) / 2 for p in (before, after))
    if between is not None:
        i, j = EDGES.T
        middle = middles_of(between.edges, mesh.tetrahedra[:, EDGES])
        for ends, places in (
            (middles_before, between.points),
            (middles_after, between.points + between.displacement),
        ):
            ends[:, i, j] = ends[:, j, i] = places[middle]
    tangents = _tangents(before, middles_before)
    gradients = _tangents(after, middles_after) @ np.linalg.inv(tangents)
    strain = np.abs(np.linalg.svd(gradients, compute_uv=False) - 1).max(axis=2)
    volume = np.repeat(np.abs(np.linalg.det(before[:, 1:] - before[:, :1])), 4)
    corners, count = mesh.tetrahedra.ravel(), len(points)
    sums = np.bincount(corners, strain.ravel() * volume, minlength=count)
    weights = np.bincount(corners, volume, minlength=count)
    return np.asarray(sums / np.where(weights > 0, weights, 1.0))


def _tangents(corners: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Derivatives (e, 4, 3, 3) at the corners of elements of second order, along their three edges as columns.

    Parameters
    ----------
    corners : (e, 4, 3) array
    middles : (e, 4, 4, 3) array
        Between each two corners.
    """
    along = 4 * middles - corners[:, None] - 3 * corners[:, :, None]
    return np.moveaxis(along[:, np.arange(4)[:, None], OTHERS], 2, 3)
