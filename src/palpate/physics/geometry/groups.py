"""Names that stand for several surfaces at once."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["GROUPS", "UPRIGHT", "members"]

UPRIGHT = ("x_min", "x_max", "y_min", "y_max")  # the upright faces of a box, by where they are
GROUPS = {"side": UPRIGHT}


def members(name: str, surfaces: Iterable[str]) -> tuple[str, ...]:
    """The surfaces that a name stands for: itself, or the four upright faces of a box for ``"side"``; or none."""
    known = tuple(surfaces)
    if name in known:
        return (name,)
    group = GROUPS.get(name, ()) if isinstance(name, str) else ()
    return group if group and set(group) <= set(known) else ()
