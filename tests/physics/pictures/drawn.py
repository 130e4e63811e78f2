"""Solutions made by formula, on a block of tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.physics.geometry.block import Block
from palpate.physics.geometry.mesh import BodyMesh, body_mesh


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
