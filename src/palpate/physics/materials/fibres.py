"""Fibres in a matrix: families of directions with dispersion, that bear tension only."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.material import NO_STATE, MadeFrom, Material, StateVariable, Volumetric
from palpate.physics.materials.moduli import require_numbers
from palpate.physics.materials.tensors import (
    Scalar,
    Tensor,
    constant,
    determinant,
    dot,
    exp,
    isochoric_first,
    positive_part,
    power,
    transform,
)

__all__ = ["FibreFamily", "FibreReinforced"]


@dataclass(frozen=True)
class FibreFamily:
    """One family of collagen fibres: W = k₁/(2 k₂) (exp(k₂ ⟨E⟩²) − 1), E = κ (Ī₁ − 3) + (1 − 3κ)(Ī₄ − 1).

    Gasser, Ogden & Holzapfel 2006 (J. R. Soc. Interface 3, 15-35); κ = 0 is Holzapfel, Gasser &
    Ogden 2000. Ī₄ is the square of the isochoric stretch along the mean direction. The bracket ⟨E⟩ = max(E, 0), which
    lets dispersed fibres engage once they are stretched on average, keeps the energy and the stress continuous.

    Attributes
    ----------
    direction : tuple of float
        Mean direction in the undeformed body, of any length but zero; normalised.
    k1 : float
        Modulus k₁ in Pa, positive.
    k2 : float
        Exponent k₂, a pure number, positive.
    dispersion : float
        Dispersion κ, a pure number in [0, 1/3]: 0 for aligned, 1/3 for isotropic fibres.

    Raises
    ------
    UsageError
        For other constants or directions.
    """

    direction: tuple[float, float, float] | Sequence[float]
    k1: float
    k2: float
    dispersion: float = 0.0

    def __post_init__(self) -> None:
        along = require_numbers("A fibre direction", self.direction)
        length = math.hypot(*along)
        if len(along) != 3 or length == 0:
            raise UsageError(
                f"The fibre direction is {tuple(self.direction)}.",
                why="It is a vector with three components, not all zero.",
                fix="Pass, for example, direction=(1.0, 0.0, 0.0).",
            )
        object.__setattr__(self, "direction", tuple(x / length for x in along))
        checks.positive("The fibre modulus k1", self.k1, "Pa")
        checks.positive("The fibre exponent k2", self.k2, "")
        (kappa,) = require_numbers("The fibre dispersion", self.dispersion)
        if not 0 <= kappa <= 1 / 3:
            raise UsageError(
                f"The fibre dispersion is {kappa}.",
                why="It runs from 0, all fibres aligned, to 1/3, all directions alike.",
                fix="Correct the value; Gasser et al. 2006 give 0.226 for an iliac adventitia.",
            )

    def strain(self, F: Tensor) -> Scalar:
        """Return E = κ (Ī₁ − 3) + (1 − 3κ)(Ī₄ − 1), a pure number."""
        kappa = self.dispersion
        along = transform(F, constant(self.direction, F))
        stretched = power(determinant(F), -2 / 3) * dot(along, along) - 1
        return kappa * (isochoric_first(F) - 3) + (1 - 3 * kappa) * stretched

    def energy(self, F: Tensor) -> Scalar:
        """Return the energy density in J/m³."""
        return self.k1 / (2 * self.k2) * (exp(self.k2 * positive_part(self.strain(F)) ** 2) - 1)

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "direction": list(self.direction),
            "k1": self.k1,
            "k2": self.k2,
            "dispersion": self.dispersion,
        }


@dataclass(frozen=True)
class FibreReinforced(MadeFrom):
    """A matrix of any large-strain law with families of fibres, their energies added.

    Moduli, density, volumetric part and history are the matrix's: undeformed fibres bear no compression, so the moduli
    are those of a body whose fibres are slack, and in tension along a family the body is stiffer from the start. The
    directions are the same throughout the body (a region of its own may have others). The fibres see the isochoric
    deformation only, as in Gasser et al. 2006: far from incompressibility this understates them (Helfenstein et al.
    2010, Int. J. Solids Struct. 47, 2056-2061).

    Attributes
    ----------
    matrix : Material
        Such as `NeoHookean` in its isochoric form.
    families : FibreFamily or tuple of FibreFamily
        One family of fibres or more.
    name, source : str
        Name of the material, and source of its constants.

    Raises
    ------
    UsageError
        For a matrix of a small-strain law, or no family.
    """

    matrix: Material
    families: tuple[FibreFamily, ...]
    name: str = "fibre-reinforced"
    source: str = ""

    law: ClassVar[str] = "fibre-reinforced"

    def __post_init__(self) -> None:
        single = isinstance(self.families, FibreFamily)
        object.__setattr__(self, "families", (self.families,) if single else tuple(self.families))
        if not (self.families and all(isinstance(f, FibreFamily) for f in self.families)):
            raise UsageError(
                "A fibre-reinforced material has no fibres.",
                why=f"Its families are {self.families!r}.",
                fix="Pass families=(FibreFamily(direction=(1, 0, 0), k1=1e6, k2=500.0),).",
            )
        if getattr(self.matrix, "kinematics", None) != "large":
            raise UsageError(
                f"The matrix {getattr(self.matrix, 'name', self.matrix)!s} is no law of large strain.",
                why="Fibres are described by stretches, which a small-strain law does not have.",
                fix='Take, for example, NeoHookean(young=9e3, poisson=0.49, form="isochoric").',
            )

    @property
    def origin(self) -> Material:
        """The matrix."""
        return self.matrix

    @property
    def states(self) -> tuple[StateVariable, ...]:  # type: ignore[override]  # none in other laws
        """The matrix's internal variables."""
        return self.matrix.states

    @property
    def volumetric(self) -> Volumetric | None:
        """The matrix's volumetric part."""
        return self.matrix.volumetric

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the matrix's distortion energy and that of the fibres, in J/m³."""
        base = self.matrix.energy if self.volumetric is None else self.matrix.distortion
        return base(F, state, dt) + sum(family.energy(F) for family in self.families)

    def advance(self, F: Tensor, state: Mapping[str, Any], dt: Any) -> dict[str, Any]:
        """Return the matrix's internal variables at the end of the step."""
        return self.matrix.advance(F, state, dt)

    def stored_energy(self, F: Tensor, state: Mapping[str, Any]) -> Scalar:
        """Return the free energy in J/m³: the matrix's and the fibres'."""
        stored = getattr(self.matrix, "stored_energy", self.matrix.energy)
        return stored(F, state) + sum(family.energy(F) for family in self.families)

    def stored_distortion(self, F: Tensor, state: Mapping[str, Any]) -> Scalar:
        """`stored_energy` without the matrix's volumetric part, which a mixed formulation writes in its own way."""
        stored = getattr(self.matrix, "stored_distortion", self.matrix.distortion)
        return stored(F, state) + sum(family.energy(F) for family in self.families)

    def dissipated_energy(self, F: Tensor, state: Mapping[str, Any], dt: Any) -> Scalar:
        """Return the dissipation of a step in J/m³: the matrix's; fibres are elastic."""
        heat = getattr(self.matrix, "dissipated_energy", None)
        return heat(F, state, dt) if heat else 0.0
