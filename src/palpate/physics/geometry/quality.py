"""How well shaped the tetrahedra of a mesh are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["MeshQuality", "mesh_quality", "tetrahedron_volumes"]

# pairs of faces that share an edge; face i is opposite to vertex i
PAIRS = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


@dataclass(frozen=True)
class MeshQuality:
    """The worst elements of a mesh.

    Attributes
    ----------
    least_scaled_jacobian : float
        Volume of the box that three edges of one corner span, over the product of their lengths, times √2; the
        least over the corners and elements. 1 for regular tetrahedra, 0 for flat ones, negative for inverted
        ones (Knupp 2001, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23, 193-218).
    mean_scaled_jacobian : float
        The mean over the elements of the least over each one's corners.
    least_angle, largest_angle : float
        Angles between two faces in rad; 1.231 in a regular tetrahedron.
    shortest_edge, longest_edge : float
        In m.
    """

    least_scaled_jacobian: float
    mean_scaled_jacobian: float
    least_angle: float
    largest_angle: float
    shortest_edge: float
    longest_edge: float


def tetrahedron_volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Volumes in m³, shape (e,); negative for left-handed tetrahedra."""
    origin, a, b, c = np.moveaxis(points[tetrahedra], 1, 0)
    return np.asarray(np.einsum("ei,ei->e", np.cross(a - origin, b - origin), c - origin) / 6)


def mesh_quality(points: np.ndarray, tetrahedra: np.ndarray) -> MeshQuality:
    """The figures of `MeshQuality` for points (node, 3) and right-handed tetrahedra (e, 4)."""
    corners = points[tetrahedra]
    edges = corners[:, None, :, :] - corners[:, :, None, :]
    lengths = np.linalg.norm(edges, axis=-1)
    at_corner = lengths + np.eye(4)  # an edge from a corner to itself does not shrink the product
    box = 6 * tetrahedron_volumes(points, tetrahedra)
    scaled = np.sqrt(2) * box / at_corner.prod(axis=2).max(axis=1)
    angles = _dihedral_angles(corners)
    between = lengths[:, ~np.eye(4, dtype=bool)]
    return MeshQuality(
        least_scaled_jacobian=float(scaled.min()),
        mean_scaled_jacobian=float(scaled.mean()),
        least_angle=float(angles.min()),
        largest_angle=float(angles.max()),
        shortest_edge=float(between.min()),
        longest_edge=float(between.max()),
    )


def _dihedral_angles(corners: np.ndarray) -> np.ndarray:
    """Angles in rad between the faces of right-handed tetrahedra (e, 4, 3), shape (e, 6)."""
    a, b, c, d = np.moveaxis(corners, 1, 0)
    normals = np.stack(
        [np.cross(c - b, d - b), np.cross(d - a, c - a), np.cross(b - a, d - a), np.cross(c - a, b - a)],
        axis=1,
    )
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    cosine = np.einsum("epi,epi->ep", normals[:, PAIRS[:, 0]], normals[:, PAIRS[:, 1]])
    return np.asarray(np.pi - np.arccos(np.clip(cosine, -1, 1)))
