"""Units of columns: those that a file states, those that the mapping names, and all of them to SI."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from palpate.dataset.readers.results import Column
from palpate.errors import UsageError
from palpate.tables.unit_names import plain_unit
from palpate.unit_text import si_conversion

__all__ = ["SYSTEM", "unit_of", "values_in_si"]

SYSTEM = ("length", "force", "time")
"""Base quantities of a consistent system of units, for files that state none."""


def unit_of(column: Column, units: Mapping[str, str]) -> str | None:
    """Return the unit of a column; None where neither the file nor the mapping says it.

    The mapping's `units` by the name of a column go before the file's; the three of a consistent system, ``length``,
    ``force`` and ``time``, hold for what has no unit of its own.
    """
    if column.name in units:
        return units[column.name]
    if column.unit is not None:
        return column.unit
    base = {key: f"({units[key]})" for key in SYSTEM if key in units}
    if not column.measure or any(f"{{{key}}}" in column.measure and key not in base for key in SYSTEM):
        return None
    return column.measure.format(**base)


def values_in_si(
    column: Column, units: Mapping[str, str], wanted: str | None = None
) -> tuple[np.ndarray, str]:
    """Return the values of a column in SI units, and the unit; see `unit_of`.

    `wanted` is the SI unit that the quantity must have; any by default.
    """
    unit = unit_of(column, units)
    if unit is None:
        example = wanted or si_conversion(column.measure.format(length="m", force="N", time="s"))[2] or "mm"
        fix = f'Name it in the mapping: [units] "{column.name}" = "{example}"'
        parts = [key for key in SYSTEM if f"{{{key}}}" in column.measure]
        if parts:
            fix += f", or the units of the whole model: {', '.join(f'{key} = …' for key in parts)}"
        raise UsageError(
            f"The unit of {column.name!r} is stated nowhere.",
            why="A guessed one would be wrong in silence.",
            fix=f"{fix}.",
        )
    factor, offset, own = si_conversion(plain_unit(unit))
    if wanted is not None and own != wanted:
        raise UsageError(
            f"{column.name!r} is in {unit or 'pure numbers'}.",
            why=f"Here a quantity in {wanted or 'pure numbers'} is needed.",
            fix="Choose another column, or correct its unit in the mapping.",
        )
    return factor * column.values + offset, own
