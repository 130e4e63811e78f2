"""Which sphere pressed a solution, and which surfaces held it."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["Ball", "ball_of", "fixed_of"]

Ball = tuple[np.ndarray, float]  # centre (3,) and radius, m


def ball_of(solution: Any, probe: Any) -> Ball | None:
    """The probe's sphere: of the solution for True, (centre, radius) as given, None for False or without one."""
    if probe is False or probe is None:
        return None
    if probe is not True:
        try:
            centre, radius = probe
            return np.asarray(centre, dtype=float).reshape(3), float(radius)
        except (TypeError, ValueError) as error:
            raise UsageError(
                f"{probe!r} is no probe to draw.", fix="Give True, False or ((x, y, z), radius) in m."
            ) from error
    own, centre = getattr(solution, "probe", None), getattr(solution, "centre", None)
    if own is None or centre is None or not hasattr(own, "radius"):
        return None
    return np.asarray(centre, dtype=float), float(own.radius)


def fixed_of(solution: Any) -> tuple[str, ...]:
    """Names of the fixed surfaces, as far as the solution knows them."""
    fixed = getattr(solution, "fixed", ())
    names = (fixed,) if isinstance(fixed, str) else tuple(fixed)
    return tuple(name for name in names if name in solution.mesh.surfaces)
