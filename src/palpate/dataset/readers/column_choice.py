"""Columns chosen by the mapping: found by name, reduced to what is asked, converted to SI units."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from palpate.dataset.readers.mapping import ImportMapping, Input, Output
from palpate.dataset.readers.result_units import values_in_si
from palpate.dataset.readers.results import Column, Places, Results
from palpate.errors import UsageError
from palpate.number_text import leading_number
from palpate.tables import plain_unit
from palpate.unit_text import si_conversion

__all__ = ["chosen_columns", "find_columns", "index_of_place", "places_in_metres"]

_PART = re.compile(r"^(?P<base>.*?)\.(?P<part>\w+)(?P<set> of .*)?$")
NEAR = 0.01  # distance over the body's size, beyond which a node is not the one that was meant

_REDUCE: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "max": lambda v: v.max(axis=1),
    "min": lambda v: v.min(axis=1),
    "mean": lambda v: v.mean(axis=1),
    "sum": lambda v: v.sum(axis=1),
}
_TENSOR = {"XX": 0, "YY": 1, "ZZ": 2, "XY": 3, "YZ": 4, "ZX": 5, "XZ": 5, "ZY": 4, "YX": 3}


def find_columns(results: Results, source: str | Sequence[str]) -> list[Column]:
    """Return the columns that a name means: one, or all components of a vector.

    A name fits exactly, or in another case of its letters, or without its set (`` of TOP``), where only one does.
    """
    if not isinstance(source, str):
        return [column for one in source for column in find_columns(results, one)]
    for fits in (_exactly, _as_vector, _without_case):
        found = fits(results, source)
        if found:
            return found
    near = difflib.get_close_matches(source, [*results.columns, *_vectors(results)], n=3, cutoff=0.4)
    raise UsageError(
        f"{results.source} has no column {source!r}.",
        why=f"Columns are {', '.join(list(results.columns)[:20])}{' …' if len(results.columns) > 20 else ''}.",
        fix=f"Did you mean {' or '.join(map(repr, near))}?" if near else "Choose one of these.",
    )


def _exactly(results: Results, source: str) -> list[Column]:
    return [results.columns[source]] if source in results.columns else []


def _vectors(results: Results) -> dict[str, list[Column]]:
    """Return the components of each vector or tensor by its name, with its set and without."""
    vectors: dict[str, list[Column]] = {}
    for column in results.columns.values():
        if match := _PART.match(column.name):
            vectors.setdefault(match["base"] + (match["set"] or ""), []).append(column)
    return vectors


def _as_vector(results: Results, source: str) -> list[Column]:
    vectors = _vectors(results)
    if source in vectors:
        return vectors[source]
    return _only_one(source, {name: v for name, v in vectors.items() if name.startswith(f"{source} of ")})


def _without_case(results: Results, source: str) -> list[Column]:
    low = source.lower()
    columns = results.columns.items()
    candidates = {
        name: [c] for name, c in columns if name.lower() == low or name.lower().startswith(f"{low} of ")
    }
    candidates |= {name: v for name, v in _vectors(results).items() if name.lower() == low}
    return _only_one(source, candidates)


def _only_one(source: str, candidates: dict[str, list[Column]]) -> list[Column]:
    if len(candidates) > 1:
        raise UsageError(
            f"{source!r} may be {' or '.join(map(repr, candidates))}.", fix="Write its full name."
        )
    return next(iter(candidates.values()), [])


def places_in_metres(results: Results, places: Places, mapping: ImportMapping) -> np.ndarray:
    """Return the coordinates of places in m, shape (place, axes), along all axes of the file."""
    own = [values_in_si(column, mapping.units, "m")[0] for column in places.coordinates.values()]
    return np.stack(own, axis=1) if own else np.zeros((len(places), 0))


def index_of_place(at: int | tuple[float, ...], ids: np.ndarray, points: np.ndarray, what: str) -> int:
    """Return the index of the place with a number, or nearest to a point.

    A place farther away than a hundredth of the body is refused.
    """
    if isinstance(at, int):
        found = np.flatnonzero(ids == at)
        if not found.size:
            raise UsageError(
                f"{what} names node {at}, which is not there.",
                why=f"Numbers go from {ids.min()} to {ids.max()}.",
            )
        return int(found[0])
    if len(at) != points.shape[1]:
        raise UsageError(
            f"{what} names a place with {len(at)} coordinates.",
            why=f"The body has {points.shape[1]}.",
            fix="Give as many coordinates, or the number of the node.",
        )
    distance = np.linalg.norm(points - np.array(at), axis=1)
    nearest = int(np.argmin(distance))
    if distance[nearest] > NEAR * max(float(np.ptp(points, axis=0).max()), 1e-300):
        there = ", ".join(f"{v:g}" for v in points[nearest])
        raise UsageError(
            f"{what} names a place where no node is.",
            why=f"The nearest node is at ({there}) m, {distance[nearest]:.3g} m away.",
            fix="Correct the place or its unit, or keep more nodes.",
        )
    return nearest


def chosen_columns(
    results: Results, entry: Input | Output, mapping: ImportMapping, wanted: str | None = None
) -> tuple[list[Column], str]:
    """Return the columns of an input or output of the mapping, reduced and in SI units, and their unit.

    `wanted` is the SI unit that the quantity must have; any by default.
    """
    columns = find_columns(results, entry.columns)
    own_units = mapping.units if entry.unit is None else mapping.units | {c.name: entry.unit for c in columns}
    factor, unit_of_factor = _factor(entry.times)
    converted, units = [], []
    for column in columns:
        if unit_of_factor:
            values, unit = column.values, unit_of_factor
        else:
            values, unit = values_in_si(column, own_units, wanted)
        converted.append(replace(column, values=values, unit=unit))
        units.append(unit)
    if len(set(units)) > 1:
        raise UsageError(
            f"The components of {entry.name!r} have different units: {', '.join(units)}.",
            fix="Choose components of one quantity, or correct their units.",
        )
    if isinstance(entry, Output) and entry.invariant is not None:
        converted = [_von_mises(entry, converted)]
    reduced = [_reduce(results, entry, column, mapping) for column in converted]
    return [replace(column, values=factor * column.values) for column in reduced], units[0]


def _factor(times: float | str) -> tuple[float, str]:
    """Return a factor, and its SI unit where it is a quantity."""
    if not isinstance(times, str):
        return float(times), ""
    number = leading_number(times)
    scale, offset, unit = si_conversion(plain_unit(number.rest))
    return float(number.value) * scale + offset, unit


def _reduce(results: Results, entry: Input | Output, column: Column, mapping: ImportMapping) -> Column:
    """Return a column at the place that is asked for, or reduced over all of them."""
    if not column.places or (entry.at is None and entry.reduce is None):
        return column
    if entry.at is not None:
        places = results.places[column.places]
        points = (
            places_in_metres(results, places, mapping) if not isinstance(entry.at, int) else np.zeros((0, 0))
        )
        index = index_of_place(entry.at, places.ids, points, f"The entry {entry.name!r}")
        return replace(column, values=column.values[:, index], places="")
    assert entry.reduce is not None
    return replace(column, values=_REDUCE[entry.reduce](column.values), places="")


def _von_mises(entry: Output, columns: list[Column]) -> Column:
    """Return the von Mises stress of the six components of a tensor, told apart by the ends of their names."""
    parts: dict[int, np.ndarray] = {}
    for column in columns:
        match = _PART.match(column.name)
        end = (match["part"] if match else column.name)[-2:].upper()
        if end in _TENSOR:
            parts[_TENSOR[end]] = column.values
    if len(parts) != 6 or len(columns) != 6:
        raise UsageError(
            f"{entry.name!r} needs the six components of a stress.",
            why=f"It comes from {', '.join(column.name for column in columns)}; names end in xx, yy, zz, xy, yz, xz.",
            fix='Name the tensor, such as from = "STRESS".',
        )
    xx, yy, zz, xy, yz, zx = (parts[i] for i in range(6))
    square = ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy**2 + yz**2 + zx**2)
    return replace(columns[0], name=entry.name, values=np.sqrt(square))
