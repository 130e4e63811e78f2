"""Solutions made by formula, on a block of tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.physics.shapes.block import Block
from palpate.physics.shapes.mesh import BodyMesh, body_mesh


@dataclass(frozen=True, eq=False)
class Made:
    """What `plot_solution` and `write_vtu` need of a solution, and some of what they take where it is there."""

    mesh: BodyMesh
    displacement: np.ndarray
    von_mises: np.ndarray | None = None
    response: np.ndarray | None = None
    potential_energy: float | None = None
    probe: Any = None
    centre: np.ndarray | None = None
    fixed: tuple[str, ...] = ("bottom",)
    mid_sides: Any = None

    with_ = replace


def block_mesh() -> BodyMesh:
    """100 × 100 × 50 mm in elements of 15 mm."""
    return body_mesh(Block(size=(0.10, 0.10, 0.05)).mesh())


def dented(mesh: BodyMesh, depth: float = 0.006) -> Made:
    """A dent that a sphere of 10 mm might leave in the middle of the top."""
    x, y, z = mesh.points.T
    far = ((x - 0.05) ** 2 + (y - 0.05) ** 2) / 0.02**2
    u = np.zeros_like(mesh.points)
    u[:, 2] = -depth * np.exp(-far) * z / 0.05
    return Made(
        mesh,
        u,
        von_mises=9e3 * np.exp(-far),
        response=np.array([0.0, 0.0, 0.5]),
        potential_energy=1e-3,
        probe=SimpleNamespace(radius=0.010),
        centre=np.array([0.05, 0.05, 0.06 - depth]),
    )


def bent(mesh: BodyMesh) -> Made:
    """u_z = 5 x² m⁻¹, at the vertices and in the middle of the edges."""
    pairs = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    edges = np.unique(np.sort(mesh.tetrahedra[:, pairs].reshape(-1, 2), axis=1), axis=0)
    middles = mesh.points[edges].mean(axis=1)
    lifts = [np.outer(5 * points[:, 0] ** 2, [0.0, 0.0, 1.0]) for points in (mesh.points, middles)]
    between = SimpleNamespace(edges=edges, points=middles, displacement=lifts[1])
    return Made(mesh, lifts[0], mid_sides=between)
