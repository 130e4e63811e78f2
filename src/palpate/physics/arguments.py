"""Arguments of the wrong kind, refused with a word on what to pass."""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

from palpate.errors import UsageError

__all__ = ["require_choice", "require_number", "require_positive"]


def require_number(what: str, value: Any, unit: str = "") -> None:
    """Refuse what is no real number.

    Raises
    ------
    UsageError
        For text such as ``"5 N"``, None or anything else; the message names `what` and its `unit`.
    """
    if isinstance(value, Real):
        return
    raise UsageError(
        f"{what} is {value!r}, of type {type(value).__name__}.",
        why=f"In Python it is a number{f' in {unit}' if unit else ''}; units in words are for study files.",
        fix="Pass numbers in SI units, for example 0.3 for 300 mm, 5 for 5 N or 70e9 for 70 GPa.",
    )


def require_positive(what: str, value: Any, unit: str, *, infinite: bool = False) -> None:
    """Refuse what is no positive number.

    Parameters
    ----------
    what : str
        Name of the quantity, which begins the message.
    unit : str
        SI unit; empty for a pure number.
    infinite : bool
        Whether infinity is taken.

    Raises
    ------
    UsageError
        Unless it is positive and, if `infinite` is false, finite.
    """
    require_number(what, value, unit)
    if value > 0 and (infinite or math.isfinite(value)):
        return
    raise UsageError(
        f"{what} is {value:g} {unit}".rstrip() + ".",
        why=f"It must be positive{'' if infinite else ' and finite'}.",
        fix=f"Pass a positive number{f' in {unit}' if unit else ''}.",
    )


def require_choice(what: str, value: Any, choices: Sequence[str]) -> None:
    """Refuse what is not among a few words, and offer the nearest.

    Raises
    ------
    UsageError
        If it is not.
    """
    if isinstance(value, str) and value in choices:
        return
    near = difflib.get_close_matches(str(value).lower(), choices, n=1, cutoff=0.5)
    raise UsageError(
        f"{what} is {value!r}.",
        why=f"It is one of {', '.join(map(repr, choices))}.",
        fix=f"Did you mean {near[0]!r}?" if near else "Choose one of these.",
    )
