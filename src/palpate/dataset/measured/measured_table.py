"""Tables of measured indentation: a head with names and units, and a row for each measurement.

::

    # silicone block, probe of 10 mm                   lines that begin with # or % are skipped
    t, x, y, z, Fx, Fy, Fz                             or: t [s], x [mm], … or t (s), x (mm), …
    s, mm, mm, mm, N, N, N                             then without this row
    0.00, 50.0, 50.0, 59.5, 0.001, -0.002, 0.013

`palpate.tables` reads the file, so cells, numbers and heads may be written as there, and time, depth and force may have
the names that machines give them: Elapsed Time, Kraft. Further columns are left out and
named, rows with an empty cell are left out and counted. Units may also stand in a sidecar, ``NAME.json`` beside
``NAME.csv``:

    {"units": {"depth": "mm", "F": "gf"}, "place": [0.05, 0.05, 0.05], "direction": [0, 0, -1]}

with the place (m) at which depths were measured and the direction of pressing, by default down.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset.measured.measured_columns import NAMES, Columns, Measurements, UnitError
from palpate.errors import FileFormatError, UsageError
from palpate.files import write_file
from palpate.format import count
from palpate.input_files import plain_texts, read_input
from palpate.tables import Column, Table, named_quantity, read_table

__all__ = ["read_measurements", "write_measurements"]

_KEYS = {"units", "place", "direction"}
_MAKE = "Write a head such as `t [s], x [mm], y [mm], z [mm], Fz [N]` and a row of numbers for each touch."
_SHOWN = 5  # columns that a note names


def read_measurements(
    path: str | os.PathLike[str], *, missing: str = "leave-out", **options: Any
) -> Measurements:
    """Read a table of measured indentation.

    Parameters
    ----------
    path : path
        A text table or a workbook; units may stand in a JSON file of the same name beside it.
    missing : str
        "leave-out" leaves out rows in which a cell is empty or not a number, and counts them in the notes; "refuse"
        refuses the table.
    **options
        Of `palpate.tables.read_table`: how the table is written, and units.

    Returns
    -------
    Measurements
        The measurements; `notes` says what was left out.

    Raises
    ------
    FileFormatError
        If the file can't be read or is no such table; the message names file, line and column.
    UsageError
        If an option can't be.
    """
    path = Path(path)
    table = read_table(path, **options)
    side_path = path.with_suffix(".json")
    side = _sidecar(side_path)
    chosen, columns = _columns(table, side, side_path)
    values = np.column_stack(
        [scale * table.numbers(c.name) for c, scale in zip(chosen, columns.scales, strict=True)]
    )
    good, gaps = table.rows_without_gaps(values, columns.names, missing)
    notes = (*table.notes, *_further_columns(table, chosen), *gaps)
    rows = [dict(zip(columns.names, row, strict=True)) for row in values[good].tolist()]
    if not rows:
        raise FileFormatError(f"{path} holds a head and no measurement.", why=" ".join(notes), fix=_MAKE)
    where = {key: side[key] for key in ("place", "direction") if key in side}
    return replace(Measurements.of(rows, **where), notes=notes)


def write_measurements(path: str | os.PathLike[str], position: np.ndarray, force: np.ndarray) -> Path:
    """Write positions (N, 3) in m and forces (N, 3) in N, so that `read_measurements` gives them back bit for bit.

    Raises
    ------
    UsageError
        If the file can't be written.
    """
    rows = ["x,y,z,Fx,Fy,Fz", "m,m,m,N,N,N"]
    rows += [",".join(repr(float(v)) for v in row) for row in np.hstack([position, force])]
    return write_file(path, "\n".join(rows) + "\n")


def _columns(table: Table, side: Mapping[str, Any], side_path: Path) -> tuple[list[Column], Columns]:
    """Return the columns that hold measured quantities, and what they measure; an error names the line at fault."""
    beside = {name.strip().lower(): unit for name, unit in side.get("units", {}).items()}
    given = {n.strip().lower() for c in table.columns for n in (c.name, *c.aliases)}
    quantities = {table.column(name): name for name in NAMES if name in given}
    quantities |= _by_other_names(table, quantities)
    chosen = [column for column in table.columns if column in quantities]
    number = (chosen or table.columns)[0].line
    line = f"{table.path}, line {number}" if number else str(table.path)
    if beside and any(column.unit for column in chosen):
        raise FileFormatError(
            f"{line}: Units stand in the header and in the sidecar.",
            fix="Name them in one place, so that one is right.",
        )
    names = [quantities[column] for column in chosen]
    units = {name: column.unit or beside.get(name, "") for name, column in zip(names, chosen, strict=True)}
    unit_line = max((column.unit_line for column in chosen), default=0)
    units_place = str(side_path) if beside else f"{table.path}, line {unit_line}" if unit_line else line
    try:
        return chosen, Columns.of(names, units, placed="place" in side)
    except UsageError as error:
        others = [column.name for column in table.columns if column not in quantities]
        further = f" Columns of other names: {', '.join(others[:_SHOWN])}." if others else ""
        where = units_place if isinstance(error, UnitError) else line
        raise FileFormatError(f"{where}: {error.what}", why=error.why + further, fix=error.fix) from error


def _by_other_names(table: Table, chosen: Mapping[Column, str]) -> dict[Column, str]:
    """Return columns of time, and of depth and force, that have another name for it, where no other is meant."""
    wanted = {"time": "t"}
    if not {"x", "y", "z", "fx", "fy", "fz"} & set(chosen.values()):
        wanted |= {"depth": "depth", "force": "f"}
    found = {}
    for kind, name in wanted.items():
        columns = [c for c in table.columns if (q := named_quantity(c.name)) is not None and q.kind == kind]
        if len(columns) == 1 and name not in chosen.values():
            found[columns[0]] = name
    return found


def _further_columns(table: Table, chosen: list[Column]) -> list[str]:
    """Return a note on columns that measure something else."""
    others = [column.name for column in table.columns if column not in chosen]
    if not others:
        return []
    names = ", ".join(others[:_SHOWN]) + (", …" if len(others) > _SHOWN else "")
    return [f"{count(len(others), 'column')} left out: {names}."]


def _sidecar(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        side = plain_texts(json.loads(read_input(path)))
    except (ValueError, RecursionError) as error:
        raise FileFormatError(
            f"{path} is no JSON.", why=str(error), fix="Mend it or take it away."
        ) from error
    if fault := _fault_of_sidecar(side):
        raise FileFormatError(f"{path}: {fault}.", fix=_MAKE)
    return dict(side)


def _fault_of_sidecar(side: Any) -> str:
    if not isinstance(side, dict) or not side.keys() <= _KEYS:
        return f"it is no object with keys among {', '.join(sorted(_KEYS))}"
    units = side.get("units", {})
    if not isinstance(units, dict) or not all(isinstance(v, str) for v in units.values()):
        return "its units are no texts by column"
    if unknown := [name for name in units if name.strip().lower() not in NAMES]:
        return f"it has a unit for {unknown[0]!r}, which is no measured quantity"
    for key in ("place", "direction"):
        if key in side and not _is_vector(side[key]):
            return f"its {key} is not three finite numbers"
    if "direction" in side and not any(side["direction"]):
        return "its direction has no length"
    return ""


def _is_vector(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 3
        and all(type(v) in {int, float} and np.isfinite(v) for v in value)
    )
