"""Isotropic moduli from one another, and checks on constants."""

from __future__ import annotations

import math
from collections.abc import Sequence

from palpate import checks
from palpate.errors import UsageError

__all__ = [
    "bulk_from_poisson",
    "bulk_from_young",
    "lame_modulus",
    "poisson_ratio",
    "require_density",
    "require_moduli",
    "require_numbers",
    "require_poisson",
    "shear_from_young",
    "unphysical",
    "young_modulus",
]


def shear_from_young(young: float, poisson: float) -> float:
    """μ = E/(2(1 + ν))."""
    return young / (2 * (1 + poisson))


def bulk_from_young(young: float, poisson: float) -> float:
    """K = E/(3(1 − 2ν)), infinite at ν = 0.5."""
    return math.inf if poisson == 0.5 else young / (3 * (1 - 2 * poisson))


def lame_modulus(young: float, poisson: float) -> float:
    """Lamé's λ = Eν/((1 + ν)(1 − 2ν)), infinite at ν = 0.5."""
    return math.inf if poisson == 0.5 else young * poisson / ((1 + poisson) * (1 - 2 * poisson))


def bulk_from_poisson(shear: float, poisson: float) -> float:
    """K = 2μ(1 + ν)/(3(1 − 2ν)), infinite at ν = 0.5."""
    return math.inf if poisson == 0.5 else 2 * shear * (1 + poisson) / (3 * (1 - 2 * poisson))


def young_modulus(shear: float, bulk: float) -> float:
    """E = 9Kμ/(3K + μ)."""
    return 3 * shear if math.isinf(bulk) else 9 * bulk * shear / (3 * bulk + shear)


def poisson_ratio(shear: float, bulk: float) -> float:
    """ν = (3K − 2μ)/(2(3K + μ))."""
    return 0.5 if math.isinf(bulk) else (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear))


def require_moduli(young: float, poisson: float, density: float) -> None:
    """Refuse moduli and a density that no stable material has: unless E > 0, −1 < ν ≤ 0.5 and ρ ≥ 0, all finite."""
    checks.positive("Young's modulus", young, "Pa")
    require_poisson(poisson)
    require_density(density)


def require_poisson(poisson: float) -> None:
    """Refuse a Poisson's ratio that no stable material has: unless −1 < ν ≤ 0.5."""
    checks.finite("Poisson's ratio", poisson)
    if not -1 < poisson <= 0.5:
        raise unphysical("Poisson's ratio", poisson, "above -1 and at most 0.5")


def require_density(density: float) -> None:
    """Refuse a density that is negative or no number."""
    checks.fits("The density", density, "kg/m³", least=0)


def require_numbers(what: str, values: float | Sequence[float], unit: str = "") -> tuple[float, ...]:
    """Return a tuple of finite numbers of a number or a sequence of numbers that is not empty."""
    numbers = tuple(values) if isinstance(values, Sequence) else (values,)
    if not numbers:
        raise UsageError(
            f"{what} has no term.", why="A law needs at least one.", fix="Give one number per term."
        )
    return tuple(checks.finite(what, value, unit) for value in numbers)


def unphysical(what: str, value: object, rule: str) -> UsageError:
    """The error for a constant that no stable material has."""
    return UsageError(
        f"{what} is {value}.",
        why=f"It must be {rule}: otherwise the strain energy has no minimum.",
        fix="Check the number and its unit.",
    )
