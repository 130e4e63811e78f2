"""The St. Venant–Kirchhoff law: linear in the Green–Lagrange strain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from palpate.physics.materials.material import NO_STATE, Volumetric, YoungAndPoisson
from palpate.physics.materials.moduli import unphysical
from palpate.physics.materials.tensors import Scalar, Tensor, identity, inner, matmul, trace, transpose

__all__ = ["StVenantKirchhoff"]


@dataclass(frozen=True)
class StVenantKirchhoff(YoungAndPoisson):
    """W = μ E : E + ½ λ (tr E)² with the Green–Lagrange strain E = ½(FᵀF − I).

    For large rotations at small strain. In compression it softens and fails: uniaxial stress falls below a stretch of
    √(1/3), and nothing keeps a volume positive (Ciarlet 1988, Mathematical Elasticity I, section 3.9).

    Attributes
    ----------
    young : float
        Initial Young's modulus E in Pa, positive.
    poisson : float
        Initial Poisson's ratio ν, in (-1, 0.5): the trace of E is no volume that could be kept.
    density : float
        Reference density in kg/m³.
    name, source : str
        Name of the material, and source of its constants.

    Raises
    ------
    UsageError
        For constants that no stable material has.
    """

    young: float
    poisson: float
    density: float = 0.0
    name: str = "St. Venant–Kirchhoff"
    source: str = ""

    law: ClassVar[str] = "St. Venant–Kirchhoff"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.poisson == 0.5:
            raise unphysical("Poisson's ratio of a St. Venant–Kirchhoff law", 0.5, "below 0.5")

    @property
    def volumetric(self) -> Volumetric | None:
        """½ λ (tr E)², if λ is positive."""
        lame = self._lame
        return Volumetric(lame, _green_volume) if lame > 0 else None

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """μ E : E, in J/m³; with the other term where λ ≤ 0."""
        strain = _green_strain(F)
        shape = self.shear_modulus * inner(strain, strain)
        if self.volumetric is not None:
            return shape
        return shape + 0.5 * self._lame * _green_volume(F) ** 2


def _green_strain(F: Tensor) -> Tensor:
    """The Green–Lagrange strain ½(FᵀF − I)."""
    return 0.5 * (matmul(transpose(F), F) - identity(F))


def _green_volume(F: Tensor) -> Scalar:
    """The trace of the Green–Lagrange strain."""
    return trace(_green_strain(F))
