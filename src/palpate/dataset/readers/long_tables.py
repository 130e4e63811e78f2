"""Tables with a row for each place of each case, turned into columns by case and place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.dataset.readers.mapping import ImportMapping
from palpate.dataset.readers.results import Column, Places, Results
from palpate.errors import UsageError
from palpate.format import count

__all__ = ["by_case_and_place"]


def by_case_and_place(results: Results, mapping: ImportMapping) -> Results:
    """Return results by case and place where the mapping's coordinates are columns with one number a row.

    Rows of equal inputs are one case; every case must have the same places.
    """
    axes = mapping.coordinates or ()
    nodal = any(places.coordinates for places in results.places.values())
    if nodal or not axes or not all(axis in results.columns for axis in axes):
        return results
    points = np.stack([results.columns[axis].values for axis in axes], axis=1)
    sources = [name for entry in mapping.inputs if isinstance(name := entry.columns, str)]
    keys = [results.columns[name].values for name in sources if name in results.columns]
    if len(keys) < len(sources):
        return results  # the import names the column that is missing
    inputs = np.stack(keys, axis=1)
    _, first, case = np.unique(inputs, axis=0, return_index=True, return_inverse=True)
    number = np.empty(len(first), dtype=int)
    number[np.argsort(first)] = np.arange(len(first))  # cases in the order of the file
    case = number[case.ravel()]
    rest, place = np.unique(points, axis=0, return_inverse=True)
    place = place.ravel()
    if len(points) != len(first) * len(rest) or len(
        set(zip(case.tolist(), place.tolist(), strict=True))
    ) != len(points):
        raise UsageError(
            f"{results.source} has {len(points)} rows for {count(len(first), 'case')} and {count(len(rest), 'place')}.",
            why="Every case needs one row for each place; coordinates must be those of the undeformed body.",
            fix="Correct `coordinates`, or the inputs by which the cases are told apart.",
        )
    # a component of a vector may be zero everywhere and is a field nevertheless
    alone = {entry.columns for entry in mapping.outputs if isinstance(entry.columns, str)}
    columns = {}
    for name, column in results.columns.items():
        if name in axes:
            continue
        values = np.full((len(first), len(rest)), np.nan)
        values[case, place] = column.values
        even = not np.nanmax(np.ptp(values, axis=1), initial=0.0) > 0
        constant = name in sources or (even and name in alone)
        columns[name] = (
            replace(column, values=values[:, 0])
            if constant
            else replace(column, values=values, places="nodes")
        )
    coordinates = {
        axis: Column(axis, rest[:, i], results.columns[axis].unit, "{length}") for i, axis in enumerate(axes)
    }
    places = Places(np.arange(1, len(rest) + 1), coordinates)
    return replace(results, cases=len(first), columns=columns, places={"nodes": places})
