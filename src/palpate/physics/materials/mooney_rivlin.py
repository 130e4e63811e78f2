"""The Mooney–Rivlin law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from palpate.physics.materials.material import NO_STATE, Isochoric
from palpate.physics.materials.tensors import Scalar, Tensor, isochoric_first, isochoric_second

__all__ = ["MooneyRivlin"]


@dataclass(frozen=True)
class MooneyRivlin(Isochoric):
    """W = C₁₀ (Ī₁ − 3) + C₀₁ (Ī₂ − 3) + ½ K (J − 1)² (Mooney 1940; Rivlin 1948).

    A negative C₀₁, which unconstrained fits to tension alone often give, makes it unstable in compression: ask
    `stability`.

    Attributes
    ----------
    c10, c01 : float
        C₁₀ and C₀₁ in Pa; their sum is half of the initial shear modulus and must be positive.
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
    c01: float
    bulk: float
    density: float = 0.0
    name: str = "Mooney–Rivlin"
    source: str = ""

    law: ClassVar[str] = "Mooney–Rivlin"

    @property
    def shear_modulus(self) -> float:
        """μ = 2(C₁₀ + C₀₁) in Pa."""
        return 2 * (self.c10 + self.c01)

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """C₁₀ (Ī₁ − 3) + C₀₁ (Ī₂ − 3), in J/m³."""
        return self.c10 * (isochoric_first(F) - 3) + self.c01 * (isochoric_second(F) - 3)
