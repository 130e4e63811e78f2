"""Points spread over a part of a surface, where the element size shall be small."""

from __future__ import annotations

import numpy as np

from palpate.physics.geometry.groups import members
from palpate.physics.geometry.mesh import BodyMesh
from palpate.physics.geometry.refinement import FineMesh, require_budget

__all__ = ["points_on", "scattered"]


def points_on(mesh: BodyMesh, refinement: FineMesh) -> tuple[np.ndarray, float]:
    """Points of the refined part of a surface, at most half an element size apart.

    The triangles are halved across their longest edges until they are small enough. Where the box holds no point,
    the refinement asks for nothing.

    Parameters
    ----------
    mesh : BodyMesh
        Any mesh of the body, coarse for example.
    refinement : FineMesh

    Returns
    -------
    points : (n, 3) array
        In m, on the mesh's triangles.
    area : float
        That the points stand for, in m².

    Raises
    ------
    UsageError
        If the surface would take too many elements.
    """
    if not members(refinement.surface, mesh.surfaces):
        return np.empty((0, 3)), 0.0
    corners = mesh.points[mesh.triangles_of(refinement.surface)]
    small = []
    while len(corners):
        corners = corners[_meets(corners, refinement)]
        require_budget([], [(_areas(corners).sum(), refinement.element)])
        fits = _longest(corners)[1] <= refinement.element / 2
        small.append(corners[fits])
        corners = _halved(corners[~fits])
    triangles = np.concatenate(small) if small else np.empty((0, 3, 3))
    centres = triangles.mean(axis=1)
    kept = _within(centres, refinement)
    return centres[kept], float(_areas(triangles[kept]).sum())


def scattered(corners: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (t, 3, 3) halved until no edge is longer than `size` m; and the index of the triangle of each."""
    origin = np.arange(len(corners))
    small, origins = [], []
    while len(corners):
        fits = _longest(corners)[1] <= size
        small.append(corners[fits])
        origins.append(origin[fits])
        corners, origin = _halved(corners[~fits]), np.tile(origin[~fits], 2)
    return np.concatenate(small), np.concatenate(origins)


def _areas(corners: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def _meets(corners: np.ndarray, refinement: FineMesh) -> np.ndarray:
    """Which triangles (t, 3, 3) have a box that touches the refinement's, bool (t,)."""
    if refinement.lower is None or refinement.upper is None:
        return np.ones(len(corners), dtype=bool)
    low, high = corners.min(axis=1), corners.max(axis=1)
    return np.asarray(((low <= refinement.upper) & (high >= refinement.lower)).all(axis=1))


def _within(points: np.ndarray, refinement: FineMesh) -> np.ndarray:
    if refinement.lower is None or refinement.upper is None:
        return np.ones(len(points), dtype=bool)
    return np.asarray(((points >= refinement.lower) & (points <= refinement.upper)).all(axis=1))


def _longest(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the corner opposite to the longest edge, and that edge's length in m; each (t,)."""
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1), axis=2)
    return lengths.argmax(axis=1), lengths.max(axis=1)


def _halved(corners: np.ndarray) -> np.ndarray:
    """Each triangle cut in two across its longest edge, shape (2t, 3, 3)."""
    apex, _ = _longest(corners)
    rows = np.arange(len(corners))
    a, b, c = (corners[rows, (apex + k) % 3] for k in range(3))
    middle = (b + c) / 2
    return np.concatenate([np.stack([a, b, middle], axis=1), np.stack([a, middle, c], axis=1)])
