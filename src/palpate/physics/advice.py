"""Warnings: what is allowed, and yet hardly meant."""

from __future__ import annotations

import sys
import warnings
from typing import Any

__all__ = ["ModelWarning", "advise", "advise_on_modulus"]

# Pa: tissue by its number of kPa is mostly below, the softest gels that keep a shape are above
SOFTEST = 50.0


class ModelWarning(UserWarning):
    """A model that can be solved, but whose answer is probably not the one that is wanted.

    Told once, when a body or a problem is made, never by a solve. Those who mean it silence it with
    ``warnings.simplefilter("ignore", ModelWarning)``.
    """


def advise(what: str, *, why: str, fix: str) -> None:
    """Warn, at the line outside of palpate that led here: what is odd, what comes of it and what to do about it."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("palpate"):
        level, frame = level + 1, frame.f_back
    warnings.warn("\n".join((what, why, fix)), ModelWarning, stacklevel=level)


def advise_on_modulus(place: str, material: Any) -> None:
    """Warn of a Young's modulus below those of solids, which tells of kPa or MPa taken for Pa.

    `place` says where the material is, as the sentence goes on: "in the region 'fat'".
    """
    young = 2 * material.shear_modulus * (1 + material.poisson)
    if young < SOFTEST:
        advise(
            f"Young's modulus {place} is {young:.4g} Pa.",
            why="Fat and brain have some hundred Pa, the softest gels in use some ten; "
            "a number of kPa taken for Pa looks like this.",
            fix=f"Moduli are in Pa: pass {young:.4g}e3 for {young:.4g} kPa.",
        )
