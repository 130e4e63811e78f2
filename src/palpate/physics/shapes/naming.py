"""Names of surfaces and regions, and names that stand for several surfaces at once."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from palpate.checks import did_you_mean
from palpate.errors import UsageError

__all__ = [
    "GROUPS",
    "INTERFACE",
    "UPRIGHT",
    "joint_name",
    "members",
    "plain_name",
    "require_known",
    "require_name",
]

UPRIGHT = ("x_min", "x_max", "y_min", "y_max")  # the upright faces of a box, by where they are
GROUPS = {"side": UPRIGHT}
AND = " + "  # between surfaces that are named together; a name of one has no such sign
INTERFACE = "between regions"  # name of the faces that are no part of the outer surface


def members(name: str, surfaces: Iterable[str]) -> tuple[str, ...]:
    """Surfaces that a name stands for: itself, those of a joint name, a box's upright faces (``"side"``); or none."""
    names = tuple(surfaces)
    if isinstance(name, str) and AND in name:
        parts = [members(part, names) for part in name.split(AND)]
        return tuple(dict.fromkeys(sum(parts, ()))) if all(parts) else ()
    if name in names:
        return (name,)
    group = GROUPS.get(name, ()) if isinstance(name, str) else ()
    return group if group and set(group) <= set(names) else ()


def joint_name(*names: str | None) -> str:
    """Return the name that stands for several surfaces together; None is none of them."""
    return AND.join(name for name in names if name is not None)


def require_known(kind: str, name: str, known: Iterable[str]) -> None:
    """Refuse a name that the body does not have, and offer the nearest.

    `kind` is the word for what is named, for example ``"surface"``; of surfaces, names of groups are taken too.
    """
    names = tuple(known)
    if name in names or (kind == "surface" and members(name, names)):
        return
    groups = [group for group in GROUPS if kind == "surface" and members(group, names)]
    raise UsageError(
        f"There is no {kind} {name!r}.",
        why=f"The body's {kind}s are {', '.join(names)}.",
        fix=did_you_mean(name, [*names, *groups], shown=repr, cutoff=0.5) or f"Choose one of these {kind}s.",
    )


def require_name(what: str, name: Any) -> None:
    """Refuse a name that NGSolve would read as a pattern: with other signs than letters, digits, spaces, - and _."""
    if isinstance(name, str) and re.fullmatch(r"\w[\w \-]*", name):
        return
    raise UsageError(
        f"{what} is {name!r}.",
        why="A name is made of letters, digits, spaces, - and _; other signs have a meaning in patterns of names.",
        fix="Choose a plain name such as 'skin'.",
    )


def plain_name(name: str) -> str:
    """Return a name from a file with the signs that NGSolve reads as patterns replaced by ``_``."""
    plain = re.sub(r"[^\w \-]+", "_", name).strip(" -")
    return plain or "unnamed"
