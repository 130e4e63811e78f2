"""The linear elastic law of small strain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from palpate.physics.materials.material import NO_STATE, Elastic, Volumetric, small_volume
from palpate.physics.materials.moduli import bulk_from_young, require_moduli, shear_from_young
from palpate.physics.materials.tensors import Scalar, Tensor, deviator, identity, inner, sym

__all__ = ["MATERIALS", "LinearElastic"]


@dataclass(frozen=True)
class LinearElastic(Elastic):
    """Isotropic and linear: W = μ dev ε : dev ε + ½ K (tr ε)², with ε = sym(F − I).

    For strains of a few percent without large rotations; a beam takes its moduli and has its own kinematics.

    Attributes
    ----------
    young : float
        Young's modulus E in Pa, positive.
    poisson : float
        Poisson's ratio ν, in (-1, 0.5].
    density : float
        In kg/m³; matters only under self-weight.
    name, source : str
        What it is called and where its constants are from.

    Raises
    ------
    UsageError
        For constants that no stable material has.
    """

    young: float
    poisson: float
    density: float = 0.0
    name: str = "linear elastic"
    source: str = ""

    law: ClassVar[str] = "linear elastic"
    kinematics: ClassVar[Literal["large", "small"]] = "small"

    def __post_init__(self) -> None:
        require_moduli(self.young, self.poisson, self.density)

    @property
    def shear_modulus(self) -> float:
        """G = E/(2(1 + ν)) in Pa."""
        return shear_from_young(self.young, self.poisson)

    @property
    def bulk_modulus(self) -> float:
        """K = E/(3(1 − 2ν)) in Pa."""
        return bulk_from_young(self.young, self.poisson)

    @property
    def volumetric(self) -> Volumetric:
        """½ K (tr ε)²."""
        return Volumetric(self.bulk_modulus, small_volume)

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """The energy of the change of shape, μ dev ε : dev ε, in J/m³."""
        shear = deviator(sym(F - identity(F)))
        return self.shear_modulus * inner(shear, shear)


_FOUNDING = "Narayanan, Singla, Garimella, Waz & Krovi 2011, ASME DSCC"

MATERIALS: dict[str, LinearElastic] = {
    material.name: material
    for material in (
        LinearElastic(110e9, 0.35, 8700.0, "copper", _FOUNDING),
        LinearElastic(2e9, 0.43, 1150.0, "nylon", _FOUNDING),
    )
}
"""The linear materials of the founding case, part of the library."""
