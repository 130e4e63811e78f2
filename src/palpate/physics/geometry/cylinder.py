"""The cylinder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from palpate.physics.arguments import require_positive
from palpate.physics.geometry.block import name_upright_faces
from palpate.physics.geometry.checks import require_size
from palpate.physics.geometry.isometries import Isometry, round_isometries
from palpate.physics.geometry.shape import Solid
from palpate.physics.words import millimetres

__all__ = ["Cylinder"]


@dataclass(frozen=True)
class Cylinder(Solid):
    """A round cylinder that stands on the origin: its axis is z, from 0 to `height`.

    Surfaces are ``top``, ``bottom`` and ``side``; the region is ``body``. Elements are curved.

    Attributes
    ----------
    radius, height : float
        In m.
    element : float, optional
        Largest element size in m, by default a third of the least extent.

    Raises
    ------
    UsageError
        If a size is not positive, or tells of mistaken units.
    """

    curved: ClassVar[bool] = True

    radius: float = 0.05
    height: float = 0.05
    element: float | None = None

    def __post_init__(self) -> None:
        require_positive("The cylinder's radius", self.radius, "m")
        require_positive("The cylinder's height", self.height, "m")
        require_size("The cylinder", max(self.size))
        self._check_element()

    @property
    def surfaces(self) -> tuple[str, ...]:
        """``top``, ``bottom`` and ``side``."""
        return ("top", "bottom", "side")

    @property
    def size(self) -> tuple[float, float, float]:
        """Extent along x, y and z in m."""
        return (2 * self.radius, 2 * self.radius, self.height)

    @property
    def isometries(self) -> tuple[Isometry, ...]:
        """Turns about the axis and mirror images."""
        return round_isometries()

    def __str__(self) -> str:
        return f"cylinder of radius {millimetres(self.radius)}, {millimetres(self.height)} high"

    def solid(self) -> Any:
        """The cylinder, its faces named."""
        from netgen.occ import Cylinder as Round
        from netgen.occ import Pnt, Z

        round_bar = Round(Pnt(0, 0, 0), Z, r=self.radius, h=self.height)
        round_bar.mat("body")
        name_upright_faces(round_bar, self.height)
        return round_bar
