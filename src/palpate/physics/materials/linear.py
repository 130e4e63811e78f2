"""Linear elastic materials and the presets of the founding case."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass

from palpate.errors import UsageError
from palpate.physics.arguments import require_number

__all__ = ["MATERIALS", "LinearElastic", "named_material"]


@dataclass(frozen=True)
class LinearElastic:
    """An isotropic linear elastic material.

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

    def __post_init__(self) -> None:
        require_number("Young's modulus", self.young, "Pa")
        require_number("Poisson's ratio", self.poisson)
        require_number("The density", self.density, "kg/m³")
        if not (math.isfinite(self.young) and self.young > 0):
            raise _unphysical("Young's modulus", self.young, "positive and finite, in Pa")
        if not -1 < self.poisson <= 0.5:
            raise _unphysical("Poisson's ratio", self.poisson, "above -1 and at most 0.5")
        if not (math.isfinite(self.density) and self.density >= 0):
            raise _unphysical("The density", self.density, "not negative, in kg/m³")

    @property
    def shear_modulus(self) -> float:
        """G = E/(2(1 + ν)) in Pa."""
        return self.young / (2 * (1 + self.poisson))


def _unphysical(what: str, value: float, rule: str) -> UsageError:
    return UsageError(
        f"{what} is {value}.",
        why=f"It must be {rule}: otherwise the strain energy has no minimum.",
        fix="Check the number and its unit.",
    )


_FOUNDING = "Narayanan, Singla, Garimella, Waz & Krovi 2011, ASME DSCC"

MATERIALS: dict[str, LinearElastic] = {
    material.name: material
    for material in (
        LinearElastic(110e9, 0.35, 8700.0, "copper", _FOUNDING),
        LinearElastic(2e9, 0.43, 1150.0, "nylon", _FOUNDING),
    )
}
"""Materials that can be asked for by name."""


def named_material(name: str) -> LinearElastic:
    """Look a material up by name.

    Raises
    ------
    UsageError
        If the name is not known; the message lists the names that are.
    """
    key = name.strip().lower()
    if key in MATERIALS:
        return MATERIALS[key]
    close = difflib.get_close_matches(key, MATERIALS, n=1)
    raise UsageError(
        f"There is no material called {name!r}.",
        why=f"Known materials: {', '.join(sorted(MATERIALS))}.",
        fix=f"Did you mean {close[0]!r}?"
        if close
        else "Or give its Young's modulus, Poisson's ratio and density.",
    )
