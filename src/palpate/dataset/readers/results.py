"""Results of another solver, as a reader hands them over: named columns with their units, by case and by place.

A *case* is one solution: a load step, a time, a row of a table of parameters. A *place* is a node, an element or an
integration point. Every reader returns the same value, and nothing in it is converted or guessed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.format import count

__all__ = ["TIME", "Column", "Places", "Results", "join_cases", "join_columns", "refuse"]

TIME = "time"
"""Name of the column with the time or the load factor of each case, where a format has one."""

SAME_PLACE = 1e-6  # distance over the body's size that is rounding of coordinates printed with six digits
SAME_TIME = 1e-5  # relative difference that is rounding of times printed with six digits


@dataclass(frozen=True, eq=False)
class Column:
    """One named quantity of all cases."""

    name: str  # name in the file; of a vector or tensor with its component, ``DISP.D1``
    values: np.ndarray  # values in the file's unit; not-a-number where the file has none
    unit: str | None = None  # unit that the file states, "" for a pure number, None where it states nothing
    # formula of the unit in a consistent system, such as ``"{force}/{length}**2"``; empty where it isn't
    # known
    measure: str = ""
    places: str = ""  # name of the places among `Results.places`; empty for one number a case


@dataclass(frozen=True, eq=False)
class Places:
    """Nodes, elements or integration points that columns belong to.

    Attributes
    ----------
    ids : (place,) array of int
        Number of each place in the file.
    coordinates : mapping of axis to Column
        Coordinates of the places, each (place,); empty where the file has none.
    triangles : (t, 3) array of int, optional
        Outer surface, as indices of places, counter-clockwise seen from outside.
    nodal : bool
        True for nodes, whose coordinates another file of the same model may have.
    cell_of : (t,) array of int, optional
        Of cells: for each triangle of the nodes' surface the cell that it belongs to.
    axis : bool
        True for points of an axis, such as times, along which a case has curves.
    """

    ids: np.ndarray
    coordinates: Mapping[str, Column] = field(default_factory=dict)
    triangles: np.ndarray | None = None
    nodal: bool = True
    cell_of: np.ndarray | None = None
    axis: bool = False

    def __len__(self) -> int:
        return len(self.ids)

    def points(self) -> np.ndarray:
        """Return the coordinates as they stand in the file, shape (place, axes)."""
        columns = [column.values for column in self.coordinates.values()]
        return np.stack(columns, axis=1) if columns else np.zeros((len(self), 0))


@dataclass(frozen=True, eq=False)
class Results:
    """Content of one file, or of several that were joined.

    Attributes
    ----------
    files : tuple of Path
        Files that it was read from.
    format : str
        Name of their format.
    cases : int
        Number of cases.
    columns : mapping of name to Column
        All quantities by name.
    places : mapping of name to Places
        Places that columns name.
    notes : tuple of str
        Sentences about what stands in the files and was skipped, with the reason.
    """

    files: tuple[Path, ...]
    format: str
    cases: int
    columns: Mapping[str, Column]
    places: Mapping[str, Places] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        path: Path,
        form: str,
        cases: int,
        columns: Iterable[Column],
        places: Mapping[str, Places] | None = None,
        notes: Sequence[str] = (),
    ) -> Results:
        """Make results of one file; two columns of one name are refused.

        Parameters
        ----------
        path : Path
            File that was read.
        form : str
            Name of its format.
        cases : int
            Number of cases.
        columns : iterable of Column
            Quantities in the file's order.
        places : mapping of name to Places, optional
            Places that columns name; none by default.
        notes : sequence of str
            Sentences about what was skipped.

        Raises
        ------
        FileFormatError
            If two columns have one name.
        """
        named: dict[str, Column] = {}
        for column in columns:
            if column.name in named:
                raise FileFormatError(
                    f"{path} has two columns called {column.name!r}.",
                    why="A column is chosen by its name.",
                    fix="Export the quantity once, or under different names.",
                )
            named[column.name] = column
        return cls((path,), form, cases, named, places or {}, tuple(notes))

    @property
    def source(self) -> str:
        """Names of the files, at most three of them."""
        names = [path.name for path in self.files]
        return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")

    def __str__(self) -> str:
        lines = [f"{self.source}: {self.format}, {count(self.cases, 'case')}"]
        for name, places in self.places.items():
            axes = ", ".join(places.coordinates) or "no coordinates"
            surface = "" if places.triangles is None else f", {count(len(places.triangles), 'triangle')}"
            lines.append(f"  {len(places):,} places called {name!r} ({axes}{surface})")
        for column in self.columns.values():
            unit = {None: "no unit stated", "": "a pure number"}.get(column.unit, column.unit)
            finite = column.values[np.isfinite(column.values)]
            spread = f"{finite.min():.4g} … {finite.max():.4g}" if finite.size else "no numbers"
            where = f", by {column.places}" if column.places else ""
            lines.append(f"  {column.name} [{unit}] {spread}{where}")
        return "\n".join([*lines, *(f"  {sentence}" for sentence in self.notes)])


def refuse(path: Path, line: int | None, what: str, *, why: str = "", fix: str = "") -> FileFormatError:
    """Return the error of a file that can't be read, with the number of its line where there is one."""
    place = f"{path}, line {line}" if line is not None else f"{path}"
    return FileFormatError(f"{place}: {what}", why=why, fix=fix or "Export the results again, and whole.")


def join_columns(parts: Sequence[Results]) -> Results:
    """Join files of the same cases: the columns of all, and only the cases that all have.

    Cases are matched by their times where every file has them, otherwise by their order.
    """
    if len(parts) == 1:
        return parts[0]
    parts, lost = _matched_cases(parts)
    columns: dict[str, Column] = {}
    places: dict[str, Places] = {}
    for part in parts:
        stem = part.files[0].suffix.lstrip(".")
        renamed = {
            name: name if name not in places else f"{name} of {part.files[0].name}" for name in part.places
        }
        places |= {renamed[name]: value for name, value in part.places.items()}
        for name, column in part.columns.items():
            if name in columns and np.array_equal(columns[name].values, column.values, equal_nan=True):
                continue
            if name == TIME and name in columns:
                continue
            own = f"{name} of {stem}" if name in columns else name
            columns[own] = replace(column, name=own, places=renamed.get(column.places, ""))
    return Results(
        tuple(file for part in parts for file in part.files),
        " and ".join(dict.fromkeys(part.format for part in parts)),
        parts[0].cases,
        columns,
        _with_coordinates(places),
        (*(sentence for part in parts for sentence in part.notes), *lost),
    )


def _matched_cases(parts: Sequence[Results]) -> tuple[list[Results], list[str]]:
    """Return the parts with the cases that all of them have, in the order of the first."""
    if all(TIME in part.columns for part in parts):
        times = [part.columns[TIME].values for part in parts]
        if len({len(t) for t in times}) == 1 and all(_close(times[0], t).all() for t in times):
            return list(parts), []
        common = [t for t in times[0] if all(_close(t, other).any() for other in times)]
        rows = [np.array([int(np.argmax(_close(t, other))) for t in common], dtype=int) for other in times]
        lost = sum(part.cases for part in parts) - len(parts) * len(common)
        if common:
            sentence = (
                f"Skipped {count(lost, 'case')} of {parts[0].source}: at times that not all files have."
            )
            return [_take(part, row) for part, row in zip(parts, rows, strict=True)], [sentence]
    elif len({part.cases for part in parts}) == 1:
        return list(parts), []
    numbers = ", ".join(f"{part.source}: {part.cases}" for part in parts)
    raise UsageError(
        "The files of one model have different cases.",
        why=f"Number of cases: {numbers}; they have no times in common by which to match them.",
        fix="Export all files of a model for the same solutions, or import them apart.",
    )


def _close(a: np.ndarray | float, b: np.ndarray | float) -> np.ndarray:
    return np.isclose(a, b, rtol=SAME_TIME, atol=0.0)


def _take(part: Results, rows: np.ndarray) -> Results:
    columns = {name: replace(c, values=c.values[rows]) for name, c in part.columns.items()}
    return replace(part, cases=len(rows), columns=columns)


def _with_coordinates(places: Mapping[str, Places]) -> dict[str, Places]:
    """Give nodes without coordinates those that other nodes of the same numbers have."""
    full = next((p for p in places.values() if p.nodal and p.coordinates), None)
    filled = dict(places)
    if full is None:
        return filled
    order = np.argsort(full.ids)
    for name, value in places.items():
        if not value.nodal or value.coordinates:
            continue
        at = order[np.clip(np.searchsorted(full.ids[order], value.ids), 0, len(order) - 1)]
        if np.array_equal(full.ids[at], value.ids):
            coordinates = {axis: replace(c, values=c.values[at]) for axis, c in full.coordinates.items()}
            filled[name] = replace(value, coordinates=coordinates)
    return filled


def join_cases(parts: Sequence[Results]) -> Results:
    """Put the cases of several files, all of one model, one after the other.

    Columns that not all files have are left out and named.
    """
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    names = [name for name in first.columns if all(name in part.columns for part in parts)]
    every = dict.fromkeys(name for part in parts for name in part.columns)
    missing = [name for name in every if name not in names]
    left_out = [
        f"Skipped {name}: not in all of the {len(parts)} files or groups of files." for name in missing
    ]
    used = {first.columns[name].places for name in names} - {""}
    for part in parts[1:]:
        for name in used & set(part.places):
            _require_same_places(first.places[name], part.places[name], first, part)
    columns = {}
    for name in names:
        same = [part.columns[name] for part in parts]
        units = {column.unit for column in same}
        if len(units) > 1 or len({column.values.shape[1:] for column in same}) > 1:
            raise UsageError(
                f"The column {name!r} differs from file to file.",
                why=f"Its units are {', '.join(sorted(map(str, units)))}, "
                f"its values {', '.join(sorted({str(c.values.shape[1:]) for c in same}))} per case.",
                fix="Export all files with the same settings.",
            )
        columns[name] = replace(same[0], values=np.concatenate([column.values for column in same]))
    notes = dict.fromkeys(sentence for part in parts for sentence in part.notes)
    return Results(
        tuple(file for part in parts for file in part.files),
        " and ".join(dict.fromkeys(part.format for part in parts)),
        sum(part.cases for part in parts),
        columns,
        {name: value for name, value in first.places.items() if name in used or value.nodal},
        (*notes, *left_out),
    )


def _require_same_places(first: Places, other: Places, ours: Results, theirs: Results) -> None:
    why = ""
    if not np.array_equal(first.ids, other.ids):
        why = f"They have {len(first)} and {len(other)} places, or other numbers of them."
    elif first.coordinates and other.coordinates:
        a, b = first.points(), other.points()
        if a.shape != b.shape or np.abs(a - b).max(initial=0.0) > SAME_PLACE * max(np.ptp(a), 1e-300):
            why = "Their coordinates differ: another mesh, or coordinates of the deformed body."
    if why:
        raise UsageError(
            f"{theirs.source} is of another mesh than {ours.source}.",
            why=why,
            fix="Import only results of one mesh together, with coordinates of the undeformed body.",
        )
