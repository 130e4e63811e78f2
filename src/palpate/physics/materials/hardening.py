"""Laws of hardening: the flow stress of a metal over its accumulated plastic strain.

A hardening law is a curve σ_y(α) over the accumulated (equivalent) plastic strain α ≥ 0. What a return mapping asks of
it is the plastic increment Δ ≥ 0 that brings the stress back to the curve,

    stiffness · Δ + σ_y(α + Δ) − σ_y(α) = excess,

where the excess is the trial stress less σ_y(α), and the stiffness is E in a fibre and 3G in a solid (Simo & Hughes
1998, Computational Inelasticity, ch. 1 and 3).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Protocol

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.tensors import exp, positive_part, where

__all__ = ["Hardening", "LinearHardening", "VoceHardening", "require_hardening"]


class Hardening(Protocol):
    """The methods of a hardening law; α is a number, an array or a coefficient function of NGSolve."""

    @property
    def yield_stress(self) -> float:
        """Flow stress of the virgin material in Pa."""

    def flow_stress(self, accumulated: Any) -> Any:
        """Return σ_y(α) in Pa."""

    def slope(self, accumulated: Any) -> Any:
        """Return dσ_y/dα in Pa."""

    def work(self, accumulated: Any) -> Any:
        """Return the plastic work ∫σ_y dα from 0 to α, in J/m³."""

    def increment(self, excess: Any, stiffness: float, accumulated: Any) -> Any:
        """Return the plastic increment Δ ≥ 0 of the return mapping; 0 where the excess is not positive."""

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON: the law's name and its constants in SI units."""


@dataclass(frozen=True)
class LinearHardening:
    """σ_y = σ_0 + h α.

    Attributes
    ----------
    yield_stress : float
        First flow stress σ_0 in Pa, positive.
    modulus : float
        Plastic modulus h in Pa, not negative; 0 is perfect plasticity.

    Raises
    ------
    UsageError
        For a material that softens or has no strength.
    """

    yield_stress: float
    modulus: float = 0.0

    def __post_init__(self) -> None:
        checks.positive("The yield stress", self.yield_stress, "Pa")
        checks.fits("The plastic modulus", self.modulus, "Pa", least=0)

    def flow_stress(self, accumulated: Any) -> Any:
        """Return σ_0 + h α, in Pa."""
        return self.yield_stress + self.modulus * accumulated

    def slope(self, accumulated: Any) -> Any:
        """Return h in Pa, in the shape of α."""
        return self.modulus + 0 * accumulated

    def work(self, accumulated: Any) -> Any:
        """Return σ_0 α + ½ h α², in J/m³."""
        return (self.yield_stress + 0.5 * self.modulus * accumulated) * accumulated

    def increment(self, excess: Any, stiffness: float, accumulated: Any) -> Any:
        """Return the excess over the sum of both moduli."""
        return positive_part(excess) / (stiffness + self.modulus)

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON: the law's name and its constants in SI units."""
        return {"law": "linear hardening", **dataclasses.asdict(self)}

    def __str__(self) -> str:
        linear = f"linear hardening of {self.modulus:.4g} Pa" if self.modulus else "no hardening"
        return f"yields at {self.yield_stress:.4g} Pa, {linear}"


@dataclass(frozen=True)
class VoceHardening:
    """σ_y = σ_0 + Q (1 − exp(−b α)) + h α (Voce 1955, Metallurgia 51, 219-226).

    Attributes
    ----------
    yield_stress : float
        First flow stress σ_0 in Pa, positive.
    saturation : float
        Saturation Q in Pa, not negative: the gain of the flow stress in the end.
    rate : float
        Rate b, a pure number, positive: α = 1/b brings 63 % of Q.
    modulus : float
        Linear part h in Pa, not negative.

    Raises
    ------
    UsageError
        For a material that softens or has no strength.
    """

    yield_stress: float
    saturation: float
    rate: float
    modulus: float = 0.0

    def __post_init__(self) -> None:
        checks.positive("The yield stress", self.yield_stress, "Pa")
        checks.fits("The saturation stress", self.saturation, "Pa", least=0)
        checks.positive("The saturation rate", self.rate, "")
        checks.fits("The plastic modulus", self.modulus, "Pa", least=0)

    def flow_stress(self, accumulated: Any) -> Any:
        """Return σ_0 + Q (1 − exp(−b α)) + h α, in Pa."""
        gained = self.saturation * (1 - exp(-self.rate * accumulated))
        return self.yield_stress + gained + self.modulus * accumulated

    def slope(self, accumulated: Any) -> Any:
        """Return Q b exp(−b α) + h, in Pa."""
        return self.saturation * self.rate * exp(-self.rate * accumulated) + self.modulus

    def work(self, accumulated: Any) -> Any:
        """Return (σ_0 + Q) α − Q (1 − exp(−b α))/b + ½ h α², in J/m³."""
        exponential = self.saturation / self.rate * (1 - exp(-self.rate * accumulated))
        linear = self.yield_stress + self.saturation + 0.5 * self.modulus * accumulated
        return linear * accumulated - exponential

    def increment(self, excess: Any, stiffness: float, accumulated: Any) -> Any:
        """Return the root of stiffness Δ + σ_y(α + Δ) − σ_y(α) = excess, by Newton iteration."""
        both = stiffness + self.modulus
        target = positive_part(excess) * self.rate / both
        share = self.saturation * self.rate / both * exp(-self.rate * accumulated)
        return _saturating_root(target, share, self.saturation * self.rate / both) / self.rate

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON: the law's name and its constants in SI units."""
        return {"law": "Voce hardening", **dataclasses.asdict(self)}

    def __str__(self) -> str:
        linear = f" and by {self.modulus:.4g} Pa per strain" if self.modulus else ""
        gain = f"hardens by {self.saturation:.4g} Pa (Voce, rate {self.rate:.4g}){linear}"
        return f"yields at {self.yield_stress:.4g} Pa, {gain}"


def require_hardening(thing: Any) -> None:
    """Refuse what is no law of hardening."""
    members = ("yield_stress", "flow_stress", "slope", "work", "increment", "describe")
    if isinstance(thing, type) or not all(hasattr(thing, name) for name in members):
        raise UsageError(
            f"The hardening of a plastic material is {thing!r}.",
            why="It is a law: a flow stress over the accumulated plastic strain.",
            fix="Pass LinearHardening(yield_stress=50e6), stresses in Pa, for perfect plasticity.",
        )


def _saturating_root(target: Any, share: Any, largest: float) -> Any:
    """Return x ≥ 0 with x + share (1 − exp(−x)) = target, for target ≥ 0 and 0 ≤ share ≤ largest.

    The left side is concave and rises, so Newton's method climbs to the root from any point below it and needs no
    safeguard. Two points below it are target/(1 + share), as 1 − exp(−x) ≤ x, and target − share. The number of steps
    is fixed by `largest`: an expression of finite elements can't stop when it has converged.
    """
    lower, upper = target / (1 + share), target - share
    x = where(upper - lower, upper, lower)
    for _ in range(_steps(largest)):
        remaining = share * exp(-x)
        x = (target - share + remaining * (1 + x)) / (1 + remaining)
    return x


def _steps(share: float) -> int:
    """Return the number of Newton steps to double precision: 3 for metals.

    Far below a large share's saturation each step gains about 1.
    """
    return 3 + int(math.log1p(10 * share))
