"""Laws split into a change of shape at constant volume and a change of volume (Flory 1961; Simo & Taylor 1991)."""

from __future__ import annotations

import dataclasses
from typing import Any, Self

from palpate.physics.arguments import require_positive
from palpate.physics.materials.material import Elastic, Volumetric, volume_change
from palpate.physics.materials.moduli import (
    bulk_from_poisson,
    poisson_ratio,
    require_density,
    require_poisson,
    young_modulus,
)
from palpate.physics.materials.tensors import Scalar, Tensor, cofactor, determinant, inner, power

__all__ = ["Isochoric", "isochoric_first", "isochoric_second"]


def isochoric_first(F: Tensor) -> Scalar:
    """Ī₁ = J^(−2/3) tr FᵀF."""
    return power(determinant(F), -2 / 3) * inner(F, F)


def isochoric_second(F: Tensor) -> Scalar:
    """Ī₂ = J^(−4/3) I₂, with I₂ = cof F : cof F."""
    H = cofactor(F)
    return power(determinant(F), -4 / 3) * inner(H, H)


class Isochoric(Elastic):
    """What the laws of C̄ = J^(−2/3) FᵀF share: ½ K (J − 1)² for the volume, with K their field `bulk`."""

    bulk: float

    @classmethod
    def with_poisson(cls, poisson: float, **constants: Any) -> Self:
        """The law with the bulk modulus that gives an initial Poisson's ratio.

        Parameters
        ----------
        poisson : float
            In (-1, 0.5]; 0.5 makes the material incompressible, for a mixed formulation only.
        **constants
            The law's constants but `bulk`.

        Raises
        ------
        UsageError
            For constants that no stable material has.
        """
        require_poisson(poisson)
        law = cls(**constants | {"bulk": 1.0})
        bulk = bulk_from_poisson(law.shear_modulus, poisson)
        return dataclasses.replace(law, bulk=bulk)  # type: ignore[type-var]  # every law is a dataclass

    @property
    def young(self) -> float:
        """Initial Young's modulus in Pa."""
        return young_modulus(self.shear_modulus, self.bulk)

    @property
    def poisson(self) -> float:
        """Initial Poisson's ratio."""
        return poisson_ratio(self.shear_modulus, self.bulk)

    @property
    def bulk_modulus(self) -> float:
        """K in Pa."""
        return self.bulk

    @property
    def volumetric(self) -> Volumetric:
        """½ K (J − 1)²."""
        return Volumetric(self.bulk, volume_change)

    def _check(self) -> None:
        require_positive(f"The bulk modulus of {self.name}", self.bulk, "Pa", infinite=True)
        require_positive(f"The initial shear modulus of {self.name}", self.shear_modulus, "Pa")
        require_density(self.density)
