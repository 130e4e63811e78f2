"""Yeoh's law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from palpate.physics.materials.material import NO_STATE, Isochoric
from palpate.physics.materials.tensors import Scalar, Tensor, isochoric_first

__all__ = ["Yeoh"]


@dataclass(frozen=True)
class Yeoh(Isochoric):
    """W = C₁₀ (Ī₁ − 3) + C₂₀ (Ī₁ − 3)² + C₃₀ (Ī₁ − 3)³ + ½ K (J − 1)² (Yeoh 1993, Rubber Chem. Technol. 66, 754-771).

    Attributes
    ----------
    c10, c20, c30 : float
        In Pa; C₁₀ is half of the initial shear modulus and must be positive.
    bulk : float
        Bulk modulus K in Pa, positive; `with_poisson` gives it.
    density : float
        Reference density in kg/m³.
    name, source : str
        Name of the material, and source of its constants.

    Raises
    ------
    UsageError
        For constants that no stable material has.
    """

    c10: float
    c20: float
    c30: float
    bulk: float
    density: float = 0.0
    name: str = "Yeoh"
    source: str = ""

    law: ClassVar[str] = "Yeoh"

    @property
    def shear_modulus(self) -> float:
        """μ = 2 C₁₀ in Pa."""
        return 2 * self.c10

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """The polynomial in Ī₁ − 3, in J/m³."""
        x = isochoric_first(F) - 3
        return ((self.c30 * x + self.c20) * x + self.c10) * x
