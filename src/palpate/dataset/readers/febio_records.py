"""Data records of FEBio: files of `node_data`, `element_data` and `rigid_body_data`, or the same in a ``.log``.

Each step is a case. FEBio's coordinates x, y, z are those of the deformed body; with the displacement beside them the
places at rest follow.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.dataset.readers.file_text import read_lines
from palpate.dataset.readers.results import TIME, Column, Places, Results, refuse

__all__ = ["is_record", "read_records"]

_STEP = re.compile(r"^\s*\*?Step\s*=\s*(?P<value>\d+)\s*$")
_TIME = re.compile(r"^\s*\*?Time\s*=\s*(?P<value>\S+)\s*$")
_DATA = re.compile(r"^\s*\*?Data\s*=\s*(?P<value>.*\S)\s*$")
_RECORD = re.compile(r"^\s*Data Record #(?P<value>\d+)\s*$")
_NODAL = frozenset({"ux", "uy", "uz", "Rx", "Ry", "Rz"})
_MEASURES = {
    **dict.fromkeys(("x", "y", "z", "ux", "uy", "uz"), "{length}"),
    **dict.fromkeys(("Rx", "Ry", "Rz", "Fx", "Fy", "Fz"), "{force}"),
    **dict.fromkeys(("sx", "sy", "sz", "sxy", "syz", "sxz"), "{force}/{length}**2"),
}


def is_record(head: str) -> bool:
    """Return whether a file begins like a data record, or like a log of FEBio."""
    lines = [line for line in head.splitlines() if line.strip()]
    begins = len(lines) > 2 and bool(_STEP.match(lines[0]) and _TIME.match(lines[1]))
    return begins or "F E B i o" in head or "FEBio" in head or any(_RECORD.match(line) for line in lines)


@dataclass(eq=False)
class _Block:
    """One record at one step."""

    line: int
    record: int
    time: float
    names: list[str]
    ids: list[int] = field(default_factory=list)
    rows: list[list[float]] = field(default_factory=list)


def read_records(path: Path) -> Results:
    """Read the data records of a file."""
    blocks = list(_blocks(path, read_lines(path)))
    if not blocks:
        raise refuse(
            path,
            None,
            "no data record is in it.",
            why="A record begins with the lines Step, Time and Data.",
            fix='Add <node_data data="ux;uy;uz"/> to the <logfile> of the model, with the lines of the step left on.',
        )
    records = list(dict.fromkeys(block.record for block in blocks))
    times = [block.time for block in blocks if block.record == records[0]]
    columns: list[Column] = [Column(TIME, np.array(times), None, "{time}")]
    places: dict[str, Places] = {}
    for record in records:
        own = [block for block in blocks if block.record == record]
        suffix = f" of record {record}" if len(records) > 1 else ""
        _require_alike(path, own, times)
        values = np.array([block.rows for block in own])
        names, ids = own[0].names, np.array(own[0].ids)
        if len(ids) == 1:  # a rigid body: numbers of the case
            columns += [
                Column(name + suffix, values[:, 0, i], None, _MEASURES.get(name, ""))
                for i, name in enumerate(names)
            ]
            continue
        nodal = bool(_NODAL & set(names))
        place = ("nodes" if nodal else "items") + suffix
        columns += [
            Column(name + suffix, values[:, :, i], None, _MEASURES.get(name, ""), place)
            for i, name in enumerate(names)
        ]
        places[place] = Places(ids, _at_rest(names, values[0]) if nodal else {}, nodal=nodal)
    return Results.of(path, "FEBio data record", len(times), columns, places)


def _at_rest(names: Sequence[str], values: np.ndarray) -> dict[str, Column]:
    """Return the coordinates at rest, where the record has those of the deformed body and the displacement."""
    if not {"x", "y", "z", "ux", "uy", "uz"} <= set(names):
        return {}
    column = {name: values[:, i] for i, name in enumerate(names)}
    return {axis: Column(axis, column[axis] - column[f"u{axis}"], None, "{length}") for axis in "xyz"}


def _require_alike(path: Path, blocks: Sequence[_Block], times: Sequence[float]) -> None:
    for block in blocks:
        first = blocks[0]
        if block.ids != first.ids or block.names != first.names or len(blocks) != len(times):
            raise refuse(
                path,
                block.line,
                "the record differs from step to step.",
                why=f"It has {len(first.ids)} and {len(block.ids)} items, {len(blocks)} steps of {len(times)}, or "
                "other quantities. A run that was stopped leaves half a step.",
                fix="Let FEBio end, and read the file anew.",
            )


def _blocks(path: Path, lines: Sequence[str]) -> Iterator[_Block]:
    record, time, block = 1, np.nan, None
    for number, line in enumerate(lines, 1):
        if match := _RECORD.match(line):
            if block is not None:
                yield block
            record, block = int(match["value"]), None
        elif _STEP.match(line):
            if block is not None:
                yield block
            block, time = None, np.nan
        elif match := _TIME.match(line):
            time = _number(path, number, match["value"])
        elif (match := _DATA.match(line)) and np.isfinite(time):
            block = _Block(
                number, record, time, [name.strip() for name in match["value"].split(";") if name.strip()]
            )
        elif block is not None and not _add_row(path, number, line, block):
            yield block
            block = None
    if block is not None:
        yield block


def _add_row(path: Path, number: int, line: str, block: _Block) -> bool:
    """Add a row to a block; return False where the block has ended."""
    cells = re.split(r"[\s,;]+", line.strip())
    if not cells[0].isdigit():
        return not line.strip() and not block.rows  # between the head and the rows
    if len(cells) != 1 + len(block.names):
        raise refuse(
            path,
            number,
            f"{len(cells)} values stand where {1 + len(block.names)} belong.",
            why="The file is cut short, or its lines have a format of the user's own.",
        )
    block.ids.append(int(cells[0]))
    block.rows.append([_number(path, number, cell) for cell in cells[1:]])
    return True


def _number(path: Path, line: int, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise refuse(path, line, f"{text!r} is no number.") from None
