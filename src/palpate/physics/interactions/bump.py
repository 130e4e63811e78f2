"""The bump that weighs a pad or a spread force on a named surface: smooth, of compact support.

Seen along an axis that the surface faces, the bump around the point p is

    ρ(X) = (1 - |X⊥ - p|²/a²)³  for |X⊥ - p| < a,  else 0,

with a radius a and X⊥ the two coordinates across the axis. It has two continuous derivatives, so energies with ρ
have a continuous stiffness also where p is an input. Its integral over a plane is πa²/4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.interaction_checks import AXES, axis_of
from palpate.physics.interactions.surface_patch import Patch, cross
from palpate.physics.shapes.mesh import BodyMesh
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.shapes.naming import require_known

__all__ = ["QUADRATURE", "Chart", "bump", "bump_area", "chart_at", "chart_of", "require_on_surface"]

# orders of quadrature beyond the elements' own: the bump is no polynomial on an element it cuts
QUADRATURE = 6
MARGIN = 1.2  # a fine mesh reaches that many radii from the bump's centre
PLAIN = 0.1  # a surface has a mean direction if its area vectors add up to more than this share of its area
ON_SURFACE = 0.02  # share of the body's size by which a point may miss a curved surface's triangles
# share of a bump that must lie on the surface; the rest is for the triangles of a round edge
COVERED = 0.98


@dataclass(frozen=True)
class Chart:
    """A surface seen along an axis: two coordinates give its points."""

    surface: str
    axis: int  # index of the axis that the surface faces
    sign: float  # 1 where it faces along the axis, -1 against it

    @property
    def across(self) -> tuple[int, int]:
        """Indices of the two coordinates."""
        first, second = (i for i in range(3) if i != self.axis)
        return first, second

    @property
    def names(self) -> tuple[str, str]:
        """Names of the two coordinates, such as x and y."""
        return AXES[self.across[0]], AXES[self.across[1]]

    def refinement(self, mesh: BodyMesh, lower: np.ndarray, upper: np.ndarray, element: float) -> FineMesh:
        """Return fine elements between two corners (2,) in m, all along the axis."""
        low, high = (corner.copy() for corner in mesh.corners)
        low[list(self.across)], high[list(self.across)] = lower, upper
        return FineMesh(self.surface, element, _triple(low), _triple(high))


def bump(chart: Chart, centre: tuple[Any, Any], radius: float) -> Any:
    """Return ρ as a coefficient function on the surface, with the centre p and the radius a in m.

    The two numbers of the centre may be parameters of NGSolve.
    """
    import ngsolve as ng

    here = (ng.x, ng.y, ng.z)
    off = sum((here[i] - p) ** 2 for i, p in zip(chart.across, centre, strict=True))
    inside = 1 - off / radius**2
    # a body may end in a surface that closes on itself: its far side faces away
    faces = chart.sign * ng.specialcf.normal(3)[chart.axis]
    return ng.IfPos(faces, ng.IfPos(inside, inside**3, 0), 0)


def bump_area(radius: float) -> float:
    """Return ∫ρ dA = πa²/4 on a plane, in m²."""
    return math.pi * radius**2 / 4


def chart_of(mesh: BodyMesh, surface: str, facing: str | None = None) -> Chart:
    """Return the chart of a whole surface, along `facing` or the axis nearest to its mean normal.

    A surface whose normals cancel has no mean normal and needs `facing`.
    """
    require_known("surface", surface, mesh.surfaces)
    if facing is not None:
        return Chart(surface, *axis_of("The direction that the surface faces", facing))
    mean = Patch.from_mesh(mesh, surface).facing
    if np.linalg.norm(mean) < PLAIN:
        raise UsageError(
            f"The surface {surface!r} faces all ways.",
            why="Its normals cancel, so two coordinates can't tell its points.",
            fix='Say which side is meant, for example facing="+z".',
        )
    return _along(surface, mean)


def chart_at(mesh: BodyMesh, surface: str, point: tuple[float, float, float]) -> Chart:
    """Return the chart along the axis that the surface faces at a point (3,) in m, which must be on it."""
    require_known("surface", surface, mesh.surfaces)
    nearest, normal, distance = Patch.from_mesh(mesh, surface).nearest(np.asarray(point))
    size = float(np.linalg.norm(mesh.corners[1] - mesh.corners[0]))
    if abs(distance) > ON_SURFACE * size:
        raise UsageError(
            f"The point {_words(point)} m is not on the surface {surface!r}.",
            why=f"The nearest point of that surface is {_words(nearest)} m, {abs(distance):.3g} m away.",
            fix="Give a point of the surface at rest, in m.",
        )
    return _along(surface, normal)


def _along(surface: str, normal: np.ndarray) -> Chart:
    axis = int(np.argmax(np.abs(normal)))
    return Chart(surface, axis, float(np.sign(normal[axis])))


def require_on_surface(
    mesh: BodyMesh, chart: Chart, lower: np.ndarray, upper: np.ndarray, radius: float
) -> None:
    """Refuse bumps of which more than a fiftieth hangs over the edge of the surface.

    `lower` and `upper` (2,) are the corners in m of the rectangle in which the centre may be, `radius` is in m.
    """
    facing = chart.sign * mesh.area_vectors[:, chart.axis] > 0
    mine = facing & mesh.on(chart.surface)
    triangles = mesh.points[mesh.triangles[mine]][:, :, list(chart.across)]
    offsets, weight = _disc(radius)
    for corner in np.unique([[x, y] for x in (lower[0], upper[0]) for y in (lower[1], upper[1])], axis=0):
        share = float(weight @ _inside(triangles, corner + offsets))
        if share < COVERED:
            raise UsageError(
                f"The pad around {_words(corner)} m hangs over the edge of the surface {chart.surface!r}.",
                why=f"Only {share:.0%} of its area, of radius {radius:g} m, lies on the surface.",
                fix="Keep its centre a radius away from the edge, or make it smaller.",
            )


def _disc(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points (400, 2) spread evenly over a disc, and their share of the bump, adding up to 1."""
    i = np.arange(400) + 0.5
    r, angle = np.sqrt(i / len(i)), math.pi * (1 + 5**0.5) * i  # Vogel's (1979) spiral
    weight = (1 - r**2) ** 3
    return radius * np.column_stack([r * np.cos(angle), r * np.sin(angle)]), weight / weight.sum()


def _inside(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return 1 for each point (n, 2) that lies in one of the triangles (t, 3, 2), else 0, shape (n,)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    sides = np.stack([cross(q - p, points[:, None] - p) for p, q in ((a, b), (b, c), (c, a))])
    slack = 1e-9 * np.abs(cross(b - a, c - a))
    inside = (sides >= -slack).all(axis=0) | (sides <= slack).all(axis=0)
    return np.asarray(inside.any(axis=1), dtype=float)


def _words(point: Any) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in point) + ")"


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = map(float, values)
    return x, y, z
