"""What an answer of second order is between the vertices: places and displacements in the middle of edges."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from palpate.physics.solid.field import SolidField

__all__ = ["CORNERS", "MIDDLES", "MidSides", "Middles"]

CORNERS = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]])  # of NGSolve's tetrahedron
PAIRS = list(itertools.combinations(range(4), 2))
MIDDLES = np.array([(CORNERS[i] + CORNERS[j]) / 2 for i, j in PAIRS])  # of its edges


@dataclass(frozen=True, eq=False)
class MidSides:
    """Nodes in the middle of edges.

    Attributes
    ----------
    edges : (m, 2) int array
        Vertices that each lies between, the lower number first, in ascending order.
    points : (m, 3) array
        Places at rest in m; beside the straight edge where elements are curved.
    displacement : (m, 3) array
        In m.
    """

    edges: np.ndarray
    points: np.ndarray
    displacement: np.ndarray


class Middles:
    """The middles of a field's edges, found once."""

    def __init__(self, field: SolidField) -> None:
        self._field = field

    def show(self) -> MidSides:
        """The middles, displaced as the field is."""
        edges, places, points = self._known
        return MidSides(edges, points, np.asarray(self._field.displacement(places)))

    @cached_property
    def _known(self) -> tuple[np.ndarray, Any, np.ndarray]:
        """Edges (m, 2), NGSolve's mapped points in their middles, and these places (m, 3) in m."""
        import ngsolve

        mesh = self._field.mesh
        rule = ngsolve.IntegrationRule(points=[tuple(m) for m in MIDDLES], weights=[1 / 36] * 6)
        mapped = mesh.MapToAllElements(rule, mesh.Materials(".*"))
        nodes = mesh.ngmesh.Elements3D().NumPy()["nodes"][:, :4].astype(np.int64) - 1
        ends = np.sort(nodes[:, PAIRS].reshape(-1, 2), axis=1)
        edges, first = np.unique(ends, axis=0, return_index=True)
        places = mapped[first]
        points = np.asarray(ngsolve.CF((ngsolve.x, ngsolve.y, ngsolve.z))(places))
        return edges, places, points
