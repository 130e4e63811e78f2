"""Arrays that a script wrote: ``.npz`` of NumPy and ``.parquet`` tables.

An ``.npz`` holds an array for each quantity, cases first: (case,) numbers, (case, place) fields, (case, place, k)
vectors; ``points`` (place, 2 or 3) are the places and ``triangles`` (t, 3) their surface. A unit stands in the name:
``force [N]``, ``force (N)`` or ``force_N``.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from palpate.dataset.readers.results import Column, Places, Results, refuse
from palpate.errors import UsageError
from palpate.input_files import DAMAGE, open_input, plain_text
from palpate.sizes import require_npz
from palpate.supervised import read_in_child

__all__ = ["name_and_unit", "read_npz", "read_parquet"]

POINTS, TRIANGLES = "points", "triangles"
_BRACKETS = re.compile(r"^(?P<name>.*\S)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))$")
# behind an underscore only units that no other word is: v_m may be a mean
_TAILS = frozenset(
    {
        "mm",
        "cm",
        "um",
        "nm",
        "mN",
        "kN",
        "N",
        "Pa",
        "kPa",
        "MPa",
        "GPa",
        "J",
        "mJ",
        "Nm",
        "Nmm",
        "ms",
        "rad",
        "deg",
        "K",
    }
)


def name_and_unit(text: str) -> tuple[str, str | None]:
    """Return the name of a column and the unit that stands with it; None where there is none."""
    text = text.strip()
    if match := _BRACKETS.match(text):
        unit = (match["square"] if match["square"] is not None else match["round"]).strip()
        return match["name"], "" if unit in {"1", "-", ""} else unit
    head, _, tail = text.rpartition("_")
    return (head, tail) if head and tail in _TAILS else (text, None)


def read_npz(path: Path) -> Results:
    """Read the arrays of an ``.npz`` file; they must have equal numbers of cases or places, and no pickled objects."""
    arrays = _arrays(path)
    points, triangles = arrays.pop(POINTS, None), arrays.pop(TRIANGLES, None)
    notes: list[str] = []
    by_name: dict[str, np.ndarray] = {}
    for name, values in arrays.items():
        if values.dtype.kind not in "fiub" or not 1 <= values.ndim <= 3:
            notes.append(f"Skipped {name}: an array of type {values.dtype} and shape {values.shape}.")
        else:
            by_name[name] = values.astype(float)
    cases = len(next(iter(by_name.values()), ()))
    if not cases:
        raise refuse(
            path,
            None,
            "no array of numbers by case is in it.",
            why=f"It holds {', '.join(arrays) or 'nothing'}.",
        )
    count = None if points is None else len(points)
    columns = []
    for name, values in by_name.items():
        if len(values) != cases or (values.ndim > 1 and count not in {None, values.shape[1]}):
            raise refuse(
                path,
                None,
                f"{name!r} has the shape {values.shape}.",
                why=f"Other arrays have {cases} cases{'' if count is None else f' and {count} points'}.",
                fix="Save arrays (case,), (case, place) or (case, place, component), and points (place, 2 or 3).",
            )
        count = values.shape[1] if values.ndim > 1 else count
        columns += _columns_of(name, values)
    places = {} if count is None else {"nodes": _places(path, count, points, triangles)}
    return Results.of(path, "NumPy .npz", cases, columns, places, notes)


def _arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        with open_input(path) as file:
            require_npz(file)
            with np.load(file, allow_pickle=False) as archive:
                return {name: archive[name] for name in archive.files}
    except DAMAGE as error:
        raise refuse(
            path,
            None,
            "the arrays can't be read.",
            why=f"The file is damaged, cut short, or holds objects: {error}.",
            fix="Write it by numpy.savez with plain arrays.",
        ) from error


def _columns_of(name: str, values: np.ndarray) -> list[Column]:
    plain, unit = name_and_unit(plain_text(name))
    where = "nodes" if values.ndim > 1 else ""
    if values.ndim < 3:
        return [Column(plain, values, unit, places=where)]
    parts = "xyz" if values.shape[2] in {2, 3} else [str(i) for i in range(values.shape[2])]
    return [
        Column(f"{plain}.{part}", values[:, :, i], unit, places=where)
        for i, part in enumerate(parts[: values.shape[2]])
    ]


def _places(path: Path, count: int, points: np.ndarray | None, triangles: np.ndarray | None) -> Places:
    if points is None:
        return Places(np.arange(count))
    if points.ndim != 2 or points.shape[1] not in {2, 3} or points.dtype.kind not in "fiu":
        raise refuse(
            path, None, f"'points' has the shape {points.shape}.", fix="Save (place, 2) or (place, 3)."
        )
    coordinates = {
        axis: Column(axis, points[:, i].astype(float), None, "{length}")
        for i, axis in enumerate("xyz"[: points.shape[1]])
    }
    if triangles is not None and (
        triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.min() < 0 or triangles.max() >= count
    ):
        raise refuse(path, None, "'triangles' is no (t, 3) array of indices of points.")
    return Places(np.arange(count), coordinates, None if triangles is None else triangles.astype(np.int64))


def read_parquet(path: Path) -> Results:
    """Read the columns of numbers of a Parquet table; a unit may also stand in a field's metadata as ``unit``."""
    if importlib.util.find_spec("pyarrow") is None:
        raise UsageError(
            f"{path} can't be read without PyArrow.", fix="Install it: pip install 'palpate[parquet]'"
        )
    return read_in_child(_read_parquet, path)


def _read_parquet(path: Path) -> Results:
    import pyarrow
    from pyarrow import parquet

    try:
        table = parquet.read_table(path)
    except (pyarrow.ArrowException, *DAMAGE) as error:
        raise refuse(
            path, None, "the table can't be read.", why=f"It is damaged or cut short: {error}."
        ) from error
    columns, notes = [], []
    for entry, values in zip(table.schema, table.columns, strict=True):
        if not (pyarrow.types.is_floating(entry.type) or pyarrow.types.is_integer(entry.type)):
            notes.append(f"Skipped {entry.name}: a column of {entry.type}.")
            continue
        metadata: Mapping[bytes, bytes] = entry.metadata or {}
        name, unit = name_and_unit(plain_text(entry.name))
        unit = plain_text(metadata[b"unit"].decode(errors="replace")) if b"unit" in metadata else unit
        columns.append(Column(name, np.asarray(values.to_numpy(), dtype=float), unit))
    if not columns or not table.num_rows:
        raise refuse(path, None, "the table has no rows of numbers.")
    return Results.of(path, "Parquet", table.num_rows, columns, notes=notes)
