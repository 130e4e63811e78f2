"""The sphere probe: a rigid ball that presses a surface without friction."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres, number
from palpate.physics.interactions.interaction_checks import range_of
from palpate.physics.interactions.pressing import Corner, PressingTool, checked_box
from palpate.physics.interactions.surface_patch import Patch
from palpate.tools import Sphere

if TYPE_CHECKING:
    from palpate.physics.shapes.shape import Geometry

__all__ = ["RIGID", "SphereProbe", "require_pad"]

ELEMENT = 0.5  # element size under the probe over its radius: the force then ripples by < 0.2 % from 0.1 R of depth on
ROUND_ELEMENT = 0.4  # the same on curved surfaces, where the elements' shape adds to the error
# the same in bodies of several regions: on a skin over soft fat 0.5 makes the force 3 to 7 % too large
LAYERED_ELEMENT = 0.25
# The same under a rigid sphere, whose pressure no pad evens out: at most ROUND_ELEMENT, and this over the radius of the
# contact at RIGID_DEPTH of the largest depth. Elements as long as that radius make the force 3 % too large, 1.25 times
# as long ones 5 %
RIGID_ELEMENT, RIGID_DEPTH = 0.8, 1 / 6
RIGID = "rigid"
"""The pad of a rigid sphere, for which a stiffness follows from the body."""
MARGIN = 1.3  # how far beyond its contact points the probe may touch, over its radius
INSET = 3.0  # distance of the contact points from the surface's rim over the radius, unless it is given


@dataclass(frozen=True)
class SphereProbe(PressingTool):
    """A rigid sphere with a compliant skin (the pad), whose centre c = (c_x, c_y, c_z) is the input.

    The response is the force on the probe, -∂U/∂c in N. The equilibrium meant is the one that is reached along a
    straight line: the centre comes from outside along the outward normal at the nearest point of the surface.

    Attributes
    ----------
    radius : float
        R in m.
    touches : str
        Name of the surface that it presses.
    pad : float or "rigid"
        Stiffness k of the pad in N/m³. A modelling choice: the probe's own skin, in series with the body. "rigid" takes
        one so stiff that it leaves about 1 % of depth and force, by the body's modulus, radius and largest depth.
    stop : float or None
        Penetration p_m in m at which the pad is fully pressed. None for a pad without a stop, which swallows
        the sphere beyond some depth: such solves fail then. A rigid pad has none.
    depth : tuple of two floats
        Least and largest depth of the sphere's tip below the surface at rest, in m.
    over : tuple of two corners, optional
        Box of the contact points on the surface in m: ((x0, y0), (x1, y1)) or with z as well. By default the surface
        less a margin of 3 R, at most 0.4 of its width, in the directions along it.
    rim : str, optional
        Name of a surface around the touched one that the probe may meet too, at least as wide as the largest contact,
        √(2 R d − d²) at the depth d. With it the contact points are all over the touched surface, without a margin.

    Raises
    ------
    UsageError
        For sizes that are not positive, or a depth or box whose ends are not in order. On a plane surface also, once
        it has a body, for a box that reaches beyond it or a depth that is all of the body's thickness.
    """

    radius: float
    touches: str = "top"
    pad: float | Literal["rigid"] = 2e6
    stop: float | None = 0.004
    depth: tuple[float, float] = (0.0, 0.015)
    over: tuple[Corner, Corner] | None = None
    rim: str | None = None

    def __post_init__(self) -> None:
        checks.positive("The probe's radius", self.radius, "m")
        if self.pad != RIGID:
            require_pad(self.pad)
        if self.stop is not None:
            checks.positive("The probe's stop", self.stop, "m")
        object.__setattr__(self, "depth", range_of("The depth of a probe", self.depth, "m"))
        if self.over is not None:
            object.__setattr__(self, "over", checked_box(self.over))

    def __str__(self) -> str:
        around = "" if self.rim is None else f" and its rim {self.rim!r}"
        place = f"on {self.touches!r}{around}"
        if isinstance(self.pad, str):
            return f"rigid sphere of radius {millimetres(self.radius)} {place}"
        stop = f" with a stop at {millimetres(self.stop)}" if self.stop is not None else " without a stop"
        return f"sphere of radius {millimetres(self.radius)} {place}, pad {number(self.pad)} N/m³{stop}"

    def describe(self) -> dict[str, Any]:
        """Return everything that decides its energy, as plain data; a rim only where there is one."""
        plain = super().describe()
        return {name: value for name, value in plain.items() if name != "rim" or value is not None}

    @property
    def shape(self) -> Sphere:  # type: ignore[override]  # a tool has it as a field
        """The ball."""
        return Sphere(self.radius)

    def offset(self, normals: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Return the radius (N,) in m for each of the outward unit normals (N, 3): so high is the centre at a touch."""
        del angles
        return np.full(len(normals), self.radius)

    def contact_radius(self, depth: float) -> float:
        """Return the radius √(R s) in m of Hertz's contact at a depth s in m, at most the radius."""
        return math.sqrt(self.radius * min(depth, self.radius))

    @property
    def _inset(self) -> float:
        return INSET * self.radius

    @property
    def _margin(self) -> float:
        return MARGIN * self.radius

    def with_radius(self, geometry: Geometry, radius: float) -> SphereProbe:
        """Return a probe of another radius in m that visits the same contact points to the same depths."""
        low, high = self._box(self._patch(geometry))
        return replace(self, radius=radius, over=(tuple(low.tolist()), tuple(high.tolist())))

    def shift_centres(self, geometry: Geometry, centres: np.ndarray, radius: float) -> np.ndarray:
        """Return positions (N, 3) in m of a probe of another radius that lies over the same places as deep."""
        patch = self._patch(geometry)
        normals = np.array([patch.nearest(centre)[1] for centre in centres])
        return np.asarray(centres + (radius - self.radius) * normals)

    def _element(self, geometry: Geometry, patch: Patch) -> float:
        """Return the element size in m under the sphere."""
        if len(geometry.regions) > 1:
            return LAYERED_ELEMENT * self.radius
        if self.pad != RIGID:
            return (ELEMENT if patch.is_plane else ROUND_ELEMENT) * self.radius
        depth = RIGID_DEPTH * max(map(abs, self.depth)) or self.radius / 4
        contact = math.sqrt(self.radius * depth)
        return float(f"{min(ROUND_ELEMENT * self.radius, RIGID_ELEMENT * contact):.2g}")


def require_pad(pad: Any) -> None:
    """Refuse a pad that is no positive stiffness in N/m³."""
    if isinstance(pad, str):
        raise UsageError(
            f"The pad of a probe is {pad!r}.",
            why="It is a stiffness in N/m³, or the word that asks for none that is felt.",
            fix='Give a number such as 2e6, or "rigid".',
        )
    checks.positive("The probe's pad stiffness", pad, "N/m³")
