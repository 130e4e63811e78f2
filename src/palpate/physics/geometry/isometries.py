"""Rotations and reflections that leave a shape where it is, and which surface each of them takes where."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

__all__ = ["NO_ISOMETRIES", "Isometry", "box_isometries", "mirror", "round_isometries"]

IMAGES = 16  # of a body of revolution, which has no end of them: eight turns, each with its mirror image
EQUAL = 1e-12  # relative difference of two lengths that count as one
BOX_FACES = {
    (2, 1): "top",
    (2, -1): "bottom",
    (0, -1): "x_min",
    (0, 1): "x_max",
    (1, -1): "y_min",
    (1, 1): "y_max",
}


@dataclass(frozen=True, eq=False)
class Isometry:
    """A rotation or reflection M about a point p: a place X goes to p + M (X − p).

    Attributes
    ----------
    matrix : (3, 3) array
        Orthogonal.
    about : (3,) array
        In m.
    goes : mapping of surface to surface
        Where surfaces go; those not named stay where they are.
    """

    matrix: np.ndarray
    about: np.ndarray
    goes: Mapping[str, str] = field(default_factory=dict)

    def surface(self, name: str) -> str:
        """The surface on which that of this name comes to lie."""
        return self.goes.get(name, name)

    @property
    def is_identity(self) -> bool:
        """Whether it moves nothing."""
        return bool(np.allclose(self.matrix, np.eye(3)))


NO_ISOMETRIES: tuple[Isometry, ...] = (Isometry(np.eye(3), np.zeros(3)),)
"""Of a shape that is not symmetric: the identity alone."""


def box_isometries(size: tuple[float, float, float], *, layered: bool = False) -> tuple[Isometry, ...]:
    """Of a box with a corner at the origin: 8 of a brick, 16 of a square prism, 48 of a cube.

    A `layered` one keeps its upright direction.
    """
    found = []
    for order in itertools.permutations(range(3)):
        if any(abs(size[i] - size[j]) > EQUAL * size[i] for i, j in enumerate(order)):
            continue
        for signs in itertools.product((1, -1), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if not layered or matrix[2, 2] == 1:
                found.append(Isometry(matrix, np.array(size) / 2, _box_faces(matrix)))
    return tuple(found)


def _box_faces(matrix: np.ndarray) -> dict[str, str]:
    """Where the faces of a box go: a normal ±e_j goes to ±M e_j."""
    goes = {}
    for (axis, sign), name in BOX_FACES.items():
        normal = sign * matrix[:, axis]
        to = int(np.argmax(np.abs(normal)))
        goes[name] = BOX_FACES[to, int(np.sign(normal[to]))]
    return goes


def round_isometries() -> tuple[Isometry, ...]:
    """Of a body of revolution about the z axis: a finite group of its turns and mirror images, 16 in all."""
    half = IMAGES // 2
    found = []
    for k in range(half):
        c, s = _exact(np.cos(2 * np.pi * k / half)), _exact(np.sin(2 * np.pi * k / half))
        for sign in (1.0, -1.0):
            matrix = np.array([[c, -sign * s, 0.0], [s, sign * c, 0.0], [0.0, 0.0, 1.0]])
            found.append(Isometry(matrix, np.zeros(3)))
    return tuple(found)


def mirror(x: float, y: float) -> tuple[Isometry, ...]:
    """Of a body with one mirror plane, which holds the z axis and the point (x, y) in m."""
    angle = 2 * np.arctan2(y, x)
    c, s = _exact(np.cos(angle)), _exact(np.sin(angle))
    reflection = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, 1.0]])
    return (*NO_ISOMETRIES, Isometry(reflection, np.zeros(3)))


def _exact(value: float) -> float:
    """Cosines of right angles without their rounding."""
    nearest = float(round(value))
    return nearest if abs(value - nearest) < 1e-12 else float(value)
