"""The units that a sensor's numbers may come in: few, exact, and always named."""

from __future__ import annotations

from palpate.errors import UsageError

__all__ = ["FORCES", "LENGTHS", "TIMES", "UnitError", "in_si"]

GRAVITY = 9.80665  # m/s², standard (3rd CGPM 1901): what a gram-force is made of

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "gf": 1e-3 * GRAVITY, "kgf": GRAVITY}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}


class UnitError(UsageError):
    """A column's unit is missing or unknown: told apart because units may stand on a line of their own."""


def in_si(unit: str, kinds: dict[str, float], what: str) -> float:
    """How much of the SI unit one `unit` is.

    Raises
    ------
    UnitError
        If it is none of `kinds`.
    """
    if unit not in kinds:
        raise UnitError(
            f"{unit!r} is no unit of {what}.",
            why="Units are written as they are here, and never guessed.",
            fix=f"Use one of {', '.join(kinds)}.",
        )
    return kinds[unit]
