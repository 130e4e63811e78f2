"""A rigid tool of any shape that presses a surface, in an orientation that stays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import bound, millimetres, number
from palpate.physics.interactions.interaction import Attached, Field
from palpate.physics.interactions.interaction_checks import range_of
from palpate.physics.interactions.pressing import Corner, PressingTool, checked_box
from palpate.physics.interactions.sphere import RIGID, require_pad
from palpate.physics.interactions.surface_patch import Patch
from palpate.tools import PosedTool, Tool
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.shapes.shape import Geometry

__all__ = ["SurfaceTool"]

ELEMENT = 0.5  # element size under the tool over its size, as under a sphere
# the same at most over the least radius of curvature: two quadratic elements go round half a turn of an edge
EDGE_ELEMENT = 2.0
FINEST = 0.125  # the same, at least: elements for a sharper edge are to be asked for
MARGIN = 0.3  # how far beyond the cut at its largest depth the tool may touch, over its size
INSET = 2.0  # distance of that cut from the surface's rim over the tool's size, unless `over` is given
STOP = 0.004  # penetration in m at which a pad is fully pressed, at most


@dataclass(frozen=True)
class SurfaceTool(PressingTool):
    """A rigid tool with a compliant skin (the pad), whose place p = (tip_x, tip_y, tip_z) is the input.

    The place is the tool's foremost point along its own axis, which is −z unless it is turned. The response is the
    force on the tool, -∂U/∂p in N; the torque on it about its place stands beside it in the solution. The equilibrium
    meant is the one that is reached along a straight line from outside, along the surface's outward normal.

    Attributes
    ----------
    shape : Tool
        The tool in its own frame, one of `palpate.tools`.
    touches : str
        Name of the surface that it presses.
    pad : float or "rigid"
        Stiffness k of the pad in N/m³; "rigid" takes one that leaves about 1 % of depth and force, as for a
        `SphereProbe`. A pad of a number has a stop at 4 mm, or at the tool's least radius of curvature where that is
        less.
    depth : tuple of two floats
        Least and largest depth of the tool's deepest point below the surface at rest, in m.
    over : tuple of two corners, optional
        Box of the contact points on the surface in m: ((x0, y0), (x1, y1)) or with z as well. By default the surface
        less a margin in which the tool does not reach its rim, at most 0.4 of its width.
    rotation : tuple of three floats
        Rotation vector in rad by which the tool is turned about its place: its direction is the axis, its length the
        angle. Zero for a tool that points along −z.
    element : float, optional
        Size in m of the elements under the tool; by default half of its radius, at most twice the radius of its edge.

    Raises
    ------
    UsageError
        For a shape that is no tool, an edge sharper than the elements, or a depth or box whose ends are not in order.
        Once it has a body, also for a tool larger than the surface, and one whose shaft lies on it.
    """

    shape: Tool
    touches: str = "top"
    pad: float | Literal["rigid"] = 2e6
    depth: tuple[float, float] = (0.0, 0.008)
    over: tuple[Corner, Corner] | None = None
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    element: float | None = None

    rim = None
    symbol = "tip"

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", self.posed_tool.rotation)
        if self.pad != RIGID:
            require_pad(self.pad)
        object.__setattr__(self, "depth", range_of("The depth of a tool", self.depth, "m"))
        if self.over is not None:
            object.__setattr__(self, "over", checked_box(self.over))
        if self.element is not None:
            checks.positive("The element under a tool", self.element, "m")
        self.require_fine_elements(self._size_of_elements())

    def __str__(self) -> str:
        pad = "rigid" if isinstance(self.pad, str) else f"pad {number(self.pad)} N/m³"
        return f"{self.posed_tool} on {self.touches!r}, {pad}"

    def describe(self) -> dict[str, Any]:
        """Return everything that decides its energy, as plain data for a JSON file."""
        return {**super().describe(), **self.posed_tool.describe()}

    @property
    def stop(self) -> float | None:
        """Penetration in m at which the pad is fully pressed; None for a rigid tool."""
        return None if self.pad == RIGID else min(STOP, self.shape.least_radius)

    @property
    def posed_tool(self) -> PosedTool:
        """The tool in its orientation."""
        return PosedTool(self.shape, self.rotation)

    @property
    def turn(self) -> np.ndarray | None:
        """Rotation (3, 3) from the tool's frame to the body's; None for none."""
        return self.posed_tool.turn

    @property
    def to_centre(self) -> np.ndarray:
        """Way (3,) in m from the tool's place to its shape's centre."""
        return self.posed_tool.to_centre

    def offset(self, normals: np.ndarray) -> np.ndarray:
        """Return how high (N,) in m the place is above a plane of unit normals (N, 3) that the tool just touches."""
        return np.asarray(self.posed_tool.reach(normals) - normals @ self.to_centre)

    def ranges(self, geometry: Geometry) -> tuple[Range, ...]:
        """Return the ranges of tip_x, tip_y and tip_z in m: the box around all its places."""
        self._require_room(geometry)
        return super().ranges(geometry)

    def require_fine_elements(self, element: float) -> None:
        """Refuse elements of a size in m that are too large for the tool's edge.

        Raises
        ------
        UsageError
            With the edge and the element size that would do.
        """
        edge = self.shape.least_radius
        if element <= EDGE_ELEMENT * edge * (1 + 1e-9):
            return
        raise UsageError(
            f"The edge of the {self.shape} is too sharp for elements of {millimetres(element)}.",
            why=f"Its least radius is {millimetres(edge)}, and an element may be twice as long at most: coarser ones "
            "do not see the edge.",
            fix=f"Give an edge of at least {bound(element / EDGE_ELEMENT, least=True):g} (m), or "
            f"element={bound(EDGE_ELEMENT * edge):g} (m) and more time.",
        )

    def contact_radius(self, depth: float) -> float:
        """Return half the lesser width in m of the cut at a depth in m."""
        return min(self.shape.half_widths(depth))

    def _size_of_elements(self) -> float:
        if self.element is not None:
            return self.element
        size = self.shape.size
        return max(min(ELEMENT * size, EDGE_ELEMENT * self.shape.least_radius), FINEST * size)

    def _element(self, geometry: Geometry, patch: Patch) -> float:
        return self._size_of_elements()

    def _half_widths(self) -> np.ndarray:
        """Return half the widths (2,) in m of the cut at the largest depth; turned, of the circle around it."""
        half = np.array(self.shape.half_widths(max(self.depth)))
        return half if self.turn is None else np.full(2, np.linalg.norm(half))

    @property
    def _inset(self) -> float:
        return float(self._half_widths().max() + INSET * self.shape.size)

    @property
    def _margin(self) -> np.ndarray:
        widths = self._half_widths() + MARGIN * self.shape.size
        return np.array([*widths, widths.max()])

    def _require_room(self, geometry: Geometry) -> None:
        """Refuse a tool whose cut at its largest depth is larger than the surface."""
        patch = self._patch(geometry)
        low, high = patch.box
        across = [i for i in range(3) if i != int(np.argmax(np.abs(patch.facing)))]
        room, needed = (
            float((high - low)[across].min()),
            2 * float(min(self.shape.half_widths(max(self.depth)))),
        )
        if needed <= room:
            return
        raise UsageError(
            f"The {self.shape} is larger than the surface {self.touches!r}.",
            why=f"At {millimetres(max(self.depth))} it cuts {millimetres(needed)} wide, and the surface has "
            f"{millimetres(room)}.",
            fix=f"Take a tool of at most half that width, {bound(room / 2):g} (m); lengths are in m: pass 0.005 for "
            "5 mm.",
        )

    def attach_pad(self, field: Field, pad: Any) -> Attached:
        """Return its contact energy on an opened body with a stiffness, a number in N/m³ or a parameter of NGSolve."""
        import ngsolve

        attached = super().attach_pad(field, pad)
        axes = np.eye(3)
        shifts = np.array([field.interpolate(ngsolve.CF(tuple(axis))) for axis in axes.tolist()])

        def turns(place: np.ndarray) -> np.ndarray:
            arm = (
                ngsolve.CF((ngsolve.x, ngsolve.y, ngsolve.z)) + field.displacement - ngsolve.CF(tuple(place))
            )
            return np.array([field.interpolate(_cross(axis, arm)) for axis in axes.tolist()])

        return replace(attached, shifts=shifts, turns=turns)


def _cross(axis: list[float], arm: Any) -> Any:
    """Return the product axis × arm as a coefficient function."""
    import ngsolve

    a, b, c = axis
    return ngsolve.CF((b * arm[2] - c * arm[1], c * arm[0] - a * arm[2], a * arm[1] - b * arm[0]))
