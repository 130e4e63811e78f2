"""Names that stand for several surfaces at once.

Arguments that all shapes check alike.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable
from typing import Any

from palpate.errors import UsageError
from palpate.physics.arguments import require_number

__all__ = [
    "GROUPS",
    "LARGEST",
    "SMALLEST",
    "UPRIGHT",
    "members",
    "plain_name",
    "require_known",
    "require_name",
    "require_size",
    "require_triple",
]

UPRIGHT = ("x_min", "x_max", "y_min", "y_max")  # the upright faces of a box, by where they are
GROUPS = {"side": UPRIGHT}


def members(name: str, surfaces: Iterable[str]) -> tuple[str, ...]:
    """The surfaces that a name stands for: itself, or the four upright faces of a box for ``"side"``; or none."""
    known = tuple(surfaces)
    if name in known:
        return (name,)
    group = GROUPS.get(name, ()) if isinstance(name, str) else ()
    return group if group and set(group) <= set(known) else ()


LARGEST, SMALLEST = 10.0, 1e-3  # m, longest side of a body that a hand or a tool would press


def require_triple(what: str, value: Any, unit: str = "m") -> tuple[float, float, float]:
    """Three finite numbers in `unit` as a tuple of floats."""
    try:
        x, y, z = value
    except (TypeError, ValueError):
        raise UsageError(
            f"{what} is {value!r}.",
            why="It needs three numbers, along x, y and z.",
            fix=f"Pass (x, y, z) in {unit}.",
        ) from None
    for number in (x, y, z):
        require_number(what, number, unit)
        if not math.isfinite(number):
            raise UsageError(
                f"{what} is {value!r}.",
                why="It must be finite.",
                fix=f"Pass finite numbers in {unit}, as (x, y, z).",
            )
    return float(x), float(y), float(z)


def require_size(what: str, longest: float, unit: str = "") -> None:
    """Refuse a body whose longest side in m tells of mistaken units.

    Parameters
    ----------
    what : str
        The body.
    longest : float
        Its longest side in m.
    unit : str
        The unit in which its lengths were read from a file; empty where they are given in m by the user.
    """
    if SMALLEST <= longest <= LARGEST:
        return
    taken = f"Its lengths were taken as {unit}" if unit else "Lengths are in m"
    guess = "mm" if longest > LARGEST else "m"
    advice = f'Pass unit="{guess}" if the file is in {guess}' if unit else "Pass 0.1 for 100 mm"
    raise UsageError(
        f"{what} would be {longest:.4g} m long.",
        why=f"{taken}, and a body to be touched measures between {SMALLEST:g} and {LARGEST:g} m.",
        fix=f"{advice}.",
    )


def require_known(kind: str, name: str, known: Iterable[str]) -> None:
    """Refuse a name that is not among the known ones, and offer the nearest.

    Parameters
    ----------
    kind : str
        For example ``"surface"``.
    """
    names = tuple(known)
    if name in names or (kind == "surface" and members(name, names)):
        return
    groups = [group for group in GROUPS if kind == "surface" and members(group, names)]
    near = difflib.get_close_matches(str(name), [*names, *groups], n=1, cutoff=0.5)
    raise UsageError(
        f"There is no {kind} {name!r}.",
        why=f"The body's {kind}s are {', '.join(names)}.",
        fix=f"Did you mean {near[0]!r}?" if near else f"Choose one of these {kind}s.",
    )


def require_name(what: str, name: Any) -> None:
    """Refuse a name that NGSolve would read as a pattern."""
    if isinstance(name, str) and re.fullmatch(r"\w[\w \-]*", name):
        return
    raise UsageError(
        f"{what} is {name!r}.",
        why="A name is made of letters, digits, spaces, - and _; other signs have a meaning in patterns of names.",
        fix="Choose a plain name such as 'skin'.",
    )


def plain_name(name: str) -> str:
    """A name from a file with the signs that NGSolve reads as patterns replaced by ``_``."""
    plain = re.sub(r"[^\w \-]+", "_", name).strip(" -")
    return plain or "unnamed"
