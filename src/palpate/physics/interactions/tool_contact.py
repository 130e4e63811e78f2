"""Frictionless contact of a rigid tool with a surface, as an energy of a pad with a stop.

A tool of signed distance d in its own frame, turned by R, with its centre at c = p + f R e_z, f in front of which its
place p is, penetrates the surface by

    p = -d(Rᵀ(X + u - c)),

for a sphere its radius less |X + u - c|. The pad between tool and surface stores per undeformed area

    φ(p) = ½ k p² / (1 - p/p_m)   for 0 < p < p_m,   else 0 (p ≤ 0) or not admissible.

Without the stop p_m a soft pad has a limit point: beyond it the surface passes the sphere's centre, the gap
turns inside out, and states with a pulling force satisfy Newton's equations. So trial states beyond 0.98 p_m
are rejected, and `inspect` looks at each accepted state anew, in ways that do not depend on the energy.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.interactions.interaction import BEYOND, Field
from palpate.physics.interactions.surface_patch import Patch
from palpate.physics.shapes.mesh import BodyMesh
from palpate.physics.shapes.surface_checks import winding_number
from palpate.physics.stop import Stop, Verdict

if TYPE_CHECKING:
    from palpate.physics.interactions.pressing import PressingTool

__all__ = ["REACH", "Contact", "pad_energy", "pressed_energy"]

REACH = 0.98  # share of the stop up to which states are admissible
BONUS = 6  # orders of quadrature beyond the elements' own: contact has an edge within elements
WAY = 0.05  # distance of the places at which a tool's way is looked at, over its inscribed radius
# cosine from a surface's normal to the way into the tool, below which the surface faces away: a fold of it takes less
FACING_AWAY = -0.1
TINY = 1e-12  # rad; keeps the angle of a rotation differentiable at zero


def pressed_energy(penetration: Any, pad: float, stop: float | None) -> Any:
    """Return φ(p) = ½ k p²/(1 − p/p_m) in J/m² for 0 ≤ p < p_m, of numbers, arrays or coefficient functions.

    The penetration p and the stop p_m are in m, the pad's k in N/m³; None or infinity is a pad without a stop.
    """
    spring = pad / 2 * penetration**2
    return spring if stop is None else spring / (1 - penetration / stop)


def pad_energy(penetration: Any, pad: float, stop: float | None) -> Any:
    """Return φ(p) in J/m² of a penetration p in m as an NGSolve coefficient function, 0 without contact.

    The pad's k is in N/m³, the stop p_m in m; a pad without a stop, None, has a limit point.
    """
    from ngsolve import IfPos

    pressed = pressed_energy(penetration, pad, stop)
    if stop is None:
        return IfPos(penetration, pressed, 0)
    return IfPos(penetration, IfPos(penetration - REACH * stop, BEYOND, pressed), 0)


@dataclass(frozen=True, eq=False)
class Contact:
    """A tool and the quadrature points of the surface that it may touch."""

    field: Field
    mesh: BodyMesh  # the body at rest, its nodes those of the field's mesh
    tool: PressingTool

    @property
    def stop(self) -> float | None:
        """Penetration p_m in m at which the pad is fully pressed; None for a pad without a stop."""
        return self.tool.stop

    def measure(self) -> Any:
        """Return the surface's differential symbol."""
        import ngsolve

        return ngsolve.ds(definedon=self.field.surface(self.tool.meets), bonus_intorder=BONUS)

    def penetration(self, displacement: Any, inputs: tuple[Any, ...]) -> Any:
        """Return p = -d(Rᵀ(X + u - c)) as a coefficient function of the inputs' parameters, positive in contact."""
        import ngsolve as ngs

        from_place = ngs.CF((ngs.x, ngs.y, ngs.z)) + displacement - ngs.CF(inputs[:3])
        if len(inputs) > 3:
            from_place = _rotation_field(inputs[3:]).trans * from_place
        turn = self.tool.pose(np.zeros(len(inputs)))[1]
        if not np.array_equal(turn, np.eye(3)):
            from_place = ngs.CF(tuple(turn.T.ravel().tolist()), dims=(3, 3)) * from_place
        if self.tool.front:
            from_place = from_place - ngs.CF((0.0, 0.0, self.tool.front))
        return -self.tool.shape.distance(from_place)

    def _in_frame(self, points: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return points (N, 3) in m in the tool's own frame at inputs (3 + k,)."""
        place, turn = self.tool.pose(x)
        return np.asarray((points - place) @ turn - [0.0, 0.0, self.tool.front])

    def _centre(self, x: np.ndarray) -> np.ndarray:
        place, turn = self.tool.pose(x)
        return np.asarray(place + self.tool.front * turn[:, 2])

    def inspect(self, x: np.ndarray) -> Verdict:
        """Return a verdict on the state in `field.displacement` under a tool at inputs (3 + k,).

        The surface must not be pressed past the pad's stop; where it is pressed it must face into the tool, so that
        the pad pushes and never pulls; and the tool's centre must be outside the deformed body.
        """
        places, normals = self._deformed_surface()
        own = self._in_frame(places, x)
        penetration = -self.tool.shape.distance(own)
        figures = {"penetration": max(0.0, float(penetration.max()))}
        if self.stop is not None and figures["penetration"] > REACH * self.stop:
            detail = f"{1e3 * figures['penetration']:.3g} mm of {1e3 * self.stop:.3g} mm"
            return Verdict(Stop.PAST_STOP, detail, figures)
        pressed = penetration > 0
        inwards = -self.tool.shape.gradient(own[pressed]) @ self.tool.pose(x)[1].T
        cosines = np.einsum("ni,ni->n", inwards, normals[pressed])
        if cosines.size and cosines.min() < FACING_AWAY:
            return Verdict(Stop.THROUGH_SURFACE, "a pressed part of the surface faces away from it", figures)
        if self._inside(self._centre(x)):
            return Verdict(Stop.THROUGH_SURFACE, "the deformed body encloses it", figures)
        return Verdict(figures=figures)

    def overlap(self, x: np.ndarray) -> float:
        """Return the depth in m of a tool at inputs (3 + k,) in the surface in its base state; negative outside."""
        return float(-self.tool.shape.distance(self._in_frame(self._places, x)).min())

    def meets_fixed_part(self, outside: np.ndarray, x: np.ndarray) -> bool:
        """Return whether a tool on its way from inputs `outside` to x, both (3 + k,), must overlap a fixed surface.

        A fixed surface stays where it is, so the body reaches up to it. A centre on the body's side of it that is
        nearer than the tool's inscribed radius less what the pad yields would have the body pressed past the stop.
        """
        if self.stop is None or self._fixed_part is None:
            return False
        radius, start, end = self.tool.shape.inscribed_radius, self._centre(outside), self._centre(x)
        reach = radius - self.stop
        count = max(2, int(np.ceil(np.linalg.norm(end - start) / (WAY * radius))) + 1)
        way = start + np.linspace(0, 1, count)[:, None] * (end - start)
        low, high = self._fixed_part.box
        near = (way > low - reach).all(axis=1) & (way < high + reach).all(axis=1)
        return any(-reach < self._fixed_part.nearest(middle)[2] < 0 for middle in way[near])

    @cached_property
    def _fixed_part(self) -> Patch | None:
        """The fixed part of the body's surface."""
        count = len(self.mesh.points)
        fixed = ~np.fromiter(self.field.space.FreeDofs(), dtype=bool, count=self.field.size)[:count]
        whole = fixed[self.mesh.triangles].all(axis=1)
        return Patch(self.mesh.points, self.mesh.triangles[whole]) if whole.any() else None

    @cached_property
    def _places(self) -> np.ndarray:
        """Positions (N, 3) in m of the quadrature points under the constant loads alone."""
        import ngsolve as ngs

        return np.asarray((ngs.CF((ngs.x, ngs.y, ngs.z)) + self.field.base)(self._points()))

    def _deformed_surface(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (N, 3) in m and outward unit normals (N, 3) of the deformed surface."""
        import ngsolve as ngs

        points = self._points()
        u = self.field.displacement
        # Nanson's formula: n da = cof F N dA, for which the tangential part of F is enough
        gradient = ngs.Id(3) + ngs.grad(u).Trace()
        places = np.asarray((ngs.CF((ngs.x, ngs.y, ngs.z)) + u)(points))
        normals = np.asarray((ngs.Cof(gradient) * ngs.specialcf.normal(3))(points))
        return places, normals / np.linalg.norm(normals, axis=1, keepdims=True)

    def _points(self) -> Any:
        import ngsolve as ngs

        order = 2 * self.field.displacement.space.globalorder + BONUS
        rule = ngs.IntegrationRule(ngs.ET.TRIG, order)
        return self.field.mesh.MapToAllElements(rule, self.field.surface(self.tool.meets))

    def _inside(self, centre: np.ndarray) -> bool:
        points = self.mesh.points + self.field.at_nodes()
        return winding_number(points[self.mesh.triangles], centre) > 0.5


def _rotation_field(angles: tuple[Any, ...]) -> Any:
    """Return the rotation (3, 3) by parameters of a rotation vector, its last component 0 where there are two."""
    import ngsolve as ngs

    a, b, c = (*angles, *[ngs.CF(0.0)] * (3 - len(angles)))
    # half the angle, off zero by far less than rounding of the rotation can show
    half = ngs.sqrt(a * a + b * b + c * c + TINY**2) / 2
    first, second = ngs.sin(half) * ngs.cos(half) / half, (ngs.sin(half) / half) ** 2 / 2
    K = ngs.CF((0.0, -c, b, c, 0.0, -a, -b, a, 0.0), dims=(3, 3))
    return ngs.Id(3) + first * K + second * K * K
