"""The block: a rectangular box."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from palpate.physics.arguments import require_positive
from palpate.physics.geometry.checks import require_size, require_triple
from palpate.physics.geometry.groups import UPRIGHT
from palpate.physics.geometry.isometries import Isometry, box_isometries
from palpate.physics.geometry.shape import Solid
from palpate.physics.words import millimetres

__all__ = ["Block", "name_sides", "name_upright_faces"]


@dataclass(frozen=True)
class Block(Solid):
    """A box with a corner at the origin: x in 0 … size[0], y in 0 … size[1], z in 0 … size[2].

    Surfaces are ``top`` (largest z), ``bottom`` (z = 0) and the upright faces ``x_min``, ``x_max``, ``y_min`` and
    ``y_max``, which together can be called ``side``; the region is ``body``.

    Attributes
    ----------
    size : tuple of three floats
        Extent along x, y and z in m.
    element : float, optional
        Largest element size in m, by default a third of the least extent.

    Raises
    ------
    UsageError
        If a size is not positive, or tells of mistaken units.
    """

    size: tuple[float, float, float] = (0.10, 0.10, 0.05)
    element: float | None = None

    def __post_init__(self) -> None:
        size = require_triple("The size of a block", self.size)
        for axis, extent in zip("xyz", size, strict=True):
            require_positive(f"The block's extent along {axis}", extent, "m")
        require_size("The block", max(size))
        object.__setattr__(self, "size", size)
        self._check_element()

    @property
    def surfaces(self) -> tuple[str, ...]:
        """``top``, ``bottom`` and the four upright faces."""
        return ("top", "bottom", *UPRIGHT)

    @property
    def isometries(self) -> tuple[Isometry, ...]:
        """Those of the box."""
        return box_isometries(self.size)

    def __str__(self) -> str:
        return f"block {millimetres(*self.size)}"

    def solid(self) -> Any:
        """The box, its faces named."""
        from netgen.occ import Box, Pnt

        box = Box(Pnt(0, 0, 0), Pnt(*self.size))
        box.mat("body")
        name_upright_faces(box, self.size[2])
        name_sides(box, self.size)
        return box


def name_upright_faces(solid: Any, height: float) -> None:
    """Name the faces of a solid between z = 0 and z = height: ``bottom``, ``top`` and for the others ``side``."""
    for face in solid.faces:
        z = face.center.z
        level = abs(z - height) < 1e-6 * height, abs(z) < 1e-6 * height
        face.name = "top" if level[0] else "bottom" if level[1] else "side"


def name_sides(solid: Any, size: tuple[float, float, float]) -> None:
    """Name the upright faces of a box with a corner at the origin by where they are."""
    for face in solid.faces:
        for axis, at, far in zip("xy", (face.center.x, face.center.y), size, strict=False):
            if face.name == "side" and min(abs(at), abs(at - far)) < 1e-6 * far:
                face.name = f"{axis}_min" if at < far / 2 else f"{axis}_max"
