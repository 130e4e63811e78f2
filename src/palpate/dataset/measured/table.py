"""Text tables of measured indentation: one header, units, and a row for each measurement.

::

    # silicone block, probe of 10 mm                   lines that begin with # are skipped
    t, x, y, z, Fx, Fy, Fz                             or: t [s], x [mm], …
    s, mm, mm, mm, N, N, N                             then without this row
    0.00, 50.0, 50.0, 59.5, 0.001, -0.002, 0.013

Cells are separated by commas, semicolons or tabs. Units may also stand in a sidecar, ``NAME.json`` beside ``NAME.csv``:

    {"units": {"depth": "mm", "F": "gf"}, "place": [0.05, 0.05, 0.05], "direction": [0, 0, -1]}

with the place (m) at which depths were measured and the direction of pressing, by default down.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset.measured.measured_columns import NAMES, Columns, Measured, UnitError, number
from palpate.errors import FileFormatError, UsageError
from palpate.files import write_file

__all__ = ["read_measured", "write_measured"]

_HEAD = re.compile(r"^\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?\s*$")
_KEYS = {"units", "place", "direction"}
_MAKE = "Write a header such as `t [s], x [mm], y [mm], z [mm], Fz [N]` and a row of numbers for each touch."


def read_measured(path: str | os.PathLike[str]) -> Measured:
    """Read a table of measured indentation.

    Parameters
    ----------
    path : path
        A text table; units may stand in a JSON file of the same name beside it.

    Raises
    ------
    FileFormatError
        If the file can't be read or is no such table; the message names file, line and column.
    """
    path = Path(path)
    side_path = path.with_suffix(".json")
    lines, side = _lines(path), _sidecar(side_path)
    if not lines:
        raise FileFormatError(f"{path} holds no table.", why="It has no header.", fix=_MAKE)
    separator = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    columns, used = _columns(path, side_path, lines, separator, side)
    rows = []
    for number_of_line, line in lines[used:]:
        with _named_place(f"{path}, line {number_of_line}"):
            rows.append(columns.values(line.split(separator)))
    if not rows:
        raise FileFormatError(f"{path} holds a header and no measurement.", fix=_MAKE)
    return Measured.of(rows, **{key: side[key] for key in ("place", "direction") if key in side})


def write_measured(path: str | os.PathLike[str], position: np.ndarray, force: np.ndarray) -> Path:
    """Write positions (N, 3) in m and forces (N, 3) in N, so that `read_measured` gives them back bit for bit.

    Raises
    ------
    UsageError
        If the file can't be written.
    """
    rows = ["x,y,z,Fx,Fy,Fz", "m,m,m,N,N,N"]
    rows += [",".join(repr(float(v)) for v in row) for row in np.hstack([position, force])]
    return write_file(path, "\n".join(rows) + "\n")


def _columns(
    path: Path, side_path: Path, lines: list[tuple[int, str]], separator: str, side: Mapping[str, Any]
) -> tuple[Columns, int]:
    """Read the columns of a table, and the number of lines that name them; an error names the line at fault."""
    (first, header), rest = lines[0], lines[1:]
    second = rest[0][1].split(separator) if rest else []
    beside = side.get("units", {})
    header_place = units_place = f"{path}, line {first}"
    row_of_units = False
    with _named_place(header_place):
        names, units = _names_and_units(header.split(separator), beside)
        row_of_units = not units and bool(second) and all(number(cell) is None for cell in second)
    if row_of_units:
        units_place = f"{path}, line {rest[0][0]}"
    elif beside:
        units_place = str(side_path)
    with _named_place(header_place, units_place):
        if row_of_units:
            if len(second) != len(names):
                raise UnitError(
                    f"The row of units has {len(second)} cells for {len(names)} columns.", fix="One for each."
                )
            units = dict(zip(names, second, strict=True))
        return Columns.of(names, units, placed="place" in side), 1 + row_of_units


@contextlib.contextmanager
def _named_place(place: str, units_place: str = "") -> Iterator[None]:
    """Turn errors about what was read into ones that name its file and line; those of units may have another line."""
    try:
        yield
    except UsageError as error:
        where = (units_place or place) if isinstance(error, UnitError) else place
        raise FileFormatError(f"{where}: {error.what}", why=error.why, fix=error.fix) from error


def _lines(path: Path) -> list[tuple[int, str]]:
    """Read the lines that are neither empty nor comments, each with its number."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(
            f"{path} can't be read as text.", why=str(error), fix="Give the path of a UTF-8 text table."
        ) from error
    numbered = enumerate(text.splitlines(), 1)
    return [(i, line) for i, line in numbered if line.strip() and not line.lstrip().startswith("#")]


def _names_and_units(header: list[str], beside: Mapping[str, str]) -> tuple[list[str], Mapping[str, str]]:
    """Read the names of the columns, and the units that stand in the header or beside it."""
    names, units = [], {}
    for i, cell in enumerate(header, 1):
        head = _HEAD.match(cell)
        if head is None:
            raise UsageError(f"Column {i} is called {cell.strip()!r}.", fix="Write a name, or a name [unit].")
        names.append(head["name"])
        if head["unit"]:
            units[head["name"]] = head["unit"]
    if units and beside:
        raise UsageError(
            "Units stand in the header and in the sidecar.",
            fix="Name them in one place, so that one is right.",
        )
    return names, units or beside


def _sidecar(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        side = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
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
