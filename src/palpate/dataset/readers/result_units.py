"""Units of columns: those that a file states, those that the mapping names, and all of them to SI."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate.dataset.readers.results import Column
from palpate.errors import UsageError
from palpate.tables.unit_names import plain_unit
from palpate.units import registry

__all__ = ["SYSTEM", "to_si_units", "unit_of", "values_in_si"]

SYSTEM = ("length", "force", "time")
"""Base quantities of a consistent system of units, for files that state none."""

# units in which palpate states quantities, by what they measure; the first that fits is taken
_SI = (
    "m",
    "m/s",
    "m/s²",
    "N",
    "N/m",
    "Pa",
    "J",
    "s",
    "Hz",
    "kg",
    "kg/m³",
    "m²",
    "m³",
    "K",
    "rad",
    "rad/s",
    "W",
    "V",
    "A",
)
_ANGLE = re.compile(r"\b(rad|radian|deg|degree|rpm|rev|turn)", re.IGNORECASE)
_SIGNS = str.maketrans({"µ": "u", "μ": "u", "·": "*", "⋅": "*", "²": "**2", "³": "**3", "°": "deg"})


def unit_of(column: Column, units: Mapping[str, str]) -> str | None:
    """Return the unit of a column; None where neither the file nor the mapping says it.

    Parameters
    ----------
    column : Column
        Its name, the unit in the file and the formula of its unit in a consistent system.
    units : mapping
        Units by the name of a column, which go before the file's; and the three of a consistent system, ``length``,
        ``force`` and ``time``, which hold for what has no unit of its own.
    """
    if column.name in units:
        return units[column.name]
    if column.unit is not None:
        return column.unit
    base = {key: f"({units[key]})" for key in SYSTEM if key in units}
    if not column.measure or any(f"{{{key}}}" in column.measure and key not in base for key in SYSTEM):
        return None
    return column.measure.format(**base)


@functools.cache
def to_si_units(unit: str) -> tuple[float, float, str]:
    """Return factor, offset and SI unit: a value v in `unit` is factor · v + offset in the SI unit.

    Raises
    ------
    UsageError
        If there is no such unit.
    """
    if unit.strip() in {"", "1"}:
        return 1.0, 0.0, ""
    import pint

    text = re.sub(r"\brev\b", "turn", plain_unit(unit).replace("^", "**").replace("%", "percent"))
    text = text.translate(_SIGNS)
    try:
        zero, one = (registry().Quantity(value, text).to_base_units() for value in (0.0, 1.0))
    except (
        pint.errors.PintError,
        ValueError,
        TypeError,
        AttributeError,
        AssertionError,
        SyntaxError,
    ) as error:
        raise UsageError(
            f"{unit!r} is no unit that is known.",
            why=f"{error}.",
            fix='Name the unit in the mapping, such as "mm", "N", "N/mm^2" or "1" for a pure number.',
        ) from error
    factor, offset = float(one.magnitude - zero.magnitude), float(zero.magnitude)
    angular = bool(_ANGLE.search(text))
    names = [n for n in _SI if ("rad" in n) == angular and _unit(n).dimensionality == one.dimensionality]
    if names:
        return factor, offset, names[0]
    if one.dimensionless:
        return factor, offset, ""
    return factor, offset, unit if (factor, offset) == (1.0, 0.0) else f"{one.units:~C}".replace("**", "^")


def _unit(name: str) -> Any:
    return registry().Unit(name.translate(_SIGNS))


def values_in_si(
    column: Column, units: Mapping[str, str], wanted: str | None = None
) -> tuple[np.ndarray, str]:
    """Return the values of a column in SI units, and the unit.

    Parameters
    ----------
    column : Column
        Values as they stand in the file.
    units : mapping
        Units of the mapping, see `unit_of`.
    wanted : str, optional
        SI unit that the quantity must have; any by default.

    Raises
    ------
    UsageError
        If no unit is stated, it is unknown, or of another quantity than `wanted`.
    """
    unit = unit_of(column, units)
    if unit is None:
        example = wanted or to_si_units(column.measure.format(length="m", force="N", time="s"))[2] or "mm"
        fix = f'Name it in the mapping: [units] "{column.name}" = "{example}"'
        parts = [key for key in SYSTEM if f"{{{key}}}" in column.measure]
        if parts:
            fix += f", or the units of the whole model: {', '.join(f'{key} = …' for key in parts)}"
        raise UsageError(
            f"The unit of {column.name!r} is stated nowhere.",
            why="A guessed one would be wrong in silence.",
            fix=f"{fix}.",
        )
    factor, offset, own = to_si_units(unit)
    if wanted is not None and own != wanted:
        raise UsageError(
            f"{column.name!r} is in {unit or 'pure numbers'}.",
            why=f"Here a quantity in {wanted or 'pure numbers'} is needed.",
            fix="Choose another column, or correct its unit in the mapping.",
        )
    return factor * column.values + offset, own
