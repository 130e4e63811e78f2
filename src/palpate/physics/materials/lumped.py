"""A law with a lump: the energy density of another law times a factor that is another one in a ball.

The factor and its soft edge are those of `palpate.surrogates.lumps.lump`. So a body with a lump has the mesh of the
body without: what the lump changes is no difference of two meshes. In mixed form distortion and bulk modulus have the
factor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.material import NO_STATE, MadeFrom, Material, Volumetric
from palpate.physics.materials.tensors import Scalar, Tensor, is_symbolic
from palpate.surrogates.lumps.lump import Lump, modulus_factor, share_of_lump

__all__ = ["LumpField", "Lumped"]

NEAREST = 1e-8  # m: keeps the root of a squared distance differentiable at the centre


@dataclass(frozen=True)
class LumpField:
    """The factor of a lump as a coefficient function of NGSolve, of numbers or of parameters that are set later."""

    x: Any
    y: Any
    z: Any
    radius: Any
    ratio: Any

    @property
    def share(self) -> Any:
        """The share χ of the lump in the tissue."""
        import ngsolve

        squared = (ngsolve.x - self.x) ** 2 + (ngsolve.y - self.y) ** 2 + (ngsolve.z - self.z) ** 2
        return share_of_lump(ngsolve.sqrt(squared + NEAREST**2) / self.radius, ngsolve.IfPos)

    @property
    def factor(self) -> Any:
        """The factor m on the energy density."""
        return modulus_factor(self.share, self.ratio)


@dataclass(frozen=True)
class _LumpedVolume(Volumetric):
    """The volumetric part of a law with a lump."""

    field: LumpField

    def mixed(self, F: Tensor, pressure: Scalar) -> Scalar:
        """Return p θ(F) − p²/(2 m κ)."""
        free = pressure * self.measure(F)
        return free - (free - super().mixed(F, pressure)) / self.field.factor


@dataclass(frozen=True)
class Lumped(MadeFrom):
    """The law `base` with a lump in it, a ball of another stiffness with a soft edge.

    Its numbers can vary in a `BodyFamily`: ``Varied("body.radius", 0.003, 0.008)``. Give the elements about it at most
    0.8 of its radius: ``problem(probe)`` with ``fine=(..., FineMesh("inside", ...))``. Moduli are those of the tissue.

    Attributes
    ----------
    base : Material
        Law of the tissue, without a history.
    x, y, z : float
        Centre of the lump in the body's frame, m.
    radius : float
        Radius in m of the sharp ball of the same volume.
    ratio : float
        Modulus of the lump over that of the tissue; 1 for none.

    Raises
    ------
    UsageError
        If radius or ratio is not positive, or the base law has a history.
    """

    base: Material
    x: float
    y: float
    z: float
    radius: float
    ratio: float

    law: ClassVar[str] = "lumped"
    quadrature: ClassVar[int] = 2  # orders more than of a law that is the same everywhere

    def __post_init__(self) -> None:
        if isinstance(self.ratio, float | int):  # parameters of a solver are checked where they are set
            for axis in "xyz":
                checks.finite(f"The {axis} of a lump", getattr(self, axis), "m")
            checks.positive("The radius of a lump", self.radius, "m")
            checks.positive("The ratio of a lump's modulus to the tissue's", self.ratio, "")
        if self.base.states:
            raise UsageError(
                f"{self.base.name} can't have a lump.",
                why="It has a history, and a lump is a factor on an elastic energy.",
                fix="Take an elastic law; relaxation comes afterwards, as a memory of the learnt body.",
            )

    @classmethod
    def of(cls, base: Material, lump: Lump) -> Lumped:
        """Return the law with a lump."""
        return cls(base, *lump.place, lump.radius, lump.ratio)

    @property
    def origin(self) -> Material:
        """Law of the tissue."""
        return self.base

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name of the tissue's law, with a lump."""
        return f"{self.base.name} with a lump"

    @property
    def field(self) -> LumpField:
        """The lump in space."""
        return LumpField(self.x, self.y, self.z, self.radius, self.ratio)

    @property
    def scales(self) -> Mapping[str, float]:
        """Lengths, m, that measure a small step of a number, where not the number itself: the radius for a place."""
        return dict.fromkeys("xyz", self.radius)

    @property
    def volumetric(self) -> Volumetric | None:
        """The volumetric part, whose modulus has the factor too."""
        base = self.base.volumetric
        return None if base is None else _LumpedVolume(base.modulus, base.measure, self.field)

    def energy(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the energy density in J/m³; that of the tissue for arrays, which have no place."""
        energy = self.base.energy(F, state, dt)
        return self.field.factor * energy if is_symbolic(F) else energy

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the energy density without its volumetric part, in J/m³."""
        distortion = self.base.distortion(F, state, dt)
        return self.field.factor * distortion if is_symbolic(F) else distortion

    def tissue_energy(self, F: Tensor, pressure: Scalar | None = None) -> Scalar:
        """Return what the factor multiplies, in J/m³; with a pressure, of the mixed form at m = 1."""
        if pressure is None:
            return self.base.energy(F)
        return self.base.distortion(F) + self.pressure_energy(pressure)

    def pressure_energy(self, pressure: Scalar | None) -> Scalar:
        """Return p²/(2κ) in J/m³, which the factor divides in mixed form; 0 without a pressure."""
        volumetric = self.base.volumetric
        if pressure is None or volumetric is None or math.isinf(volumetric.modulus):
            return 0.0
        return pressure**2 / (2 * volumetric.modulus)
