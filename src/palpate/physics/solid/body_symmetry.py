"""Symmetry of a body: rotations and reflections that leave it, its supports and a touched surface in place.

A touch at a place then tells of the touches at all images of that place: U(c) = U(M c), F(M c) = M F(c).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.interactions.sphere import SphereProbe
from palpate.physics.materials.fibres import FibreReinforced
from palpate.physics.materials.pre_stretched import PreStretched
from palpate.physics.materials.user import UserMaterial
from palpate.physics.shapes.naming import members
from palpate.physics.shapes.shape import NO_ISOMETRIES, Isometry

if TYPE_CHECKING:
    from palpate.physics.solid.solid_body import Body

__all__ = ["Symmetry", "fundamental_part", "symmetry_of"]

DIRECTED = (FibreReinforced, UserMaterial)  # have directions of their own, or may have
LEAST = 1e-6  # share of a part's size within which two places are one: rounding


@dataclass(frozen=True, eq=False)
class Symmetry:
    """A group of isometries about one point."""

    matrices: np.ndarray  # (k, 3, 3) rotations and reflections, the identity among them
    about: np.ndarray  # (3,) point that stays, m

    def __len__(self) -> int:
        return len(self.matrices)

    def part(self, mask: Iterable[bool]) -> Symmetry:
        """Return the isometries of a mask; they must be a group too."""
        return Symmetry(self.matrices[list(mask)], self.about)

    def describe(self) -> dict[str, Any]:
        """Return the group as plain data for a JSON file."""
        return {"about": self.about.tolist(), "isometries": self.matrices.tolist()}


def symmetry_of(body: Body, touches: str) -> Symmetry:
    """Return the isometries of a body that is touched on a surface; the identity alone where there is no symmetry.

    Fixed surfaces and the touched one must stay where they are as a whole, gravity must keep its direction, and no
    material may have directions; of one that is stretched beforehand the stretches must stay. Bodies with constant
    interactions are not looked into.
    """
    shape = body.geometry
    whole: tuple[Isometry, ...] = getattr(shape, "isometries", NO_ISOMETRIES)
    if body.held or any(_is_directed(material) for material in body.materials.values()):
        whole = NO_ISOMETRIES
    fixed = {name for entry in body.fixed for name in members(entry, shape.surfaces)}
    touched = set(members(touches, shape.surfaces))
    gravity = np.array(body.gravity)
    stretches = [np.diag(m.stretches) for m in body.materials.values() if isinstance(m, PreStretched)]
    isometries = [
        isometry
        for isometry in whole
        if {isometry.surface(name) for name in fixed} == fixed
        and {isometry.surface(name) for name in touched} == touched
        and np.allclose(isometry.matrix @ gravity, gravity)
        and all(np.allclose(isometry.matrix @ S @ isometry.matrix.T, S) for S in stretches)
    ]
    return Symmetry(np.array([isometry.matrix for isometry in isometries]), np.array(isometries[0].about))


def _is_directed(material: Any) -> bool:
    """Return whether a material, or one that it is made from, has directions."""
    if isinstance(material, DIRECTED):
        return True
    if not is_dataclass(material):
        return False
    parts = (getattr(material, entry.name) for entry in fields(material))
    return any(_is_directed(part) for part in parts if is_dataclass(part))


def fundamental_part(body: Body, probe: SphereProbe) -> SphereProbe:
    """Return the probe, over a part of its contact points whose images are all of it.

    For groups about an upright axis in the middle of the contact points: with n mirror planes the box around a sector
    of the angle π/n. Any other probe comes back as it is. The mesh is then fine there only.
    """
    symmetry = symmetry_of(body, probe.touches)
    upright = np.allclose(symmetry.matrices[:, 2], [0.0, 0.0, 1.0])
    mirrors = int(np.sum(np.linalg.det(symmetry.matrices) < 0))
    if probe.over is None or not upright or mirrors < 2 or not _has_mirror_on_x(symmetry):
        return probe
    low, high = (np.array(corner[:2], dtype=float) for corner in probe.over)
    middle, half = symmetry.about[:2], (high - low) / 2
    if not np.allclose((low + high) / 2, middle, atol=LEAST * half.max()):
        return probe
    width = half[1] if mirrors == 2 else min(half[1], half[0] * float(np.tan(np.pi / mirrors)))
    corners = (middle, middle + np.array([half[0], width]))
    lower, upper = ((*corner.tolist(), *own[2:]) for corner, own in zip(corners, probe.over, strict=True))
    return replace(probe, over=(lower, upper))


def _has_mirror_on_x(symmetry: Symmetry) -> bool:
    """Return whether y → −y is one of them: a sector begins at the x axis."""
    return any(np.allclose(matrix, np.diag([1.0, -1.0, 1.0])) for matrix in symmetry.matrices)
