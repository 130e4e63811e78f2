"""The neo-Hookean law, coupled or split into shape and volume."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.material import (
    NO_STATE,
    Volumetric,
    YoungAndPoisson,
    log_volume,
    volume_change,
)
from palpate.physics.materials.moduli import (
    poisson_ratio,
    require_moduli,
    young_modulus,
)
from palpate.physics.materials.tensors import Scalar, Tensor, inner, isochoric_first

__all__ = ["NeoHookean"]


@dataclass(frozen=True)
class NeoHookean(YoungAndPoisson):
    """The law of a Gaussian polymer network; for most bodies the first one to try.

    ``form="coupled"``: W = ½ μ (I₁ − 3) − μ ln J + ½ λ ln² J (Simo & Pister 1984; Bonet & Wood 2008, equation 6.28).
    ``form="isochoric"``: W = ½ μ (Ī₁ − 3) + ½ K (J − 1)², for the nearly incompressible.

    Attributes
    ----------
    young : float
        Initial Young's modulus E in Pa, positive.
    poisson : float
        Initial Poisson's ratio ν, in (-1, 0.5].
    density : float
        Reference density in kg/m³.
    form : str
        ``"coupled"`` or ``"isochoric"``.
    name, source : str
        Name of the material, and source of its constants.

    Raises
    ------
    UsageError
        For constants that no stable material has, or an unknown form.
    """

    young: float
    poisson: float
    density: float = 0.0
    form: Literal["coupled", "isochoric"] = "coupled"
    name: str = "neo-Hookean"
    source: str = ""

    law: ClassVar[str] = "neo-Hookean"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.form not in {"coupled", "isochoric"}:
            raise UsageError(
                f"A neo-Hookean law has no form {self.form!r}.",
                why="It is coupled (μ, λ and ln J) or isochoric (μ and Ī₁; K and J − 1).",
                fix='Pass form="coupled" or form="isochoric".',
            )

    @classmethod
    def from_shear(
        cls, shear: float, *, bulk: float | None = None, poisson: float | None = None, **rest: Any
    ) -> Self:
        """The law of a shear modulus μ in Pa, and a bulk modulus in Pa or a Poisson's ratio.

        Raises
        ------
        UsageError
            Unless exactly one of `bulk` and `poisson` is given, or for constants that no stable material has.
        """
        checks.positive("The shear modulus", shear, "Pa")
        if (bulk is None) == (poisson is None):
            raise UsageError(
                "A neo-Hookean law needs a bulk modulus or a Poisson's ratio, and not both.",
                why="The shear modulus alone leaves the compressibility open.",
                fix="Pass poisson=0.49, or bulk=1e6 in Pa.",
            )
        if bulk is not None:
            checks.positive("The bulk modulus", bulk, "Pa", infinite=True)
            return cls(young_modulus(shear, bulk), poisson_ratio(shear, bulk), **rest)
        assert poisson is not None
        require_moduli(shear, poisson, 0.0)
        return cls(2 * shear * (1 + poisson), poisson, **rest)

    @classmethod
    def from_c10(
        cls, c10: float, *, bulk: float | None = None, poisson: float | None = None, **rest: Any
    ) -> Self:
        """The law of C10 = μ/2 in Pa, as of `from_shear`.

        Raises
        ------
        UsageError
            As in `from_shear`.
        """
        checks.positive("C10", c10, "Pa")
        return cls.from_shear(2 * c10, bulk=bulk, poisson=poisson, **rest)

    @property
    def volumetric(self) -> Volumetric | None:
        """½ λ ln² J of the coupled form, if λ is positive; ½ K (J − 1)² of the isochoric one."""
        if self.form == "isochoric":
            return Volumetric(self.bulk_modulus, volume_change)
        lame = self._lame
        return Volumetric(lame, log_volume) if lame > 0 else None

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """The energy without the volumetric part, in J/m³."""
        mu = self.shear_modulus
        if self.form == "isochoric":
            return mu / 2 * (isochoric_first(F) - 3)
        volume = log_volume(F)
        shape = mu / 2 * (inner(F, F) - 3) - mu * volume
        if self.volumetric is not None:
            return shape
        return shape + 0.5 * self._lame * volume**2
