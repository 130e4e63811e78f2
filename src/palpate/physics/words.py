"""Numbers in words, for whoever prints a body or an answer."""

from __future__ import annotations

__all__ = ["millimetres", "number", "span"]


def number(value: float, digits: int = 4) -> str:
    """A number of a few digits; zero has no sign, and neither has what rounds to it."""
    return f"{value + 0.0:.{digits}g}"


def millimetres(*lengths: float) -> str:
    """Lengths given in m, in mm: ``100 × 100 × 50 mm``."""
    return " × ".join(number(1e3 * length) for length in lengths) + " mm"


def span(ends: float | tuple[float, float], unit: str) -> str:
    """A fixed value or a range: ``0 … 5 N``."""
    if isinstance(ends, tuple):
        return " … ".join(map(number, ends)) + f" {unit}"
    return f"{number(ends)} {unit}"
