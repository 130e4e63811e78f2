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
    try:
        columns, used = _columns(
            header.split(split), lines[0][1].split(split) if lines else [], side.get("units", {}), side
        )
    except UsageError as error:
        raise FileFormatError(f"{path}, line {first}: {error.what}", why=error.why, fix=error.fix) from error
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


def _columns(
    header: list[str], second: list[str], beside: Mapping[str, str], side: Mapping[str, Any]
) -> tuple[Columns, int]:
    """The columns, and how many further lines (0 or 1) told of them."""
    heads = [_HEAD.match(cell) for cell in header]
    for i, (head, cell) in enumerate(zip(heads, header, strict=True), 1):
        if head is None:
            raise UsageError(f"Column {i} is called {cell.strip()!r}.", fix="Write a name, or a name [unit].")
    found = [head for head in heads if head is not None]
    names = [head["name"] for head in found]
    units = {head["name"]: head["unit"] for head in found if head["unit"]}
    row = bool(second) and all(number(cell) is None for cell in second) and not units and not beside
    if row:
        if len(second) != len(names):
            raise UsageError(
                f"The row of units has {len(second)} cells for {len(names)} columns.", fix="One for each."
            )
        units = dict(zip(names, second, strict=True))
    if not row and units and beside:
        raise UsageError(
            "Units stand in the header and in the sidecar.",
            fix="Name them in one place, so that one is right.",
        )
    return Columns.of(names, units or beside, placed="place" in side), int(row)


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
