"""Names of surfaces and regions, and names that stand for several surfaces at once."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from palpate.checks import did_you_mean
from palpate.errors import UsageError

__all__ = ["GROUPS", "INTERFACE", "UPRIGHT", "members", "plain_name", "require_known", "require_name"]

UPRIGHT = ("x_min", "x_max", "y_min", "y_max")  # the upright faces of a box, by where they are
GROUPS = {"side": UPRIGHT}
INTERFACE = "between regions"  # name of the faces that are no part of the outer surface


def members(name: str, surfaces: Iterable[str]) -> tuple[str, ...]:
    """Surfaces that a name stands for: itself, or the four upright faces of a box for ``"side"``; or none."""
    names = tuple(surfaces)
    if name in names:
        return (name,)
    group = GROUPS.get(name, ()) if isinstance(name, str) else ()
    return group if group and set(group) <= set(names) else ()


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
