"""Arguments of the wrong kind, refused with a word on what to pass."""

from __future__ import annotations

from numbers import Real
from typing import Any

from palpate.errors import UsageError

__all__ = ["require_number"]


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
