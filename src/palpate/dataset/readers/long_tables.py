"""Tables with a row for each place or time of each case, turned into columns by case and place, or into curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.dataset.readers.column_choice import find_columns
from palpate.dataset.readers.mapping import ImportMapping
from palpate.dataset.readers.results import Column, Places, Results
from palpate.errors import UsageError
from palpate.format import count

__all__ = ["by_case_and_axis", "by_case_and_place"]

_SAME = 1e-9  # of an axis' length: values that are one and the same


def by_case_and_axis(results: Results, mapping: ImportMapping) -> Results:
    """Return results whose rows of equal inputs are one case, with curves along the mapping's axis.

    Every case must have the same points of the axis. Without an axis in the mapping nothing changes.
    """
    if not mapping.axis:
        return results
    along = find_columns(results, mapping.axis)
    inputs = [find_columns(results, entry.columns) for entry in mapping.inputs]
    if len(along) != 1 or any(len(found) != 1 or found[0].places for found in (along, *inputs)):
        raise UsageError(
            f"The axis {mapping.axis!r} has no curves beside it.",
            why="Axis and inputs are columns with one number in each row.",
            fix="Name such a column, or leave `axis` out.",
        )
    keys = np.stack([found[0].values for found in inputs], axis=1)
    _, first, case = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    number = np.empty(len(first), dtype=int)
    number[np.argsort(first)] = np.arange(len(first))  # cases in the order of the file
    case = number[case.ravel()]
    order = np.lexsort((along[0].values, case))
    sizes = np.bincount(case, minlength=len(first))
    points = along[0].values[order]
    same = bool((sizes == sizes[0]).all())
    if same:
        table = points.reshape(len(first), -1)
        far = np.abs(table - table[0]).max(axis=1)
        same = bool((far <= _SAME * max(float(np.ptp(table[0])), 1e-300)).all())
    if not same:
        other = int(np.argmax(sizes != sizes[0])) if (sizes != sizes[0]).any() else int(far.argmax())
        raise UsageError(
            f"Case {other + 1} has other points of {mapping.axis!r} than the first.",
            why=f"It has {sizes[other]} of them, the first {sizes[0]}: curves are learnt point by point.",
            fix="Export all cases at the same points, or interpolate them to such.",
        )
    names = {found[0].name for found in inputs}
    columns = {}
    for name, column in results.columns.items():
        if column.places or column is along[0]:
            continue
        values = column.values[order].reshape(len(first), -1)
        columns[name] = (
            replace(column, values=values[:, 0])
            if name in names
            else replace(column, values=values, places="axis")
        )
    places = Places(
        np.arange(sizes[0]), {mapping.axis: replace(along[0], values=table[0])}, nodal=False, axis=True
    )
    return replace(results, cases=len(first), columns=columns, places={"axis": places})


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
