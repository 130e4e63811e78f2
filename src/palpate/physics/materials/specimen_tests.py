"""Records of tests on specimens, from which a material's constants are fitted.

StretchTest      stress against stretch in uniaxial, equibiaxial or planar tension or compression
IndentationTest  force against depth of a rigid ball on a slab that is bonded to a rigid ground
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from palpate import checks
from palpate.errors import UsageError

__all__ = [
    "MEASURES",
    "MODES",
    "IndentationTest",
    "SpecimenTest",
    "StretchTest",
    "columns_of_numbers",
    "first_invariant",
]

MODES = ("uniaxial", "equibiaxial", "planar")
MEASURES = ("nominal", "true")
LEAST_ROWS = 3  # of a test: fewer tell no curve
LARGEST_STRETCH = 20.0  # stretch of no elastomer; a strain in percent looks like one


@dataclass(frozen=True, eq=False)
class StretchTest:
    """Stress against stretch of a specimen whose deformation is the same everywhere.

    Attributes
    ----------
    mode : str
        ``"uniaxial"``: one direction is stretched and the sides are free. ``"equibiaxial"``: two directions alike, as
        in an inflated sheet. ``"planar"``: one direction, with the width kept, as in a wide strip ("pure shear").
    stretch : (N,) array
        Length over undeformed length, λ, positive; 1 is undeformed. `of_strain` takes strains.
    stress : (N,) array
        Stress in Pa along the stretched direction, positive in tension.
    measure : str
        ``"nominal"`` (engineering stress): force over undeformed area. ``"true"`` (Cauchy stress): force over area now.
    name : str
        Name for messages and plots; by default the mode.

    Raises
    ------
    UsageError
        For an unknown mode or measure, unequal lengths, numbers that are not finite, or stretches out of range.
    """

    mode: Literal["uniaxial", "equibiaxial", "planar"]
    stretch: np.ndarray
    stress: np.ndarray
    measure: Literal["nominal", "true"]
    name: str = ""

    def __post_init__(self) -> None:
        checks.one_of("The mode of a test", self.mode, MODES)
        checks.one_of("The measure of stress", self.measure, MEASURES)
        stretch, stress = columns_of_numbers("stretches", self.stretch, "stresses", self.stress)
        if stretch.min() <= 0 or stretch.max() > LARGEST_STRETCH:
            raise UsageError(
                f"The stretches of the {self.mode} test run from {stretch.min():g} to {stretch.max():g}.",
                why=f"A stretch is length over undeformed length, between 0 and {LARGEST_STRETCH:g}; 1 is undeformed.",
                fix="Pass strains by StretchTest.of_strain, as numbers and not in percent.",
            )
        if np.allclose(stretch, 1):
            raise UsageError(
                f"Nothing is stretched in the {self.mode} test.",
                why="All its stretches are 1, the undeformed length.",
                fix="Pass strains by StretchTest.of_strain.",
            )
        object.__setattr__(self, "stretch", stretch)
        object.__setattr__(self, "stress", stress)
        object.__setattr__(self, "name", self.name or self.mode)

    @classmethod
    def of_strain(
        cls,
        mode: Literal["uniaxial", "equibiaxial", "planar"],
        strain: ArrayLike,
        stress: ArrayLike,
        measure: Literal["nominal", "true"],
        *,
        logarithmic: bool = False,
        name: str = "",
    ) -> StretchTest:
        """Return a test whose strains were recorded.

        Parameters
        ----------
        mode, stress, measure, name : str, (N,) array, str, str
            As for the class.
        strain : (N,) array
            Engineering strain λ − 1, a pure number: 0.5 for 50 %.
        logarithmic : bool
            True for true (logarithmic) strain ln λ instead.

        Raises
        ------
        UsageError
            As for the class.
        """
        values = np.asarray(strain, dtype=float)
        stretch = np.exp(np.minimum(values, 50.0)) if logarithmic else 1 + values
        return cls(mode, stretch, np.asarray(stress, dtype=float), measure, name)

    @property
    def values(self) -> np.ndarray:
        """The measured stresses (N,) in Pa."""
        return self.stress

    @property
    def largest_invariant(self) -> float:
        """Largest I₁ = λ₁² + λ₂² + λ₃² that an incompressible specimen reaches."""
        return float(first_invariant(self.mode)(self.stretch).max())


@dataclass(frozen=True, eq=False)
class IndentationTest:
    """Force against depth of a rigid ball that is pressed without friction into a slab bonded to a rigid ground.

    Attributes
    ----------
    depth : (N,) array
        Depth of the ball's lowest point below the surface at rest, in m, not negative.
    force : (N,) array
        Force on the ball in N, positive where the slab pushes back.
    radius : float
        Radius of the ball in m.
    thickness : float
        Thickness of the slab in m.
    width : float, optional
        Width of the slab in m, by default six radii of the largest contact or three thicknesses, what is more.
    name : str
        Name for messages and plots.

    Raises
    ------
    UsageError
        For unequal lengths, numbers that are not finite, sizes that are not positive, or a depth beyond the slab.
    """

    depth: np.ndarray
    force: np.ndarray
    radius: float
    thickness: float
    width: float | None = None
    name: str = "indentation"

    def __post_init__(self) -> None:
        depth, force = columns_of_numbers("depths", self.depth, "forces", self.force)
        checks.positive("The radius of the ball", self.radius, "m")
        checks.positive("The thickness of the slab", self.thickness, "m")
        if self.width is not None:
            checks.positive("The width of the slab", self.width, "m")
        deepest = min(0.6 * self.thickness, self.radius)
        if depth.min() < 0 or not 0 < depth.max() <= deepest:
            raise UsageError(
                f"The depths of the indentation run from {depth.min():g} to {depth.max():g} m.",
                why=f"A ball of radius {self.radius:g} m on a slab of {self.thickness:g} m can be followed from 0 to "
                f"{deepest:g} m.",
                fix="Count the depth from the first contact, in m, and leave out what is deeper.",
            )
        object.__setattr__(self, "depth", depth)
        object.__setattr__(self, "force", force)

    @property
    def values(self) -> np.ndarray:
        """The measured forces (N,) in N."""
        return self.force


SpecimenTest: TypeAlias = StretchTest | IndentationTest
"""A record that `fit` takes."""


def first_invariant(mode: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return I₁ of an incompressible material as a function of the stretch (or of the shear strain) of a test."""
    return {
        "uniaxial": lambda s: s**2 + 2 / s,
        "equibiaxial": lambda s: 2 * s**2 + s**-4,
        "planar": lambda s: s**2 + 1 + s**-2,
        "simple shear": lambda s: 3 + s**2,
    }[mode]


def columns_of_numbers(
    what: str, first: ArrayLike, other: str, second: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Return two columns as arrays (N,) of finite numbers, of equal length and at least three."""
    pair = []
    for name, values in ((what, first), (other, second)):
        try:
            column = np.asarray(values, dtype=float).ravel()
        except (TypeError, ValueError) as error:
            raise UsageError(f"The {name} are no numbers.", why=f"{error}.", fix="Pass arrays.") from error
        if not np.isfinite(column).all():
            raise UsageError(
                f"One of the {name} is no finite number.",
                why="Nothing can be fitted to it.",
                fix="Leave out rows with gaps.",
            )
        pair.append(column)
    if len(pair[0]) != len(pair[1]) or len(pair[0]) < LEAST_ROWS:
        raise UsageError(
            f"There are {len(pair[0])} {what} and {len(pair[1])} {other}.",
            why=f"Each row of a test has one of both, and there are at least {LEAST_ROWS} rows.",
            fix="Pass two arrays of equal length.",
        )
    return pair[0], pair[1]
