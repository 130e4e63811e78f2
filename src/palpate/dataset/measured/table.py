"""Measured indentation in a text table: one header, units, and a row for each measurement.

::

    # silicone block, probe of 10 mm                   lines that begin with # are skipped
    t, x, y, z, Fx, Fy, Fz                             or: t [s], x [mm], …
    s, mm, mm, mm, N, N, N                             then without this row
    0.00, 50.0, 50.0, 59.5, 0.001, -0.002, 0.013

Commas, semicolons or tabs part the cells. Units may also stand in a sidecar, ``NAME.json`` beside ``NAME.csv``:

    {"units": {"depth": "mm", "F": "gf"}, "place": [0.05, 0.05, 0.05], "direction": [0, 0, -1]}

with the place (m) at which depths were measured and the direction of pressing, down unless told.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset.measured.columns import NAMES, Columns, number
from palpate.dataset.measured.record import Measured
from palpate.dataset.measured.units import UnitError
from palpate.errors import FileFormatError, UsageError

__all__ = ["read_measured", "write_measured"]

_HEAD = re.compile(r"^\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?\s*$")
_KEYS = {"units", "place", "direction"}
_MAKE = "Write a header such as `t [s], x [mm], y [mm], z [mm], Fz [N]` and a row of numbers for each touch."


def read_measured(path: str | os.PathLike[str]) -> Measured:
    """Read a table of measured indentation.

    Raises
    ------
    FileFormatError
        If the file can't be read or is no such table; the message names file, line and column.
    """
    path = Path(path)
    lines = _lines(path)
    side = _sidecar(path.with_suffix(".json"))
    if not lines:
        raise FileFormatError(f"{path} holds no table.", why="It has no header.", fix=_MAKE)
    first, header = lines.pop(0)
    split = next((mark for mark in ";\t" if mark in header), ",")
    second, beside = lines[0][1].split(split) if lines else [], side.get("units", {})
    told = f"{path}, line {first}"
    try:
        names, units = _named(header.split(split), beside)
        used = int(not units and _is_row_of_units(second))
        if used:  # what is wrong with a unit is wrong there
            told = f"{path}, line {lines[0][0]}"
            units = _row_of_units(names, second)
        elif beside:
            told = str(path.with_suffix(".json"))
        columns = Columns.of(names, units, placed="place" in side)
    except UsageError as error:
        where = told if isinstance(error, UnitError) else f"{path}, line {first}"
        raise FileFormatError(f"{where}: {error.what}", why=error.why, fix=error.fix) from error
    rows = []
    for at, line in lines[used:]:
        try:
            rows.append(columns.values(line.split(split)))
        except UsageError as error:
            raise FileFormatError(f"{path}, line {at}: {error.what}", why=error.why, fix=error.fix) from error
    if not rows:
        raise FileFormatError(f"{path} holds a header and no measurement.", fix=_MAKE)
    return Measured.of(rows, **{k: side[k] for k in ("place", "direction") if k in side})


def write_measured(path: str | os.PathLike[str], position: np.ndarray, force: np.ndarray) -> Path:
    """Write positions (N, 3) in m and forces (N, 3) in N, so that `read_measured` gives them back bit for bit.

    Raises
    ------
    UsageError
        If the file can't be written.
    """
    path = Path(path)
    rows = ["x,y,z,Fx,Fy,Fz", "m,m,m,N,N,N"]
    rows += [",".join(repr(float(v)) for v in row) for row in np.hstack([position, force])]
    try:
        path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    except OSError as error:
        raise UsageError(
            f"Could not write {path}.", why=str(error), fix="Choose a folder that exists."
        ) from error
    return path


def _lines(path: Path) -> list[tuple[int, str]]:
    """Numbered lines that say something."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(
            f"{path} can't be read as text.", why=str(error), fix="Give the path of a UTF-8 text table."
        ) from error
    numbered = enumerate(text.splitlines(), 1)
    return [(at, line) for at, line in numbered if line.strip() and not line.lstrip().startswith("#")]


def _named(header: list[str], beside: Mapping[str, str]) -> tuple[list[str], Mapping[str, str]]:
    """Names of the columns, and the units that header or sidecar tell."""
    heads = [_HEAD.match(cell) for cell in header]
    for i, (head, cell) in enumerate(zip(heads, header, strict=True), 1):
        if head is None:
            raise UsageError(f"Column {i} is called {cell.strip()!r}.", fix="Write a name, or a name [unit].")
    found = [head for head in heads if head is not None]
    units = {head["name"]: head["unit"] for head in found if head["unit"]}
    if units and beside:
        raise UsageError(
            "Units stand in the header and in the sidecar.",
            fix="Name them in one place, so that one is right.",
        )
    return [head["name"] for head in found], units or beside


def _is_row_of_units(cells: list[str]) -> bool:
    return bool(cells) and all(number(cell) is None for cell in cells)


def _row_of_units(names: list[str], cells: list[str]) -> dict[str, str]:
    if len(cells) != len(names):
        raise UnitError(
            f"The row of units has {len(cells)} cells for {len(names)} columns.", fix="One for each."
        )
    return dict(zip(names, cells, strict=True))


def _sidecar(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        side = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FileFormatError(
            f"{path} is no JSON.", why=str(error), fix="Mend it or take it away."
        ) from error
    fault = _side_fault(side)
    if fault:
        raise FileFormatError(f"{path}: {fault}.", fix=_MAKE)
    return dict(side)


def _side_fault(side: Any) -> str:
    if not isinstance(side, dict) or not side.keys() <= _KEYS:
        return f"it is no object with keys among {', '.join(sorted(_KEYS))}"
    units = side.get("units", {})
    if not isinstance(units, dict) or not all(isinstance(v, str) for v in units.values()):
        return "its units are no texts by column"
    if strange := [k for k in units if k.strip().lower() not in NAMES]:
        return f"it has a unit for {strange[0]!r}, which is no measured quantity"
    for key in ("place", "direction"):
        if key in side and not _vector(side[key]):
            return f"its {key} is not three finite numbers"
    if "direction" in side and not any(side["direction"]):
        return "its direction has no length"
    return ""


def _vector(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 3
        and all(type(v) in {int, float} and np.isfinite(v) for v in value)
    )
