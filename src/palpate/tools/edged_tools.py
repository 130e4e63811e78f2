"""Tools with flat faces and rounded edges: a punch, a cylinder that lies down, and a box.

Each is a sharp core, smaller by the edge's radius, and all that is nearer to it than that radius.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import bound, millimetres
from palpate.tools.tool_shape import Tool, absolute, larger, length, parts, positive, where_positive

__all__ = ["Box", "Cylinder", "Punch"]


@dataclass(frozen=True)
class Punch(Tool):
    """A long round bar along z that presses with its flat end.

    Attributes
    ----------
    radius : float
        a in m.
    edge : float
        Radius of the rounded edge in m, at most a.

    Raises
    ------
    UsageError
        For a size that is not positive, or an edge larger than the radius.
    """

    radius: float
    edge: float

    def __post_init__(self) -> None:
        checks.positive("The radius of a punch", self.radius, "m")
        _require_edge("punch", self.edge, self.radius)

    def __str__(self) -> str:
        return f"punch of radius {millimetres(self.radius)}, edge {millimetres(self.edge)}"

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        x, y, z = parts(point)
        # the core's flat end is at z = 0, so the centre is an edge's radius above the face
        return _rounded(length(x, y) - (self.radius - self.edge), -z) - self.edge

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3), infinite along its shaft."""
        reach = (self.radius - self.edge) * np.linalg.norm(direction[:, :2], axis=1) + self.edge
        return np.where(direction[:, 2] <= 1e-12, reach, np.inf)

    @property
    def front(self) -> float:
        """Radius of the edge in m."""
        return self.edge

    @property
    def least_radius(self) -> float:
        """Radius of the edge in m."""
        return self.edge

    @property
    def size(self) -> float:
        """The radius in m."""
        return self.radius

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and y of the cut at a depth in m."""
        half = self.radius - self.edge + _round_edge(self.edge, depth)
        return half, half


@dataclass(frozen=True)
class Cylinder(Tool):
    """A cylinder that lies along x and presses with its side.

    Attributes
    ----------
    radius : float
        R in m.
    length : float
        In m, the rounded edges included.
    edge : float
        Radius in m of the rounded edges of its flat ends, at most R and half the length.

    Raises
    ------
    UsageError
        For a size that is not positive, or an edge that is too large.
    """

    radius: float
    length: float
    edge: float

    def __post_init__(self) -> None:
        checks.positive("The radius of a cylinder", self.radius, "m")
        checks.positive("The length of a cylinder", self.length, "m")
        _require_edge("cylinder", self.edge, min(self.radius, self.length / 2))

    def __str__(self) -> str:
        return (
            f"cylinder of radius {millimetres(self.radius)}, {millimetres(self.length)} long, "
            f"edge {millimetres(self.edge)}"
        )

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        x, y, z = parts(point)
        across = length(y, z) - (self.radius - self.edge)
        return _rounded(across, absolute(x) - (self.length / 2 - self.edge)) - self.edge

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3)."""
        across = (self.radius - self.edge) * np.linalg.norm(direction[:, 1:], axis=1)
        return np.asarray(across + (self.length / 2 - self.edge) * np.abs(direction[:, 0]) + self.edge)

    @property
    def front(self) -> float:
        """The radius in m."""
        return self.radius

    @property
    def least_radius(self) -> float:
        """Radius of the edges in m."""
        return self.edge

    @property
    def size(self) -> float:
        """The radius in m."""
        return self.radius

    @property
    def inscribed_radius(self) -> float:
        """The radius in m, or half the length where that is less."""
        return min(self.radius, self.length / 2)

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and y of the cut at a depth in m."""
        depth = min(max(depth, 0.0), self.radius)
        across = math.sqrt(depth * (2 * self.radius - depth))
        return self.length / 2 - self.edge + _round_edge(self.edge, depth), across


@dataclass(frozen=True)
class Box(Tool):
    """A box that presses with a flat face.

    Attributes
    ----------
    size_x, size_y, size_z : float
        Lengths in m along x, y and z, the rounded edges included; z is the direction in which it presses.
    edge : float
        Radius in m of the rounded edges and corners, at most half the shortest side.

    Raises
    ------
    UsageError
        For a size that is not positive, or an edge that is too large.
    """

    size_x: float
    size_y: float
    size_z: float
    edge: float

    def __post_init__(self) -> None:
        for axis, value in zip("xyz", (self.size_x, self.size_y, self.size_z), strict=True):
            checks.positive(f"The length of a box along {axis}", value, "m")
        _require_edge("box", self.edge, min(self._halves))

    def __str__(self) -> str:
        sizes = " × ".join(millimetres(value) for value in (self.size_x, self.size_y, self.size_z))
        return f"box of {sizes}, edge {millimetres(self.edge)}"

    @property
    def _halves(self) -> tuple[float, float, float]:
        return self.size_x / 2, self.size_y / 2, self.size_z / 2

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        beyond = [
            absolute(x) - (half - self.edge) for x, half in zip(parts(point), self._halves, strict=True)
        ]
        inner = larger(larger(beyond[0], beyond[1]), beyond[2])
        outer = length(*(positive(value) for value in beyond))
        return where_positive(inner, outer, inner) - self.edge

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3)."""
        return np.asarray(np.abs(direction) @ (np.array(self._halves) - self.edge) + self.edge)

    @property
    def front(self) -> float:
        """Half the length along z, in m."""
        return self.size_z / 2

    @property
    def least_radius(self) -> float:
        """Radius of the edges in m."""
        return self.edge

    @property
    def size(self) -> float:
        """Half the face's shorter side in m."""
        return min(self.size_x, self.size_y) / 2

    @property
    def inscribed_radius(self) -> float:
        """Half the shortest side in m."""
        return min(self._halves)

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and y of the cut at a depth in m."""
        inset = self.edge - _round_edge(self.edge, depth)
        return self.size_x / 2 - inset, self.size_y / 2 - inset


def _rounded(across: Any, along: Any) -> Any:
    """Return the signed distance to a core of revolution, from that to its side and to its flat end."""
    inner = larger(across, along)
    return where_positive(inner, length(positive(across), positive(along)), inner)


def _round_edge(edge: float, depth: float) -> float:
    """Return how far a rounded edge reaches out at a depth from the face, all in m."""
    depth = min(max(depth, 0.0), edge)
    return math.sqrt(depth * (2 * edge - depth))


def _require_edge(what: str, edge: float, most: float) -> None:
    checks.positive(f"The edge radius of a {what}", edge, "m")
    if edge > most:
        raise UsageError(
            f"The edge radius of a {what} is {millimetres(edge)}.",
            why=f"The {what} has room for {millimetres(most)}.",
            fix=f"Give an edge of at most {bound(most, 3):g} (m).",
        )
