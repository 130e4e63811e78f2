"""Cross-sections of beams: areas, second moments and shear factors.

The shear factors are those of Cowper 1966 (The shear coefficient in Timoshenko's beam theory, J. Appl. Mech.
33, 335-340, table 1).

Sections that are cut into fibres give the heights and areas of a Gauss rule over their height, so that area and second
moment are exact with any number of fibres from two on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from palpate import checks
from palpate.errors import UsageError

__all__ = ["Circle", "CrossSection", "FibreSection", "Rectangle", "Section"]


class CrossSection(Protocol):
    """The members that a beam needs of its cross-section."""

    @property
    def area(self) -> float:
        """Area A in m²."""

    @property
    def second_moment(self) -> float:
        """Second moment of area I about the bending axis z, in m⁴."""

    @property
    def half_height(self) -> float:
        """Distance in m from the centre line to the outermost fibre: bending strain, and the drawn radius."""

    def shear_factor(self, poisson: float) -> float:
        """Return the share k of the area that carries shear, a pure number."""


class FibreSection(CrossSection, Protocol):
    """A cross-section that can be cut into fibres."""

    def fibres(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return heights y in m above the centre line, ascending, and areas in m², both of shape (count,)."""


@dataclass(frozen=True)
class Circle:
    """A solid circle.

    Attributes
    ----------
    radius : float
        Radius r in m.
    """

    radius: float

    def __post_init__(self) -> None:
        checks.positive("The section's radius", self.radius, "m")

    @property
    def area(self) -> float:
        """πr² in m²."""
        return math.pi * self.radius**2

    @property
    def second_moment(self) -> float:
        """πr⁴/4 in m⁴."""
        return math.pi * self.radius**4 / 4

    @property
    def half_height(self) -> float:
        """The radius, in m."""
        return self.radius

    def shear_factor(self, poisson: float) -> float:
        """Return 6(1 + ν)/(7 + 6ν), Cowper 1966."""
        return 6 * (1 + poisson) / (7 + 6 * poisson)

    def fibres(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return heights in m and areas in m² of the Gauss-Chebyshev rule of the second kind, weighted by the width."""
        angles = np.arange(count, 0, -1) * math.pi / (count + 1)
        # ∫ f(y) 2√(r² - y²) dy = 2r² ∫ f(r cos φ) sin²φ dφ (Abramowitz & Stegun 1964, 25.4.40)
        return self.radius * np.cos(angles), 2 * self.radius**2 * np.sin(angles) ** 2 * math.pi / (count + 1)


@dataclass(frozen=True)
class Rectangle:
    """A solid rectangle, bent in the plane of its height.

    Attributes
    ----------
    width, height : float
        Sides in m, along z and y.
    """

    width: float
    height: float

    def __post_init__(self) -> None:
        checks.positive("The section's width", self.width, "m")
        checks.positive("The section's height", self.height, "m")

    @property
    def area(self) -> float:
        """Width times height, in m²."""
        return self.width * self.height

    @property
    def second_moment(self) -> float:
        """Width times height cubed over 12, in m⁴."""
        return self.width * self.height**3 / 12

    @property
    def half_height(self) -> float:
        """Half of the height, in m."""
        return self.height / 2

    def shear_factor(self, poisson: float) -> float:
        """Return 10(1 + ν)/(12 + 11ν), Cowper 1966."""
        return 10 * (1 + poisson) / (12 + 11 * poisson)

    def fibres(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return heights in m and areas in m² of the Gauss-Legendre rule."""
        points, weights = np.polynomial.legendre.leggauss(count)
        return self.half_height * points, self.width * self.half_height * weights


@dataclass(frozen=True)
class Section:
    """A section given by its numbers, for shapes that have no class of their own.

    Attributes
    ----------
    area : float
        Area A in m².
    second_moment : float
        Second moment of area I about the bending axis, in m⁴.
    shear : float
        Shear factor k, a pure number in (0, 1].
    height : float, optional
        Height in m; by default that of a circle with the same radius of gyration.
    """

    area: float
    second_moment: float
    shear: float
    height: float | None = None

    def __post_init__(self) -> None:
        checks.positive("The section's area", self.area, "m²")
        checks.positive("The section's second_moment", self.second_moment, "m⁴")
        checks.positive("The section's shear factor", self.shear)
        if self.shear > 1:
            raise UsageError(
                f"A shear factor of {self.shear} is above 1.",
                why="It is the share of the area that carries the shear force.",
                fix="Take it from a table such as Cowper 1966; a solid circle has about 0.9.",
            )
        if self.height is not None:
            checks.positive("The section's height", self.height, "m")

    @property
    def half_height(self) -> float:
        """Half of the height, in m."""
        # a circle has I/A = r²/4
        return self.height / 2 if self.height else 2 * math.sqrt(self.second_moment / self.area)

    def shear_factor(self, poisson: float) -> float:
        """Return the factor that was given, whatever Poisson's ratio."""
        return self.shear
