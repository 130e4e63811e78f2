"""A surface split along its sharp edges, so that shading is smooth on each side of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["Split", "outer_triangles", "split"]

CREASE = math.cos(math.radians(40.0))
FACES = np.array(
    [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
)  # of a right-handed tetrahedron, seen from outside


@dataclass(frozen=True, eq=False)
class Split:
    """A surface whose points belong to one smooth patch each.

    Attributes
    ----------
    nodes : (p,) int array
        The body's node that each point stands for.
    triangles : (t, 3) int array
        Points.
    creases : (s, 2) int array
        Points at the ends of each sharp edge.
    fixed : (s, 2) int array
        Points at the ends of each edge around the fixed triangles.
    """

    nodes: np.ndarray
    triangles: np.ndarray
    creases: np.ndarray
    fixed: np.ndarray


def split(rest: np.ndarray, triangles: np.ndarray, fixed: np.ndarray) -> Split:
    """Split a surface along edges sharper than 40°.

    Parameters
    ----------
    rest : (node, 3) array
    triangles : (t, 3) int array
    fixed : (t,) bool array
        Triangles whose border is wanted.
    """
    first, second = _pairs(triangles)  # corners at which a shared edge starts and ends, on both sides
    a, b, c = np.moveaxis(rest[triangles], 1, 0)
    n = np.cross(b - a, c - a)
    n = n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)
    one, two = first[:, 0] // 3, second[:, 0] // 3
    smooth = np.einsum("si,si->s", n[one], n[two]) >= CREASE
    same = np.concatenate([np.stack([first[smooth, k], second[smooth, k]], axis=1) for k in (0, 1)])
    patch = _components(3 * len(triangles), same)
    corners, point = np.unique(patch, return_inverse=True)
    nodes, faces = triangles.ravel()[corners], point.reshape(-1, 3)
    sharp, around = ~smooth, fixed[one] != fixed[two]
    flat = faces.ravel()
    return Split(nodes, faces, flat[first[sharp]], flat[first[around]])


def outer_triangles(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces (t, 3) that belong to one tetrahedron (e, 4) only."""
    faces = tetrahedra[:, FACES].reshape(-1, 3)
    _, inverse, count = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    return np.asarray(faces[count[inverse.ravel()] == 1])


def _pairs(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each edge that two triangles share: its two corners (s, 2) in either, in the same order of nodes."""
    corner = np.arange(triangles.size).reshape(-1, 3)
    ends = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]])
    nodes = triangles.ravel()[ends]
    turned = nodes[:, 0] > nodes[:, 1]
    ends[turned], nodes[turned] = ends[turned][:, ::-1], nodes[turned][:, ::-1]
    order = np.lexsort((nodes[:, 1], nodes[:, 0]))
    ends, nodes = ends[order], nodes[order]
    twin = np.flatnonzero(np.all(nodes[1:] == nodes[:-1], axis=1))
    return ends[twin], ends[twin + 1]


def _components(count: int, pairs: np.ndarray) -> np.ndarray:
    """Smallest member of each one's group (count,), where `pairs` (s, 2) belong together."""
    label = np.arange(count)
    while True:
        least = np.minimum(label[pairs[:, 0]], label[pairs[:, 1]])
        after = label.copy()
        np.minimum.at(after, pairs[:, 0], least)
        np.minimum.at(after, pairs[:, 1], least)
        after = after[after]
        if np.array_equal(after, label):
            return label
        label = after
