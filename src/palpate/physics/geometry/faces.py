"""Where the named surfaces of a body are: what tells ``face 3`` from ``face 4``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.physics.geometry.mesh import BodyMesh
from palpate.physics.words import number

__all__ = ["Face", "faces_of"]

ONE_WAY = 0.1  # length of the mean normal below which a surface faces nowhere in the mean

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Face:
    """A named surface.

    Attributes
    ----------
    name : str
    area : float
        In m².
    centre : (3,) tuple
        Of its area, in m.
    normal : (3,) tuple
        Mean outward normal: of length one where the surface is plane, zero where it faces all ways.
    lower, upper : (3,) tuple
        Corners of the box around it, in m.
    """

    name: str
    area: float
    centre: Triple
    normal: Triple
    lower: Triple
    upper: Triple

    def __str__(self) -> str:
        facing = "all ways" if np.linalg.norm(self.normal) < ONE_WAY else _words(self.normal, 1.0, 2)
        box = f"{_words(self.lower)} … {_words(self.upper)} mm"
        area = f"{number(1e6 * self.area)} mm²"
        return f"{self.name}: {area} around {_words(self.centre)} mm, facing {facing}, in {box}"


def faces_of(mesh: BodyMesh) -> tuple[Face, ...]:
    """The surfaces of a mesh, in its order."""
    return tuple(_face(mesh, name, mesh.surface_of == i) for i, name in enumerate(mesh.surfaces))


def _face(mesh: BodyMesh, name: str, mine: np.ndarray) -> Face:
    corners, vectors = mesh.points[mesh.triangles[mine]], mesh.area_vectors[mine]
    areas = np.linalg.norm(vectors, axis=1)
    area = float(areas.sum())
    return Face(
        name,
        area,
        _triple(areas @ corners.mean(axis=1) / area),
        _triple(vectors.sum(axis=0) / area),
        _triple(corners.min(axis=(0, 1))),
        _triple(corners.max(axis=(0, 1))),
    )


def _triple(values: np.ndarray) -> Triple:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _words(values: Triple, scale: float = 1e3, digits: int = 4) -> str:
    # what is nothing beside the largest is rounding dust
    dust = 1e-9 * max(map(abs, values))
    return f"({', '.join(number(0.0 if abs(v) < dust else scale * v, digits) for v in values)})"
