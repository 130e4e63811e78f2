"""Round bodies that stand upright: the cylinder, and the tube, which is hollow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.physics.shapes.block import name_upright_faces
from palpate.physics.shapes.shape import Isometry, Solid, round_isometries

__all__ = [
    "Cylinder",
    "Tube",
]


@dataclass(frozen=True)
class Cylinder(Solid):
    """A round cylinder that stands on the origin: its axis is z, from 0 to `height`.

    Surfaces are ``top``, ``bottom`` and ``side``; the region is ``body``. Elements are curved.

    Attributes
    ----------
    radius, height : float
        Radius and extent along z, m.
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
        checks.positive("The cylinder's radius", self.radius, "m")
        checks.positive("The cylinder's height", self.height, "m")
        self.check_extent("The cylinder")

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


@dataclass(frozen=True)
class Tube(Solid):
    """A round tube that stands on the plane z = 0; its axis is z.

    Surfaces are ``top``, ``bottom``, ``inside`` and ``outside``; the region is ``body``. Elements are curved.

    Attributes
    ----------
    inner_radius, outer_radius, height : float
        Radii of the wall's two sides and extent along z, m.
    element : float, optional
        Largest element size in m, by default half the wall's thickness or a third of the height.

    Raises
    ------
    UsageError
        If a size is not positive, the wall has no thickness, or the sizes tell of mistaken units.
    """

    curved: ClassVar[bool] = True

    inner_radius: float = 0.015
    outer_radius: float = 0.025
    height: float = 0.10
    element: float | None = None

    def __post_init__(self) -> None:
        for name in ("inner_radius", "outer_radius", "height"):
            checks.positive(f"The tube's {name}", getattr(self, name), "m")
        if self.inner_radius >= self.outer_radius:
            raise UsageError(
                f"The tube's inner radius is {self.inner_radius:g} m, its outer radius {self.outer_radius:g} m.",
                why="The wall would have no thickness.",
                fix="Give the inner radius first, smaller than the outer one.",
            )
        self.check_extent("The tube")

    @property
    def surfaces(self) -> tuple[str, ...]:
        """``top``, ``bottom``, ``inside`` and ``outside``."""
        return ("top", "bottom", "inside", "outside")

    @property
    def size(self) -> tuple[float, float, float]:
        """Extent along x, y and z in m."""
        return (2 * self.outer_radius, 2 * self.outer_radius, self.height)

    @property
    def coarse(self) -> float:
        """Largest element size in m."""
        wall = self.outer_radius - self.inner_radius
        return self.element if self.element is not None else min(wall / 2, self.height / 3)

    @property
    def isometries(self) -> tuple[Isometry, ...]:
        """Turns about the axis and mirror images."""
        return round_isometries()

    def __str__(self) -> str:
        radii = f"{millimetres(self.inner_radius)} inside, {millimetres(self.outer_radius)} outside"
        return f"tube of radius {radii}, {millimetres(self.height)} high"

    def solid(self) -> Any:
        """The tube, its faces named."""
        from netgen.occ import Cylinder, Pnt, Z

        outer = Cylinder(Pnt(0, 0, 0), Z, r=self.outer_radius, h=self.height)
        inner = Cylinder(Pnt(0, 0, 0), Z, r=self.inner_radius, h=self.height)
        wall = outer - inner
        wall.mat("body")
        name_upright_faces(wall, self.height)
        between = (self.inner_radius + self.outer_radius) / 2
        for face in wall.faces:
            if face.name == "side":
                high = face.bounding_box[1]
                face.name = "inside" if high[0] < between else "outside"
        return wall
