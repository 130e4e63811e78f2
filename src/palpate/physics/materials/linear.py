"""The linear elastic law of small strain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from palpate.physics.materials.material import NO_STATE, Volumetric, YoungAndPoisson, small_volume
from palpate.physics.materials.tensors import Scalar, Tensor, deviator, identity, inner, sym

__all__ = ["LinearElastic"]


@dataclass(frozen=True)
class LinearElastic(YoungAndPoisson):
    """Isotropic and linear: W = μ dev ε : dev ε + ½ K (tr ε)², with ε = sym(F − I).

    For strains of a few percent without large rotations; a beam takes its moduli and has its own kinematics.

    Attributes
    ----------
    young : float
        Young's modulus E in Pa, positive.
    poisson : float
        Poisson's ratio ν, in (-1, 0.5].
    density : float
        Reference density in kg/m³; matters only under self-weight.
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
    name: str = "linear elastic"
    source: str = ""

    law: ClassVar[str] = "linear elastic"
    kinematics: ClassVar[Literal["large", "small"]] = "small"

    @property
    def volumetric(self) -> Volumetric:
        """½ K (tr ε)²."""
        return Volumetric(self.bulk_modulus, small_volume)

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """The energy of the change of shape, μ dev ε : dev ε, in J/m³."""
        shear = deviator(sym(F - identity(F)))
        return self.shear_modulus * inner(shear, shear)
