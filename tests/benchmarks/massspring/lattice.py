"""Meshes and values made by formula."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from palpate.physics.shapes.mesh import BodyMesh, outer_faces


@dataclass(frozen=True)
class Elastic:
    young: float = 9e3
    poisson: float = 0.45
    density: float = 1000.0


@dataclass(frozen=True)
class Sphere:
    radius: float = 0.010
    touches: str = "top"
    pad: float = 2e6
    stop: float = 0.004


def kuhn_points(
    cells: tuple[int, int, int], size: tuple[float, float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """A box of cubes, each cut into the six tetrahedra along the ways from one corner to the opposite one."""
    nodes = [np.linspace(0, s, n + 1) for n, s in zip(cells, size, strict=True)]
    points = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([n + 1 for n in cells])
    tetrahedra = []
    for corner in itertools.product(*(range(n) for n in cells)):
        for way in itertools.permutations(range(3)):
            at, corners = list(corner), [number[corner]]
            for axis in way:
                at[axis] += 1
                corners.append(number[tuple(at)])
            even = np.linalg.det(np.eye(3)[list(way)]) > 0
            tetrahedra.append(corners if even else [corners[0], corners[2], corners[1], corners[3]])
    return points, np.array(tetrahedra)


def kuhn_block(
    cells: tuple[int, int, int] = (6, 6, 4), size: tuple[float, float, float] = (0.06, 0.06, 0.04)
):
    """The box as a `BodyMesh` with surfaces bottom, top and side."""
    points, tetrahedra = kuhn_points(cells, size)
    triangles = outer_faces(tetrahedra)
    heights = points[triangles][:, :, 2]
    bottom, top = np.all(heights < 1e-12, axis=1), np.all(heights > size[2] - 1e-12, axis=1)
    surface = np.select([bottom, top], [0, 1], 2)
    return BodyMesh(
        points,
        tetrahedra,
        triangles,
        surface,
        np.zeros(len(tetrahedra), int),
        ("bottom", "top", "side"),
        ("body",),
    )
