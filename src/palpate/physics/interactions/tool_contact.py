"""Frictionless contact of a rigid tool with a surface, as an energy of a pad with a stop.

A tool of signed distance d in its own frame, turned by R, with its centre at c, penetrates the surface by

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
from typing import Any

import numpy as np

from palpate.physics.interactions.interaction import BEYOND, Field
from palpate.physics.interactions.surface_patch import Patch
from palpate.physics.shapes.mesh import BodyMesh
from palpate.physics.shapes.surface_checks import winding_number
from palpate.physics.stop import Stop, Verdict
from palpate.tools import Tool

__all__ = ["REACH", "Contact", "pad_energy", "pressed_energy"]

REACH = 0.98  # share of the stop up to which states are admissible
BONUS = 6  # orders of quadrature beyond the elements' own: contact has an edge within elements
WAY = 0.05  # distance of the places at which a tool's way is looked at, over its inscribed radius
# cosine from a surface's normal to the way into the tool, below which the surface faces away: a fold of it takes less
FACING_AWAY = -0.1


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
    """A tool and the quadrature points of the surface that it may touch; its inputs are its place."""

    field: Field
    mesh: BodyMesh  # the body at rest, its nodes those of the field's mesh
    surface: str
    shape: Tool
    stop: float | None  # p_m, m; None for a pad without a stop
    turn: np.ndarray | None = None  # R (3, 3); None for none
    to_centre: np.ndarray | None = (
        None  # way (3,) from the place to the shape's centre, m; None where they are one
    )

    def measure(self) -> Any:
        """Return the surface's differential symbol."""
        import ngsolve

        return ngsolve.ds(definedon=self.field.surface(self.surface), bonus_intorder=BONUS)

    def penetration(self, displacement: Any, place: Any) -> Any:
        """Return p = -d(Rᵀ(X + u - c)) as a coefficient function, positive in contact."""
        import ngsolve as ngs

        to_surface = ngs.CF((ngs.x, ngs.y, ngs.z)) + displacement - place
        if self.to_centre is not None:
            to_surface = to_surface - ngs.CF(tuple(self.to_centre.tolist()))
        if self.turn is not None:
            to_surface = ngs.CF(tuple(self.turn.T.ravel().tolist()), dims=(3, 3)) * to_surface
        return -self.shape.distance(to_surface)

    def _in_frame(self, points: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return points (N, 3) in m in the tool's own frame."""
        away = points - self._centre(place)
        return away if self.turn is None else np.asarray(away @ self.turn)

    def _centre(self, place: np.ndarray) -> np.ndarray:
        return place if self.to_centre is None else place + self.to_centre

    def inspect(self, place: np.ndarray) -> Verdict:
        """Return a verdict on the state in `field.displacement` under a tool at (3,) m.

        The surface must not be pressed past the pad's stop; where it is pressed it must face into the tool, so that
        the pad pushes and never pulls; and the tool's centre must be outside the deformed body.
        """
        places, normals = self._deformed_surface()
        own = self._in_frame(places, place)
        penetration = -self.shape.distance(own)
        figures = {"penetration": max(0.0, float(penetration.max()))}
        if self.stop is not None and figures["penetration"] > REACH * self.stop:
            detail = f"{1e3 * figures['penetration']:.3g} mm of {1e3 * self.stop:.3g} mm"
            return Verdict(Stop.PAST_STOP, detail, figures)
        pressed = penetration > 0
        inwards = -self.shape.gradient(own[pressed])
        inwards = inwards if self.turn is None else inwards @ self.turn.T
        cosines = np.einsum("ni,ni->n", inwards, normals[pressed])
        if cosines.size and cosines.min() < FACING_AWAY:
            return Verdict(Stop.THROUGH_SURFACE, "a pressed part of the surface faces away from it", figures)
        if self._inside(self._centre(place)):
            return Verdict(Stop.THROUGH_SURFACE, "the deformed body encloses it", figures)
        return Verdict(figures=figures)

    def overlap(self, place: np.ndarray) -> float:
        """Return the depth in m of a tool at (3,) m in the surface in its base state; negative outside."""
        return float(-self.shape.distance(self._in_frame(self._places, place)).min())

    def meets_fixed_part(self, outside: np.ndarray, place: np.ndarray) -> bool:
        """Return whether a tool on its way from `outside` (3,) to `place` (3,) in m must overlap a fixed surface.

        A fixed surface stays where it is, so the body reaches up to it. A centre on the body's side of it that is
        nearer than the tool's inscribed radius less what the pad yields would have the body pressed past the stop.
        """
        if self.stop is None or self._fixed_part is None:
            return False
        reach = self.shape.inscribed_radius - self.stop
        count = max(
            2, int(np.ceil(np.linalg.norm(place - outside) / (WAY * self.shape.inscribed_radius))) + 1
        )
        way = self._centre(outside) + np.linspace(0, 1, count)[:, None] * (place - outside)
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
        return self.field.mesh.MapToAllElements(rule, self.field.surface(self.surface))

    def _inside(self, centre: np.ndarray) -> bool:
        points = self.mesh.points + self.field.at_nodes()
        return winding_number(points[self.mesh.triangles], centre) > 0.5
