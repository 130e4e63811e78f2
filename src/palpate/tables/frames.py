"""Tables of other libraries as arrays of float64, their columns matched by name; none of the libraries is imported.

A table is whatever has named columns: a data frame of pandas or Polars, a table of PyArrow, an array of NumPy records,
a mapping of columns. A missing value, however a library writes it, becomes not-a-number.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal
from numbers import Real
from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["column_names", "columns_in_order", "numbers_of"]

_MISSING = {"NoneType", "NAType", "NaTType"}  # None, pandas.NA, pandas.NaT
_DEFAULT = re.compile(r"[xy]\d+")  # names that a fit gives to the columns of a bare array


def column_names(given: Any) -> tuple[str, ...] | None:
    """Return the names of a table's columns, in order; None of what has none, such as an array."""
    if isinstance(given, np.ndarray):
        return None if given.dtype.names is None else tuple(given.dtype.names)
    if isinstance(given, Mapping):
        return tuple(map(str, given))
    for attribute in ("column_names", "columns"):  # of PyArrow; of pandas, Polars and most others
        names = getattr(given, attribute, None)
        if names is not None and not callable(names) and hasattr(names, "__len__"):
            return tuple(map(str, names))
    return None


def columns_in_order(what: str, given: Any, names: Sequence[str]) -> np.ndarray:
    """Return numbers for inputs of these names: a table's columns in their order, an array as it is.

    Parameters
    ----------
    what : str
        Name of the data in the plural, which begins a message.
    given : array-like or table
        Rows of numbers. The columns of a table may stand in any order; an array has no names to go by.
    names : sequence of str
        Names of the inputs. Where they are x0, x1, …, which say nothing, a table of other names is taken as it is.

    Raises
    ------
    UsageError
        If a column is missing, unknown or there twice; the message names it. Or if something is no real number.
    """
    own = column_names(given)
    if own is None or own == tuple(names):
        return numbers_of(what, given)
    missing, unknown = [n for n in names if n not in own], [n for n in own if n not in names]
    if missing and all(map(_DEFAULT.fullmatch, names)):
        return numbers_of(what, given)
    if missing or unknown or len(own) != len(names):
        raise _misfit(what, names, own, missing, unknown)
    return numbers_of(what, given)[:, [own.index(name) for name in names]]


def numbers_of(what: str, given: Any) -> np.ndarray:
    """Return an array of any shape, or a table (N, n), as float64; missing and masked values are not-a-number.

    Parameters
    ----------
    what : str
        Name of the data in the plural, which begins a message.
    given : array-like or table
        The numbers.

    Raises
    ------
    UsageError
        If it holds anything but real numbers, or rows of different length; of a table the message names column and row.
    """
    names = column_names(given)
    if names is not None:
        columns = [_column(f"Column {name!r} of {what.lower()}", part) for name, part in _parts(given, names)]
        if len({len(column) for column in columns}) > 1:
            raise _no_numbers(what, "columns of different length")
        return np.column_stack(columns) if columns else np.zeros((0, 0))
    if hasattr(given, "to_numpy"):  # one column
        return _column(what, given)
    if isinstance(given, np.ma.MaskedArray):  # what is masked is missing, whatever number stands there
        given = np.ma.filled(given.astype(np.float64), np.nan)
    try:
        found = np.asarray(given)
        if found.dtype.kind in "biuf":
            return np.asarray(found, dtype=np.float64)
        if found.dtype.kind == "O":
            return _from_objects(what, found)
    except (TypeError, ValueError):  # ragged lists
        raise _no_numbers(what, "an object that is no array of numbers") from None
    raise _no_numbers(what, f"an array of {found.dtype}")


def _parts(given: Any, names: Sequence[str]) -> list[tuple[str, Any]]:
    """Return name and values of each column."""
    if isinstance(given, np.ndarray):
        return [(name, given[name]) for name in names]
    if isinstance(given, Mapping):
        return [(str(name), values) for name, values in given.items()]
    by_position = getattr(getattr(given, "iloc", None), "__getitem__", None)  # pandas: names may be no texts
    if by_position is not None:
        return [(name, by_position((slice(None), i))) for i, name in enumerate(names)]
    return [(name, given[name]) for name in names]


def _column(what: str, values: Any) -> np.ndarray:
    """Return one column (N,) as float64."""
    kind = getattr(getattr(values, "dtype", None), "kind", "")
    if kind in {"i", "u", "f", "b"} and type(values).__module__.startswith("pandas."):
        return np.asarray(values.to_numpy(dtype=np.float64, na_value=np.nan))
    if hasattr(values, "to_numpy"):
        values = values.to_numpy()
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(np.float64), np.nan)
    found = np.asarray(values)
    if found.dtype.kind in "biuf":
        return np.asarray(found, dtype=np.float64)
    if found.dtype.kind == "O" or found.dtype.kind in "UST":
        return _from_objects(what, found.astype(object))
    raise _no_numbers(what, f"an array of {found.dtype}", one=True)


def _from_objects(what: str, found: np.ndarray) -> np.ndarray:
    """Return Python numbers as float64; the first that is none is named with its row."""
    numbers = np.empty(found.size)
    for i, value in enumerate(found.ravel()):
        if isinstance(value, Real | Decimal):
            numbers[i] = float(value)
        elif type(value).__name__ in _MISSING:
            numbers[i] = np.nan
        elif isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes):
            raise _no_numbers(what, "an object that is no array of numbers")
        else:
            row = i if found.ndim < 2 else int(np.unravel_index(i, found.shape)[0])
            raise UsageError(
                f"{what} hold{'s' * what.startswith('Column ')} {value!r:.60} in row {row}, which is no real number.",
                why="Samples are real numbers, in rows of equal length.",
                fix="Encode words, dates and complex numbers as columns of numbers first, or leave them out.",
            )
    return numbers.reshape(found.shape)


def _misfit(
    what: str, names: Sequence[str], own: Sequence[str], missing: list[str], unknown: list[str]
) -> UsageError:
    """Return the error of a table whose columns are not the inputs."""
    faults = [f"{name!r} is missing" for name in missing] + [f"{name!r} is unknown" for name in unknown]
    twice = sorted({name for name in own if own.count(name) > 1 and name in names})
    faults += [f"{name!r} is there twice" for name in twice]
    near = [(name, difflib.get_close_matches(name, unknown, n=1)) for name in missing]
    hints = [f"rename {match[0]!r} to {name!r}" for name, match in near if match]
    return UsageError(
        f"{what} are a table whose columns are not the inputs: {', '.join(faults[:6])}"
        f"{', …' if len(faults) > 6 else ''}.",
        why=f"The inputs are {', '.join(map(repr, names))}; columns are matched by name, in any order.",
        fix=(f"Perhaps {' and '.join(hints)}. " if hints else "")
        + f"Pass a table with these columns and no others, such as table[{list(names)!r:.200}].",
    )


def _no_numbers(what: str, found: str, *, one: bool = False) -> UsageError:
    return UsageError(
        f"{what} {'is' if one and what.startswith('Column ') else 'are'} {found}.",
        why="Samples are real numbers, in rows of equal length.",
        fix="Pass a float array; encode words, dates and complex numbers as columns of their own first.",
    )
