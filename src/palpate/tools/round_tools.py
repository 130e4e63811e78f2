"""Tools without edges: a ball, a capsule, a fingertip, and a cone with a rounded tip."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.tools.tool_shape import Tool, length, norm, parts, positive, where_positive

__all__ = ["Capsule", "Cone", "Fingertip", "Sphere"]


class _Round(Tool):
    """A tool whose front, least radius and size are one radius."""

    radius: float  # m

    @property
    def front(self) -> float:
        """The radius in m."""
        return self.radius

    @property
    def least_radius(self) -> float:
        """The radius in m."""
        return self.radius

    @property
    def size(self) -> float:
        """The radius in m."""
        return self.radius


@dataclass(frozen=True)
class Sphere(_Round):
    """A ball.

    Attributes
    ----------
    radius : float
        R in m.

    Raises
    ------
    UsageError
        For a radius that is not positive.
    """

    radius: float

    def __post_init__(self) -> None:
        checks.positive("The radius of a sphere", self.radius, "m")

    def __str__(self) -> str:
        return f"sphere of radius {millimetres(self.radius)}"

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        return norm(point) - self.radius

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3)."""
        return np.full(len(direction), self.radius)

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and y of the cut at a depth in m."""
        half = _half_chord(self.radius, depth)
        return half, half


@dataclass(frozen=True)
class Capsule(_Round):
    """A cylinder that lies along x, with half balls as its ends.

    Attributes
    ----------
    radius : float
        R in m.
    length : float
        From end to end, in m; more than 2 R.

    Raises
    ------
    UsageError
        For a size that is not positive, or a length that leaves nothing between the half balls.
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        checks.positive("The radius of a capsule", self.radius, "m")
        checks.positive("The length of a capsule", self.length, "m")
        if self.length <= 2 * self.radius:
            raise UsageError(
                f"A capsule is {millimetres(self.length)} long with a radius of {millimetres(self.radius)}.",
                why="Its length is from end to end, the two half balls included.",
                fix=f"Give more than {millimetres(2 * self.radius)}, or take tools.Sphere.",
            )

    def __str__(self) -> str:
        return f"capsule of radius {millimetres(self.radius)}, {millimetres(self.length)} long"

    @property
    def _half(self) -> float:
        return self.length / 2 - self.radius

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        x, y, z = parts(point)
        return length(positive(x - self._half) - positive(-x - self._half), y, z) - self.radius

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3)."""
        return np.asarray(self._half * np.abs(direction[:, 0]) + self.radius)

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and y of the cut at a depth in m."""
        half = _half_chord(self.radius, depth)
        return self._half + half, half


@dataclass(frozen=True)
class Fingertip(Tool):
    """An ellipsoid, as the pad of a finger: its distance is exact to first order at the surface.

    With k₀ = |(x/a, y/b, z/c)| and k₁ = |(x/a², y/b², z/c²)| the distance is k₀(k₀ − 1)/k₁.

    Attributes
    ----------
    size_x, size_y, size_z : float
        Lengths in m along x, y and z; z is the direction in which it presses.

    Raises
    ------
    UsageError
        For a length that is not positive.
    """

    size_x: float = 0.018
    size_y: float = 0.016
    size_z: float = 0.014

    def __post_init__(self) -> None:
        for axis, value in zip("xyz", (self.size_x, self.size_y, self.size_z), strict=True):
            checks.positive(f"The length of a fingertip along {axis}", value, "m")

    def __str__(self) -> str:
        sizes = " × ".join(millimetres(value) for value in (self.size_x, self.size_y, self.size_z))
        return f"fingertip of {sizes}"

    @property
    def _axes(self) -> tuple[float, float, float]:
        return self.size_x / 2, self.size_y / 2, self.size_z / 2

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        coordinates = parts(point)
        # in lengths of the middle axis: the smoothing of `length` is one of lengths in m
        unit = self.size_y / 2
        first = length(*(unit / a * x for x, a in zip(coordinates, self._axes, strict=True)))
        second = length(*((unit / a) ** 2 * x for x, a in zip(coordinates, self._axes, strict=True)))
        return first * (first - unit) / second

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3)."""
        return np.asarray(np.linalg.norm(direction * np.array(self._axes), axis=1))

    @property
    def front(self) -> float:
        """Half the length along z, in m."""
        return self.size_z / 2

    @property
    def least_radius(self) -> float:
        """Least radius of curvature in m, at the end of the longest axis."""
        return min(self._axes) ** 2 / max(self._axes)

    @property
    def size(self) -> float:
        """Half the shortest length in m."""
        return min(self._axes)

    @property
    def inscribed_radius(self) -> float:
        """Half the shortest length in m."""
        return min(self._axes)

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and y of the cut at a depth in m."""
        a, b, c = self._axes
        share = _half_chord(c, depth) / c
        return a * share, b * share


@dataclass(frozen=True)
class Cone(Tool):
    """A long cone that points along −z, with a rounded tip.

    Attributes
    ----------
    half_angle : float
        Angle in rad between its axis and its side, from above 0 to below π/2.
    tip : float
        Radius of the rounded tip in m.

    Raises
    ------
    UsageError
        For an angle that makes no cone, or a tip that is not positive.
    """

    half_angle: float
    tip: float

    def __post_init__(self) -> None:
        checks.positive("The half angle of a cone", self.half_angle, "rad")
        checks.positive("The tip radius of a cone", self.tip, "m")
        if self.half_angle >= math.pi / 2:
            raise UsageError(
                f"A cone has a half angle of {self.half_angle:g} rad.",
                why="It is the angle between axis and side, in rad: at π/2 = 1.571 the cone is a plane.",
                fix="Give for example math.radians(75) for sides at 15° to the surface.",
            )

    def __str__(self) -> str:
        return f"cone of {math.degrees(self.half_angle):.3g}° from axis to side, tip {millimetres(self.tip)}"

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        x, y, z = parts(point)
        radius, sine, cosine = length(x, y), math.cos(self.half_angle), math.sin(self.half_angle)
        along, off = radius * cosine + z * sine, radius * sine - z * cosine  # along the side, and off it
        return where_positive(along, off, length(radius, z)) - self.tip

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3), infinite where a side faces forward less."""
        return np.where(-direction[:, 2] >= math.sin(self.half_angle) - 1e-12, self.tip, np.inf)

    @property
    def front(self) -> float:
        """Radius of the tip in m."""
        return self.tip

    @property
    def least_radius(self) -> float:
        """Radius of the tip in m."""
        return self.tip

    @property
    def size(self) -> float:
        """Twice the tip's radius in m."""
        return 2 * self.tip

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and y of the cut at a depth in m."""
        # the side leaves the tip at the height 1 − sin(half angle) of its radius
        sine, cosine = math.sin(self.half_angle), math.cos(self.half_angle)
        round_part = self.tip * (1 - sine)
        half = _half_chord(self.tip, min(depth, round_part)) + max(depth - round_part, 0.0) * sine / cosine
        return half, half


def _half_chord(radius: float, depth: float) -> float:
    """Return half the width of a circle at a depth, at most its radius, all in m."""
    depth = min(max(depth, 0.0), radius)
    return math.sqrt(depth * (2 * radius - depth))
