"""An elastic law whose resistance to a change of shape is multiplied by a factor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias

from palpate.physics.arguments import require_positive
from palpate.physics.materials.material import NO_STATE, Elastic, Material, Volumetric
from palpate.physics.materials.moduli import poisson_ratio, young_modulus
from palpate.physics.materials.tensors import Scalar, Tensor

__all__ = ["Scaled"]

Part: TypeAlias = Literal["distortion", "all"]
"""Which part of an elastic law is meant; a law without a separate volumetric part is all distortion."""


@dataclass(frozen=True)
class Scaled(Elastic):
    """The law `base` times `factor`; a separate volumetric part stays as it is unless `part` is "all".

    What a viscoelastic material turns into once it has relaxed, or was before it did.

    Attributes
    ----------
    base : Material
        An elastic law.
    factor : float
        A pure number, positive.
    part : "distortion" or "all"
        What is multiplied.
    """

    base: Material
    factor: float
    part: Part = "distortion"

    law: ClassVar[str] = "scaled"

    def __post_init__(self) -> None:
        require_positive("The factor of a scaled law", self.factor, "")

    @property
    def name(self) -> str:  # type: ignore[override]
        """That of the base law and the factor."""
        return f"{self.base.name} × {self.factor:.4g}"

    @property
    def source(self) -> str:  # type: ignore[override]
        """That of the base law."""
        return self.base.source

    @property
    def density(self) -> float:  # type: ignore[override]
        """In kg/m³."""
        return self.base.density

    @property
    def kinematics(self) -> Literal["large", "small"]:  # type: ignore[override]
        """Those of the base law."""
        return self.base.kinematics

    @property
    def young(self) -> float:
        """In Pa."""
        return young_modulus(self.shear_modulus, self.bulk_modulus)

    @property
    def poisson(self) -> float:
        """A pure number."""
        return poisson_ratio(self.shear_modulus, self.bulk_modulus)

    @property
    def shear_modulus(self) -> float:
        """In Pa."""
        return self.factor * self.base.shear_modulus

    @property
    def bulk_modulus(self) -> float:
        """In Pa; the volumetric part's share of it is not scaled."""
        kept = kept_bulk(self.base, self.part)
        # both may be infinite, and their difference then vanishes
        rest = 0.0 if kept == self.base.bulk_modulus else self.base.bulk_modulus - kept
        return kept + self.factor * rest

    @property
    def volumetric(self) -> Volumetric | None:
        """That of the base law, multiplied if it is meant too."""
        volumetric = self.base.volumetric
        if volumetric is None or self.part == "distortion":
            return volumetric
        return Volumetric(self.factor * volumetric.modulus, volumetric.measure)

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Factor times the base law's distortion, in J/m³; of its whole energy where it has no volumetric part."""
        return self.factor * part_of(self.base, "distortion", F)


def part_of(base: Material, part: Part, F: Tensor) -> Scalar:
    """Energy in J/m³ of all of an elastic law, or of all but a separate volumetric part."""
    return base.energy(F) if part == "all" or base.volumetric is None else base.distortion(F)


def kept_bulk(base: Material, part: Part) -> float:
    """Bulk modulus in Pa of what is not in that part: the separate volumetric energy, if any."""
    return 0.0 if part == "all" or base.volumetric is None else base.volumetric.modulus
