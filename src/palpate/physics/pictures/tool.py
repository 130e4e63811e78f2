"""Which sphere pressed a solution, and which surfaces held it."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["Ball", "ball_of", "fixed_of", "require_state"]

Ball = tuple[np.ndarray, float]  # centre (3,) and radius, m


def ball_of(solution: Any, probe: Any) -> Ball | None:
    """The sphere to draw.

    Parameters
    ----------
    solution : SolidSolution
    probe : bool, SphereProbe or ((x, y, z), radius)
        True for the solution's own probe, if it has one. A probe stands at the solution's centre.

    Raises
    ------
    UsageError
        If it is none of these.
    """
    if probe is False or probe is None:
        return None
    own = getattr(solution, "probe", None) if probe is True else probe
    if isinstance(own, tuple | list):
        return _given(own)
    radius = getattr(own, "radius", None)
    centre = getattr(solution, "centre", None)
    if probe is not True and radius is None:
        raise _no_probe(probe)
    if radius is None or centre is None or np.shape(centre) != (3,):
        return None
    return np.asarray(centre, dtype=float), float(radius)


def _given(probe: Any) -> Ball:
    try:
        centre, radius = probe
        return np.asarray(centre, dtype=float).reshape(3), float(radius)
    except (TypeError, ValueError) as error:
        raise _no_probe(probe) from error


def _no_probe(probe: Any) -> UsageError:
    return UsageError(
        f"{probe!r} is no probe to draw.", fix="Give True, False, a SphereProbe or ((x, y, z), radius) in m."
    )


def fixed_of(solution: Any) -> tuple[str, ...]:
    """Names of the fixed surfaces, as far as the solution knows them."""
    fixed = getattr(solution, "fixed", ())
    names = (fixed,) if isinstance(fixed, str) else tuple(fixed)
    return tuple(name for name in names if name in solution.mesh.surfaces)


def require_state(solution: Any) -> None:
    """Refuse a solution without a deformed state.

    Raises
    ------
    UsageError
        With the solution's own reason.
    """
    if not np.all(np.isfinite(solution.displacement)):
        raise UsageError(
            "This solution has no deformed state.",
            why=str(getattr(solution, "message", "")) or "Its displacements are not finite numbers.",
            fix="Look at `message`, and press less far.",
        )
