"""A block's surface and dents in it, made by formula."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

SIZE = np.array([0.10, 0.10, 0.05])
CELLS = (40, 40, 20)


def _face(axis: int, far: bool) -> tuple[np.ndarray, np.ndarray]:
    """One face of the box: points and outward triangles."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    across, up = np.linspace(0, SIZE[u], CELLS[u] + 1), np.linspace(0, SIZE[v], CELLS[v] + 1)
    points = np.zeros((across.size, up.size, 3))
    points[..., u], points[..., v] = across[:, None], up[None, :]
    points[..., axis] = SIZE[axis] if far else 0.0
    number = np.arange(across.size * up.size).reshape(across.size, up.size)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    halves = [np.stack(way, axis=-1).reshape(-1, 3) for way in ((a, b, c), (a, c, d))]
    triangles = np.concatenate(halves)
    return points.reshape(-1, 3), triangles if far else triangles[:, ::-1]


def block_mesh() -> Any:
    """Points, triangles and named surfaces of a box of 100 × 100 × 50 mm."""
    points, triangles, surface = [], [], []
    for axis in range(3):
        for far in (False, True):
            p, t = _face(axis, far)
            triangles.append(t + sum(map(len, points)))
            points.append(p)
            surface.append(np.full(len(t), {(2, False): 0, (2, True): 1}.get((axis, far), 2)))
    together, index = np.unique(np.round(np.concatenate(points), 9), axis=0, return_inverse=True)
    return SimpleNamespace(
        points=together,
        triangles=index.ravel()[np.concatenate(triangles)],
        surface_of=np.concatenate(surface),
        surfaces=("bottom", "top", "side"),
    )


def dent(mesh: Any, depth: float) -> Any:
    """What a sphere of 10 mm might leave, `depth` (m) deep, in the middle of the top."""
    x, y, z = mesh.points.T
    far = ((x - 0.05) ** 2 + (y - 0.05) ** 2) / 0.02**2
    u = np.zeros_like(mesh.points)
    u[:, 2] = -depth * np.exp(-far) * (z / SIZE[2]) ** 2
    return SimpleNamespace(
        mesh=mesh,
        displacement=u,
        von_mises=1.5e6 * depth * np.exp(-far) * z,
        response=np.array([0.0, 0.0, 80 * depth]),
        potential_energy=40 * depth**2,
        probe=SimpleNamespace(radius=0.010),
        centre=np.array([0.05, 0.05, 0.06 - depth]),
        fixed="bottom",
        converged=True,
    )


def dents(count: int = 6, deepest: float = 0.010) -> list[Any]:
    """A probe pressed in steps."""
    mesh = block_mesh()
    return [dent(mesh, depth) for depth in np.linspace(0.0, deepest, count)]


def ball(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and outward triangles of a sphere of 50 mm."""
    n = rings
    polar = np.pi * np.arange(n + 1)[:, None] / n
    around = np.pi * np.arange(2 * n)[None, :] / n
    unit = [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar) + 0 * around]
    points = 0.05 * np.stack(unit, axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(n + 1, 2 * n)
    number[0], number[-1] = 0, number[-1, 0]
    a, b, c, d = number[:-1], number[1:], np.roll(number[1:], -1, axis=1), np.roll(number[:-1], -1, axis=1)
    triangles = np.concatenate([np.stack(w, axis=-1).reshape(-1, 3) for w in ((a, b, c), (a, c, d))])
    return points, triangles[(np.diff(np.sort(triangles, axis=1), axis=1) > 0).all(axis=1)]
