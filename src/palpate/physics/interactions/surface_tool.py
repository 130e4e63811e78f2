"""A rigid tool of any shape that presses a surface, in an orientation that stays or is an input."""

from __future__ import annotations

from collections.abc import Callable
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
from palpate.tools import PosedTool, Tool, Turns, left_jacobian
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.shapes.shape import Geometry

__all__ = ["SurfaceTool", "rigid_motions"]

ELEMENT = 0.5  # element size under the tool over its size, as under a sphere
# the same at most over the least radius of curvature: two quadratic elements go round half a turn of an edge
EDGE_ELEMENT = 2.0
FINEST = 0.125  # the same, at least: elements for a sharper edge are to be asked for
MARGIN = 0.3  # how far beyond the cut at its largest depth the tool may touch, over its size
INSET = 2.0  # distance of that cut from the surface's rim over the tool's size, unless `over` is given
STOP = 0.004  # penetration in m at which a pad is fully pressed, at most


@dataclass(frozen=True)
class SurfaceTool(PressingTool):
    """A rigid tool with a compliant skin (the pad), whose place p = (tip_x, tip_y, tip_z) is an input.

    The place is the tool's foremost point along its own axis, which is −z unless it is turned. The orientation may be
    an input too: components in rad of a rotation vector w = (tip_rx, tip_ry, tip_rz) in the frame of the body, which
    turns the tool after `rotation`, R = exp [w]× R₀. The response is −∂U by the inputs: the force on the tool in N,
    then what the torque does along w, Jᵀ T in N m (see `palpate.tools.left_jacobian`). The torque T about the place
    stands beside it in the solution. The equilibrium meant is the one that is reached along a straight line from
    outside, along the surface's outward normal, in one orientation.

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
    turns : {"fixed", "axis", "full"}
        What of the orientation is an input: nothing, tip_rx and tip_ry, or tip_rz as well.
    tilt : float
        Largest angle in rad of (tip_rx, tip_ry), below π/2, and of tip_rz to both sides. Not used, and set to 0, where
        the orientation is fixed.
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
    turns: Turns = "fixed"
    tilt: float = 0.35

    rim = None
    symbol = "tip"

    def __post_init__(self) -> None:
        for name in ("rotation", "tilt"):
            object.__setattr__(self, name, getattr(self.posed_tool, name))
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
        plain = {name: value for name, value in super().describe().items() if name not in ("turns", "tilt")}
        return {**plain, **self.posed_tool.describe()}

    @property
    def stop(self) -> float | None:
        """Penetration in m at which the pad is fully pressed; None for a rigid tool."""
        return None if self.pad == RIGID else min(STOP, self.shape.least_radius)

    @property
    def posed_tool(self) -> PosedTool:
        """The tool in its orientation."""
        return PosedTool(self.shape, self.rotation, self.turns, self.tilt)

    @property
    def front(self) -> float:
        """Distance in m from the tool's place to its shape's centre, against its own axis."""
        return self.shape.front

    @property
    def angles(self) -> tuple[Range, ...]:
        """Names and ranges in rad of the k inputs after the place."""
        return self.posed_tool.angles

    def spread_angles(self, unit: np.ndarray) -> np.ndarray:
        """Return angles (N, k) in rad, even over the disc of all tilts, from k coordinates (N, k) between 0 and 1."""
        return self.posed_tool.spread_angles(unit)

    def pose(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return place (..., 3) in m and rotation (..., 3, 3), to the body's frame, at inputs (..., 3 + k)."""
        return self.posed_tool.pose(x)

    def offset(self, normals: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Return how high (N,) in m the place is above a plane that the tool just touches.

        The planes have unit normals (N, 3), the tool angles (N, k) in rad.
        """
        return self.posed_tool.offset(normals, angles)

    def ranges(self, geometry: Geometry) -> tuple[Range, ...]:
        """Return the ranges of tip_x, tip_y and tip_z in m, the box around all its places, then those of its angles."""
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
        stays = self.turns == "fixed" and not any(self.rotation)
        return half if stays else np.full(2, np.linalg.norm(half))

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
        shifts, turns = rigid_motions(field)

        def rates(q: np.ndarray) -> np.ndarray:
            w = np.append(q[3:], np.zeros(6 - q.size))
            return np.asarray(left_jacobian(w).T[: q.size - 3])

        return replace(
            super().attach_pad(field, pad),
            shifts=shifts[None],
            turns=turns,
            rates=rates if self.angles else None,
        )


def rigid_motions(field: Field) -> tuple[np.ndarray, Callable[[np.ndarray, np.ndarray], np.ndarray]]:
    """Return unknowns (3, dof) of a displacement by 1 along x, y and z, and `Attached.turns` about the first inputs."""
    import ngsolve

    axes = np.eye(3)
    shifts = np.array([field.interpolate(ngsolve.CF(tuple(axis))) for axis in axes.tolist()])
    rest = field.interpolate(ngsolve.CF((ngsolve.x, ngsolve.y, ngsolve.z)))
    size = len(field.base.vec)

    def turns(z: np.ndarray, q: np.ndarray) -> np.ndarray:
        arm = (rest + z - q[:3] @ shifts)[:size].reshape(3, -1).T
        turned = np.zeros((3, z.size))
        turned[:, :size] = np.cross(axes[:, None], arm).transpose(0, 2, 1).reshape(3, -1)
        return turned

    return shifts, turns
