"""A lump: a ball inside a soft body whose modulus is another one than that of the tissue around it.

Its edge is soft: with d the distance from its centre over ρ, the share χ of the lump in the tissue falls from 1 at
1 − w/2 to 0 at 1 + w/2 by a quintic step, w = `WIDTH`. ∫ χ dV is 1 + 3 w²/28 times the volume of a ball of radius ρ, so
ρ is the lump's radius over `SWOLLEN`, the cube root of that. Moduli mix as Maxwell's law for a dilute suspension has it
(Maxwell 1873, A Treatise on Electricity and Magnetism, art. 314): the energy density of the tissue is multiplied by

    m = 1 + x χ / (1 + MIX x (1 − χ)),   x = ratio − 1.

Mixed by volume, m = 1 + x χ, the half-stiff edge would be nearly as stiff as the core, and the lump a quarter too
strong to the touch.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError

__all__ = ["EDGE", "MIX", "WIDTH", "Lump", "modulus_factor", "require_apart", "share_of_lump"]

WIDTH = 0.6  # of the soft edge, over the radius
MIX = 0.4  # 2/5: the field of a stiff sphere in an incompressible matrix (Eshelby 1957)
SWOLLEN = (1.0 + 3.0 * WIDTH**2 / 28.0) ** (1.0 / 3.0)  # radius of the sharp ball of equal volume, over ρ
EDGE = (1.0 + WIDTH / 2) / SWOLLEN  # where the edge ends, over the radius


@dataclass(frozen=True)
class Lump:
    """A ball of other stiffness inside a body.

    Attributes
    ----------
    place : (3,) tuple
        Its centre in the body's frame, m.
    radius : float
        Radius in m of the sharp ball of the same volume.
    ratio : float
        Its modulus over that of the tissue around it, a pure number: 1 is no lump, 10 a hard one.

    Raises
    ------
    UsageError
        If the place is no three numbers, or radius or ratio is not positive.
    """

    place: tuple[float, float, float]
    radius: float
    ratio: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "place", checks.triple("The place of a lump", self.place, "m"))
        checks.positive("The radius of a lump", self.radius, "m")
        checks.positive("The ratio of a lump's modulus to the tissue's", self.ratio, "")

    def __str__(self) -> str:
        x, y, z = (1e3 * v for v in self.place)
        return f"lump ⌀{2e3 * self.radius:.3g} mm at ({x:.4g}, {y:.4g}, {z:.4g}) mm, {self.ratio:g} times as stiff"


def _where_positive(value: Any, then: Any, otherwise: Any) -> Any:
    return np.where(value > 0, then, otherwise)


def share_of_lump(distance: Any, choose: Callable[[Any, Any, Any], Any] = _where_positive) -> Any:
    """Return the share χ of a lump in the tissue at distances from its centre over its radius.

    `choose(v, a, b)` is a where v is positive and b elsewhere; symbolic distances bring their own.
    """
    t = (SWOLLEN * distance - (1.0 - WIDTH / 2)) / WIDTH
    t = choose(t, choose(1.0 - t, t, 1.0), 0.0)
    return 1.0 - t**3 * (10.0 - 15.0 * t + 6.0 * t**2)


def modulus_factor(share: Any, ratio: Any) -> Any:
    """Return the factor m on the tissue's energy density where a lump has a share χ."""
    more = ratio - 1.0
    return 1.0 + more * share / (1.0 + MIX * more * (1.0 - share))


def require_apart(lumps: tuple[Lump, ...]) -> None:
    """Refuse lumps whose edges meet: what they add to a press is then no sum."""
    for i, one in enumerate(lumps):
        for other in lumps[:i]:
            gap = math.dist(one.place, other.place) - EDGE * (one.radius + other.radius)
            if gap < 0:
                raise UsageError(
                    f"Two lumps meet: {other} and {one}.",
                    why="The energies of lumps are added, which holds while they are apart.",
                    fix=f"Move one by {-1e3 * gap:.2g} mm, or make it smaller.",
                )
