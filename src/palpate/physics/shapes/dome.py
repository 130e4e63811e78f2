"""The dome: half an ellipsoid on a flat base, such as a breast phantom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.physics.shapes.naming import INTERFACE
from palpate.physics.shapes.shape import Isometry, Solid, mirror_isometries, round_isometries

__all__ = ["Dome", "Inclusion"]

# Element over an inclusion's radius. Larger ones, Netgen's own half a radius among them, can have all corners on the
# ball near its pole: once curved they are flat there, and a press of 2 mm turns them inside out.
LARGEST = 0.35


@dataclass(frozen=True)
class Inclusion:
    """A ball of another material inside a body.

    Attributes
    ----------
    centre : tuple of three floats
        Place of the ball's centre in the body's frame, m.
    radius : float
        Radius of the ball, m.
    """

    centre: tuple[float, float, float]
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checks.triple("The centre of an inclusion", self.centre, "m"))
        checks.positive("The radius of an inclusion", self.radius, "m")


@dataclass(frozen=True)
class Dome(Solid):
    """The upper half of an ellipsoid, its base centred on the origin in the plane z = 0.

    Surfaces are ``top`` (the round one) and ``bottom`` (the base). Regions are ``body``, with a `layer` also
    ``skin``, with an `inclusion` also ``inclusion``. Elements are curved.

    Attributes
    ----------
    radius : float
        Radius of the base, m.
    height : float, optional
        Extent along z, m; by default the radius, which makes half a ball.
    layer : float
        Thickness of the skin in m, at the base and at the top; 0 for none.
    inclusion : Inclusion, optional
        A ball inside the body, clear of the skin and of the base.
    element : float, optional
        Largest element size in m, by default a third of the height or of the radius.

    Raises
    ------
    UsageError
        If a size is not positive, the skin leaves no body, the inclusion touches the body's boundary, or the sizes
        tell of mistaken units.
    """

    curved: ClassVar[bool] = True

    radius: float = 0.06
    height: float | None = None
    layer: float = 0.0
    inclusion: Inclusion | None = None
    element: float | None = None

    def __post_init__(self) -> None:
        checks.positive("The dome's radius", self.radius, "m")
        checks.positive("The dome's height", self.peak, "m")
        if self.layer:
            checks.positive("The thickness of the dome's skin", self.layer, "m")
        if self.layer >= min(self.radius, self.peak):
            raise UsageError(
                f"The dome's skin is {self.layer:g} m thick, the dome {min(self.radius, self.peak):g} m.",
                why="The skin would leave no body.",
                fix="Give a thinner skin, or none.",
            )
        if self.inclusion is not None:
            self._check_inclusion(self.inclusion)
        self.check_extent("The dome")

    @property
    def peak(self) -> float:
        """Height of the top above the base in m: `height`, or the radius."""
        return self.radius if self.height is None else self.height

    @property
    def surfaces(self) -> tuple[str, ...]:
        """``top`` and ``bottom``."""
        return ("top", "bottom")

    @property
    def regions(self) -> tuple[str, ...]:
        """``body``, where asked for ``skin`` and ``inclusion``."""
        return ("body", *(["skin"] if self.layer else []), *(["inclusion"] if self.inclusion else []))

    @property
    def size(self) -> tuple[float, float, float]:
        """Extent along x, y and z in m."""
        return (2 * self.radius, 2 * self.radius, self.peak)

    @property
    def isometries(self) -> tuple[Isometry, ...]:
        """Turns about the axis and mirror images; one mirror image if an inclusion lies beside the axis."""
        x, y = self.inclusion.centre[:2] if self.inclusion else (0.0, 0.0)
        return mirror_isometries(x, y) if x or y else round_isometries()

    def __str__(self) -> str:
        skin = f", skin of {millimetres(self.layer)}" if self.layer else ""
        inside = f", inclusion of radius {millimetres(self.inclusion.radius)}" if self.inclusion else ""
        return f"dome of radius {millimetres(self.radius)}, {millimetres(self.peak)} high{skin}{inside}"

    def solid(self) -> Any:
        """The dome with its inner parts, glued; its faces named."""
        from netgen.occ import Glue, Pnt, Sphere

        core = self._half(0.0, "top")
        core.mat("body")
        parts = [core]
        if self.layer:
            inner = self._half(self.layer, INTERFACE)
            shell = core - inner
            shell.mat("skin")
            shell.solids.maxh = min(self.coarse, 3 * self.layer)
            inner.mat("body")
            parts = [shell, inner]
        if self.inclusion is not None:
            ball = Sphere(Pnt(*self.inclusion.centre), self.inclusion.radius)
            ball.mat("inclusion")
            ball.faces.name = INTERFACE
            ball.solids.maxh = min(self.coarse, LARGEST * self.inclusion.radius)
            parts[-1] = parts[-1] - ball
            parts[-1].mat("body")
            parts.append(ball)
        return parts[0] if len(parts) == 1 else Glue(parts)

    def _half(self, inset: float, surface: str) -> Any:
        """Half an ellipsoid whose half axes are shorter than the dome's by `inset` m."""
        from netgen.occ import Axes, Box, Ellipsoid, Pnt, Sphere, X, Z

        a, c = self.radius - inset, self.peak - inset
        round_body = Sphere(Pnt(0, 0, 0), a) if a == c else Ellipsoid(Axes((0, 0, 0), Z, X), c, a, a)
        round_body.faces.name = surface
        above = Box(Pnt(-2 * a, -2 * a, 0), Pnt(2 * a, 2 * a, 2 * c))
        above.faces.name = "bottom"
        return round_body * above

    def _check_inclusion(self, inclusion: Inclusion) -> None:
        """Refuse a ball that leaves the body.

        The ball is inside if its centre lies in the ellipsoid whose half axes are shorter by its radius and above
        the base by as much; sufficient, since an ellipsoid's inner parallel body contains that ellipsoid.
        """
        inset = self.layer + inclusion.radius
        a, c = self.radius - inset, self.peak - inset
        x, y, z = inclusion.centre
        if min(a, c) > 0 and (x * x + y * y) / (a * a) + z * z / (c * c) < 1 and z > inclusion.radius:
            return
        raise UsageError(
            f"The inclusion of radius {inclusion.radius:g} m at {inclusion.centre} m leaves the dome's body.",
            why="It must lie clear of the base and of the skin.",
            fix=f"Choose a smaller one, or move it, for example to (0, 0, {self.peak / 2:g}).",
        )
