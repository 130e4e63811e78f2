"""Ogden's law of principal stretches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from palpate.errors import UsageError
from palpate.physics.materials.material import NO_STATE, Isochoric
from palpate.physics.materials.moduli import require_numbers
from palpate.physics.materials.stretches import stretch_sums
from palpate.physics.materials.tensors import Scalar, Tensor, determinant, exp, log, matmul, transpose

__all__ = ["Ogden"]


@dataclass(frozen=True)
class Ogden(Isochoric):
    """W = Σₚ μₚ/αₚ (λ̄₁^αₚ + λ̄₂^αₚ + λ̄₃^αₚ − 3) + ½ K (J − 1)² with λ̄ᵢ = J^(−1/3) λᵢ.

    Ogden 1972 (Proc. R. Soc. Lond. A 326, 565-584). Some programs write 2 μₚ/αₚ² in place of μₚ/αₚ: their μ is this
    law's μ α/2.

    Attributes
    ----------
    mu : float or tuple of float
        μₚ in Pa, one per term.
    alpha : float or tuple of float
        αₚ, pure numbers other than zero, one per term.
    bulk : float
        Bulk modulus K in Pa, positive; `with_poisson` gives it.
    density : float
        Reference density in kg/m³.
    name, source : str
        Name of the material, and source of its constants.

    Raises
    ------
    UsageError
        For constants that no stable material has: the initial shear modulus ½ Σ μₚ αₚ must be positive.
    """

    mu: float | Sequence[float]
    alpha: float | Sequence[float]
    bulk: float
    density: float = 0.0
    name: str = "Ogden"
    source: str = ""

    law: ClassVar[str] = "Ogden"

    def _require_constants(self) -> None:
        object.__setattr__(self, "mu", require_numbers(f"A constant μ of {self.name}", self.mu, "Pa"))
        object.__setattr__(self, "alpha", require_numbers(f"An exponent α of {self.name}", self.alpha))
        if len(self._mu) != len(self._alpha) or 0.0 in self._alpha:
            raise UsageError(
                f"{self.name} has the constants μ = {self.mu} and exponents α = {self.alpha}.",
                why="Each term has one μ in Pa and one α, a number other than zero.",
                fix="Pass two tuples of equal length, such as mu=(630.0, 1.2), alpha=(1.3, 5.0).",
            )

    @property
    def _mu(self) -> tuple[float, ...]:
        return tuple(self.mu)  # type: ignore[arg-type]  # made one in __post_init__

    @property
    def _alpha(self) -> tuple[float, ...]:
        return tuple(self.alpha)  # type: ignore[arg-type]  # made one in __post_init__

    @property
    def shear_modulus(self) -> float:
        """μ = ½ Σ μₚ αₚ in Pa."""
        return sum(m * a for m, a in zip(self._mu, self._alpha, strict=True)) / 2

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """The sum over the terms, in J/m³."""
        volume, sums = log(determinant(F)), stretch_sums(matmul(transpose(F), F), self._alpha)
        terms = zip(self._mu, self._alpha, sums, strict=True)
        return sum(m / a * (exp(-a / 3 * volume) * value - 3) for m, a, value in terms)
