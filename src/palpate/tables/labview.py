"""Rows of a LabVIEW measurement file (.lvm): segments of channels, each below a header of tags.

A first header states the separator, the decimal mark and which abscissas are written; a segment's header states units,
and start and step of its abscissa where none is written. Segments of the same channels are read one after another.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from palpate.errors import UsageError
from palpate.format import by_number
from palpate.tables.table_layout import Row

__all__ = ["is_labview", "labview_rows"]

_FIRST = "LabVIEW Measurement"
_END = "***End_of_Header***"
_SPECIAL = ("***Start_Special***", "***End_Special***")
_TAGS = {"Channels", "Date", "Delta_X", "Notes", "Samples", "Time", "X0", "X_Dimension", "X_Unit_Label"}
_TAGS |= {"Y_Dimension", "Y_Unit_Label", "Test_Name", "Test_Numbers", "Test_Series", "UUT_M/N", "UUT_Name"}
_TAGS |= {"UUT_S/N", "Description", "Operator", "Project"}


@dataclass
class _Segment:
    """Tags, line and cells of the labels, and rows of data."""

    tags: dict[str, list[str]]
    line: int = 0
    labels: list[str] = field(default_factory=list)
    data: list[Row] = field(default_factory=list)

    def tag(self, name: str, column: int, default: str) -> str:
        """Return what a tag says of a column, or of all where it stands once."""
        cells = [cell for cell in self.tags.get(name, []) if cell]
        own = self.tags.get(name, [])
        return (
            own[column] if column < len(own) and own[column] else cells[0] if cells else default
        ) or default


def is_labview(text: str) -> bool:
    """Return true of the text of a LabVIEW measurement file."""
    return text.lstrip().startswith(_FIRST)


def labview_rows(text: str) -> tuple[list[Row], str, str, list[str]]:
    """Return rows with names and units of the channels on top, the separator, the decimal mark, and notes.

    Where the file ends within a header, or segments have different channels, the error's message begins with the line.
    """
    lines = text.split("\n")
    separator = "," if any(line.startswith("Separator,") for line in lines[:40]) else "\t"
    rows = [(i, [cell.strip() for cell in line.split(separator)]) for i, line in enumerate(lines, 1)]
    ends = [i for i, cells in rows if cells[0] == _END]
    if not ends:
        raise UsageError(
            f"line {len(lines)}: the header of the LabVIEW measurement does not end.",
            why=f"No line says {_END}: the file is cut short.",
            fix="Export it again.",
        )
    tags = {cells[0]: cells[1:] for _, cells in rows[: ends[0]]}
    decimal = (tags.get("Decimal_Separator") or ["."])[0] or "."
    written = (tags.get("X_Columns") or ["One"])[0].lower()
    segments = [s for s in _segments(rows[ends[0] :]) if s.data]
    if not segments:
        return [], separator, decimal, []
    heads = [_names(segment, written) for segment in segments]
    for segment, head in zip(segments, heads, strict=True):
        if head != heads[0]:
            raise UsageError(
                f"line {segment.line}: this segment has other channels or units than that of line {segments[0].line}: "
                f"{', '.join(head)}.",
                why=f"The first has {', '.join(heads[0])}.",
                fix="Split the file, one part for each kind of segment.",
            )
    width = len(heads[0])
    top = segments[0].line
    found = [Row(top - 1, tuple(segments[0].labels[:width])), Row(top, tuple(heads[0]))]
    begins: list[float] = []
    for segment in segments:
        data = _data(segment, width, written, decimal)
        begins.append(_number(data[0].cells[0], decimal))
        found += data
    notes = []
    if len(segments) > 1:
        where = by_number("line", [segment.line for segment in segments])
        again = any(b <= a for a, b in itertools.pairwise(begins))
        notes.append(
            f"{len(segments)} segments below {where} are read one after another"
            + (f"; their {heads[0][0]} begins anew in each." if again else ".")
        )
    return found, separator, decimal, notes


def _segments(rows: Sequence[tuple[int, list[str]]]) -> list[_Segment]:
    """Return the segments of the lines below the first header."""
    segments = [_Segment({})]
    special = False
    for line, cells in rows:
        if cells[0] in _SPECIAL:
            special = cells[0] == _SPECIAL[0]
        elif special or not any(cells) or cells[0] == _END:
            continue
        elif cells[0] in _TAGS:
            if segments[-1].labels:
                segments.append(_Segment({}))
            segments[-1].tags[cells[0]] = cells[1:]
        elif not segments[-1].labels:
            segments[-1].line, segments[-1].labels = line, cells
        else:
            segments[-1].data.append(Row(line, tuple(cells)))
    return segments


def _names(segment: _Segment, written: str) -> list[str]:
    """Return the names of the columns with their units; the column of comments, which holds no numbers, is left out."""
    labels = list(segment.labels)
    while labels and labels[-1] in {"", "Comment"}:
        labels.pop()
    names = []
    for j, label in enumerate(labels):
        abscissa = label.startswith("X_Value") and (j == 0 or written == "multi")
        channel = max(j - 1, 0) if not abscissa else j
        if not abscissa:
            unit = segment.tag("Y_Unit_Label", channel, "")
            names.append(f"{label} [{unit}]" if unit else label)
            continue
        name = segment.tag("X_Dimension", channel, "Time")
        unit = segment.tag("X_Unit_Label", channel, "s" if name == "Time" else "")
        name = name if j == 0 else f"{name} of {labels[j + 1] if j + 1 < len(labels) else j}"
        names.append(f"{name} [{unit}]" if unit else name)
    return names


def _data(segment: _Segment, width: int, written: str, decimal: str) -> list[Row]:
    """Return the rows of a segment, of this width; abscissas that are not written follow from start and step."""
    rows = [Row(row.line, (*row.cells[:width], *[""] * (width - len(row.cells)))) for row in segment.data]
    if written != "no" or any(row.cells[0] for row in rows):
        return rows
    start, step = (_number(segment.tag(name, 0, ""), decimal) for name in ("X0", "Delta_X"))
    if not math.isfinite(start + step):
        return rows
    return [
        Row(row.line, (f"{start + i * step!r}".replace(".", decimal), *row.cells[1:]))
        for i, row in enumerate(rows)
    ]


def _number(text: str, decimal: str) -> float:
    try:
        return float(text.replace(decimal, "."))
    except ValueError:
        return math.nan
