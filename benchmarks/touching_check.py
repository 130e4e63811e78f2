"""Is a state admissible? A check that shares nothing with palpate's solver but the unknowns and the mesh.

Displacements are read at the ten nodes of each quadratic tetrahedron. Everything else is NumPy: det F on a lattice
of 35 points in each element, its corners among them, and the gap to the sphere on 45 points of each quadratic
triangle of the touched surface. The solver looks at four points of an element and at its own quadrature points of
the surface.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["Inspection", "Inspector"]

IN_ELEMENT, IN_TRIANGLE = 4, 8  # subdivisions of the lattices
EDGES = {
    3: ((0, 1), (0, 2), (1, 2)),
    4: ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)),
}


@dataclass(frozen=True)
class Inspection:
    """What was found at one state.

    Attributes
    ----------
    volume_ratio : float
        Least det F.
    penetration : float
        Largest penetration of the pad in m.
    facing : float
        Least cosine between the deformed surface's normal and the way to the sphere's centre, where it is pressed.
    enclosed : bool
        Whether the sphere's centre is inside a deformed element.
    """

    volume_ratio: float
    penetration: float
    facing: float
    enclosed: bool

    def admissible(self, stop: float) -> bool:
        """Nothing inside out, the pad short of its stop (m), the surface pressed from outside."""
        return bool(
            self.volume_ratio > 0 and self.penetration < stop and self.facing > 0 and not self.enclosed
        )


class Inspector:
    """Looks at displacement states of one mesh with plane faces.

    Parameters
    ----------
    mesh : ngsolve.Mesh
    surface : str
        The touched one.
    radius : float
        Of the sphere, m.
    """

    def __init__(self, mesh: Any, surface: str, radius: float) -> None:
        from ngsolve import CF, GridFunction, IntegrationRule, VectorH1, x, y, z

        self.radius = radius
        self._state = GridFunction(VectorH1(mesh, order=2))
        self._inside, self._on = (
            mesh.MapToAllElements(IntegrationRule(_reference_nodes(corners), [1.0] * count), where)
            for corners, count, where in ((4, 10, mesh.Materials(".*")), (3, 6, mesh.Boundaries(surface)))
        )
        place = CF((x, y, z))
        self._nodes = np.asarray(place(self._inside)).reshape(-1, 10, 3)
        self._triangles = np.asarray(place(self._on)).reshape(-1, 6, 3)
        self._by_corner = _corner_slopes(self._nodes[:, :4])
        a, b, c = np.moveaxis(self._triangles[:, :3], 1, 0)
        self._outward = np.sign(np.cross(a - c, b - c)[:, 2])  # the touched surface faces up

    def inspect(self, unknowns: np.ndarray, centre: np.ndarray) -> Inspection:
        """Look at displacement unknowns (dof,) of NGSolve's VectorH1 of order 2 under a sphere at (3,) m."""
        self._state.vec.FV().NumPy()[:] = unknowns
        moved = np.asarray(self._state(self._inside)).reshape(-1, 10, 3)
        penetration, facing = self._pressed(centre)
        return Inspection(self._volume_ratio(moved), penetration, facing, self._encloses(moved, centre))

    def _volume_ratio(self, moved: np.ndarray) -> float:
        """Least det F over all lattice points of all elements, for displacements (e, 10, 3) of their nodes."""
        least = np.inf
        for weights in _lattice(4, IN_ELEMENT):
            slopes = np.einsum("nl,elj->enj", _shape_slopes(weights), self._by_corner)
            gradient = np.eye(3) + np.einsum("eni,enj->eij", moved, slopes)
            least = min(least, float(np.linalg.det(gradient).min()))
        return least

    def _pressed(self, centre: np.ndarray) -> tuple[float, float]:
        """Largest penetration in m and least cosine towards the centre, over the surface's lattice."""
        moved = self._triangles + np.asarray(self._state(self._on)).reshape(-1, 6, 3)
        deepest, facing = 0.0, 1.0
        for weights in _lattice(3, IN_TRIANGLE):
            places = np.einsum("n,tni->ti", _shapes(weights), moved)
            slopes = np.einsum("nl,tni->til", _shape_slopes(weights), moved)
            normals = np.cross(slopes[:, :, 0] - slopes[:, :, 2], slopes[:, :, 1] - slopes[:, :, 2])
            normals *= self._outward[:, None] / np.linalg.norm(normals, axis=1, keepdims=True)
            towards = centre - places
            distance = np.linalg.norm(towards, axis=1)
            pressed = distance < self.radius
            deepest = max(deepest, self.radius - float(distance.min()))
            cosines = np.einsum("ti,ti->t", towards, normals)[pressed] / distance[pressed]
            facing = min(facing, float(cosines.min(initial=1.0)))
        return deepest, facing

    def _encloses(self, moved: np.ndarray, centre: np.ndarray) -> bool:
        corners = (self._nodes + moved)[:, :4]
        near = np.all((corners.min(axis=1) <= centre) & (centre <= corners.max(axis=1)), axis=1)
        edges = np.moveaxis(corners[near, :3] - corners[near, 3:], 1, 2)
        shares = np.linalg.solve(edges, (centre - corners[near, 3])[:, :, None])[:, :, 0]
        return bool(np.any(np.all(shares >= 0, axis=1) & (shares.sum(axis=1) <= 1)))


def _reference_nodes(corners: int) -> list[tuple[float, ...]]:
    """Corners and middles of the edges on NGSolve's reference element, whose last corner is the origin."""
    unit = np.eye(corners)
    found = [*unit, *((unit[i] + unit[j]) / 2 for i, j in EDGES[corners])]
    return [tuple(weights[:-1].tolist()) for weights in found]


def _corner_slopes(corners: np.ndarray) -> np.ndarray:
    """∂λ/∂X of each barycentric coordinate λ in elements with corners (e, 4, 3), shape (e, 4, 3)."""
    inverse = np.linalg.inv(corners[:, :3] - corners[:, 3:])  # X - X₄ = (λ₁, λ₂, λ₃) · edges
    first = np.moveaxis(inverse, 1, 2)
    return np.concatenate([first, -first.sum(axis=1, keepdims=True)], axis=1)


def _lattice(corners: int, parts: int) -> list[np.ndarray]:
    """Barycentric coordinates of a regular lattice, its corners among them."""
    counts = itertools.product(range(parts + 1), repeat=corners)
    return [np.array(count) / parts for count in counts if sum(count) == parts]


def _shapes(weights: np.ndarray) -> np.ndarray:
    """Quadratic shape functions at barycentric coordinates: λ (2 λ - 1) at corners, 4 λᵢ λⱼ on edges."""
    edges = [4 * weights[i] * weights[j] for i, j in EDGES[len(weights)]]
    return np.array([*(weights * (2 * weights - 1)), *edges])


def _shape_slopes(weights: np.ndarray) -> np.ndarray:
    """Their derivatives in each λ, the λ taken as independent, shape (node, corner)."""
    slopes = [np.diag(4 * weights - 1)]
    for i, j in EDGES[len(weights)]:
        row = np.zeros((1, len(weights)))
        row[0, i], row[0, j] = 4 * weights[j], 4 * weights[i]
        slopes.append(row)
    return np.concatenate(slopes)
