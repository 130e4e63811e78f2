"""What a body's file tells of its memory: branches that relax, or a print that stays.

    relaxation = {"terms": [[share, time in s], …], "pad": energy in J, "spacing": m}
    yielding = {"dent": [√J, …], "reach": [√J, …], "stiffening": […], "width": m, "spacing": m}

stand in the ``meta`` of its energy; `TouchedBody.relaxing` and `TouchedBody.yielding` write them. The pad is 0 unless
given. With a spacing the memory stays at places of the surface that far apart; without, it travels with the probe.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.surrogates.plastic import Dents
from palpate.surrogates.relaxation import Branches

__all__ = ["branches_told", "dents_told", "spacing_told"]

T = TypeVar("T")


def branches_told(meta: Mapping[str, Any]) -> Branches | None:
    """What of the force relaxes; None where the record does not say so.

    Raises
    ------
    FileFormatError
        If it says so in other words than this module knows.
    """

    def made(told: Mapping[str, Any]) -> Branches:
        return Branches(tuple((float(s), float(t)) for s, t in told["terms"]), float(told.get("pad", 0.0)))

    fix = 'Its record holds relaxation = {"terms": [[share, seconds], …], "pad": joules}.'
    return _told(meta, "relaxation", "relaxes", made, fix)


def dents_told(meta: Mapping[str, Any], points: np.ndarray | None) -> Dents | None:
    """How the body yields, at places (n, 3), m, or wherever the probe is; None where the record does not say so.

    Raises
    ------
    FileFormatError
        If it says so in other words than this module knows.
    """

    def made(told: Mapping[str, Any]) -> Dents:
        dent, reach, stiffening = (np.array(told[k], dtype=float) for k in ("dent", "reach", "stiffening"))
        if points is None:
            return Dents.single(dent, reach, stiffening)
        return Dents(dent, reach, stiffening, points, float(told["width"]))

    return _told(
        meta, "yielding", "yields", made, "Its record holds yielding as `TouchedBody.yielding` writes it."
    )


def _told(meta: Mapping[str, Any], key: str, does: str, made: Callable[[Any], T], fix: str) -> T | None:
    if meta.get(key) is None:
        return None
    try:
        return made(meta[key])
    except (KeyError, TypeError, ValueError, AttributeError, UsageError) as error:
        raise FileFormatError(
            f"The file does not say how the body {does}.", why=f"{type(error).__name__}: {error}", fix=fix
        ) from error


def spacing_told(meta: Mapping[str, Any]) -> float | None:
    """How far apart the places of the memory are, m; None for one that travels with the probe."""
    for name in ("relaxation", "yielding"):
        if isinstance(told := meta.get(name), Mapping) and told.get("spacing") is not None:
            return float(told["spacing"])
    return None
