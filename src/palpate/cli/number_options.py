"""Options of the command line that are numbers: read by palpate's own grammar, and refused in its own sentences.

Typer by itself reads "1_0" as 10, takes nan and inf, and doesn't know a decimal comma.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import typer

from palpate.errors import UsageError
from palpate.number_text import whole_number

__all__ = ["count_option", "number_option"]


def number_option(
    name: str, unit: str = "", *, least: float | None = None, most: float | None = None, help: str
) -> Any:
    """Return the declaration of an option, such as "--seconds", that is a number, in its unit or with another.

    A number that stands alone is in the SI unit `unit`, "" for a pure number. `least` and `most` are the ends of the
    range that is allowed.
    """

    def read(text: str) -> float:
        from palpate.units import parse_quantity  # imports NumPy, which the help needs not

        return parse_quantity(text, unit, name, bare=True)

    return _option(name, read, "NUMBER", unit, (least, most), help)


def count_option(name: str, *, least: int | None = None, most: int | None = None, help: str) -> Any:
    """Return the declaration of an option that is a whole number; parameters are those of `number_option`."""

    def read(text: str) -> int:
        try:
            return whole_number(text)
        except UsageError as error:
            raise UsageError(f"{name}: {error.what}", why=error.why, fix=error.fix) from error

    return _option(name, read, "COUNT", "", (least, most), help)


def _option(
    name: str,
    read: Callable[[str], float],
    kind: str,
    unit: str,
    ends: tuple[float | None, float | None],
    help: str,
) -> Any:
    least, most = ends
    limits = [f"{sign} {end:g}" for sign, end in (("≥", least), ("≤", most)) if end is not None]

    def parse(text: Any) -> Any:
        value = read(text) if isinstance(text, str) else text  # older Typers hand over the default, too
        if value is None or ((least is None or value >= least) and (most is None or value <= most)):
            return value
        raise UsageError(
            f"{name}: {text} is out of range.", fix=f"Give {' and '.join(limits)} {unit}".rstrip() + "."
        )

    return typer.Option(
        name, parser=parse, metavar=f"{kind} ({', '.join(limits)})" if limits else kind, help=help
    )
