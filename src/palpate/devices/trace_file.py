"""Files of recorded touches: chunks of ticks, one after the other, in a ZIP archive that a crash leaves readable.

::

    header.json        what was touched, by which device, at which rate and limits, with which version
    loop.json          what the loop said of itself: body, workspace, limits, traits of the device
    state.npz          what it remembered as the recording began
    ticks-000001.npz   half a second of ticks, by column
    events-000002.json models that answered, ticks that were lost, faults of the device in words
    end.json           how it ended, after copies of the header and of what the loop said

Each entry is appended in one piece and synchronised, so that a process which is killed loses what it had not yet
written: at most the last second. The archive's directory comes last; without it any entry is still found by its own
header. A reader takes all entries that are whole, and says what is missing: an end, or an entry that is damaged.

Within a chunk a column whose bits are those of an earlier one is stored as its name, and one that doesn't change as
its single value: at rest, or on a device with plain axes, most of a tick is neither.
"""

from __future__ import annotations

import io
import json
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from palpate.devices.tick_record import FLAGS, TICK
from palpate.errors import FileFormatError, ResourceError, UsageError
from palpate.files import system_errors
from palpate.input_files import DAMAGE, plain_texts, read_input

__all__ = ["COLUMNS", "FORMAT", "VERSION", "Trace", "TraceWriter", "read_stroke", "read_trace"]

FORMAT, VERSION = "palpate trace", 1
COLUMNS = tuple(name for name in TICK.names or () if name not in {"spare", "checksum"})
_LOCAL = struct.Struct("<4s5H3I2H")  # of APPNOTE.TXT 4.3.7, the header of a ZIP entry
_CENTRAL = struct.Struct("<4s6H3I5H2I")
_END = struct.Struct("<4s4H2IH")
_DATE = 0x21  # 1 January 1980, as early as a ZIP can say
_LARGEST_CHUNK = 256 * 1024 * 1024  # bytes of what is decoded at once: more is no half second
_NAME = re.compile(rb"(header|loop|end)(-copy)?\.json|state\.npz|(ticks|events)-\d{6,}\.(npz|json)")
_SEARCHES = 10_000  # marks of entries that are looked at where one is damaged
_MOST_ENTRIES, _LARGEST = 0xFFFF, 0xFFFFFFFF  # for which an archive can have a plain directory


class TraceWriter:
    """Writes a trace into a new file, chunk by chunk; whatever was written before a crash can be read.

    The header says what was touched and how, as JSON takes it; `size` is the bytes so far. Every method raises a
    ResourceError where the disk is full or the folder write-protected.
    """

    def __init__(self, path: str | os.PathLike[str], header: Mapping[str, Any]) -> None:
        self.path, self.size, self._count = Path(path), 0, 0
        self._names: list[tuple[bytes, int, int, int]] = []  # name, checksum, bytes, place
        if self.path.exists():
            raise UsageError(
                f"{self.path} exists already.",
                fix="Choose another name, or remove it: no recording is replaced.",
            )
        with system_errors(f"The recording {self.path} could not be begun."):
            self._file: BinaryIO = self.path.open("xb", buffering=0)
        self._once: dict[str, Any] = {}  # records that all ticks depend on: they are repeated at the end
        self.add_json("header", {"format": FORMAT, "version": VERSION} | dict(header))

    def add_json(self, name: str, content: Any) -> None:
        """Append a record as JSON."""
        if name in {"header", "loop"}:
            self._once[name] = content
        self._append(f"{name}.json", json.dumps(content, indent=1).encode())

    def add_state(self, state: Mapping[str, Any]) -> None:
        """Append what the loop remembered as the recording began."""
        self._append("state.npz", _npz(state))

    def add_ticks(self, ticks: np.ndarray) -> None:
        """Append ticks (N,) of dtype `TICK`, N ≥ 1."""
        self._count += 1
        self._append(f"ticks-{self._count:06d}.npz", _npz(_fold(ticks)))

    def add_events(self, events: Sequence[Mapping[str, Any]]) -> None:
        """Append events, each with its ``kind`` and ``tick``."""
        self._count += 1
        self.add_json(f"events-{self._count:06d}", list(events))

    def close(self, end: Mapping[str, Any]) -> None:
        """Append how it ended, and the archive's directory."""
        if not self._file.closed:
            try:
                for name, content in self._once.items():
                    self.add_json(f"{name}-copy", content)
                self.add_json("end", dict(end))
                self._write(self._directory())
            finally:
                self._file.close()

    def abandon(self) -> None:
        """Close the file as it is, for example because the disk is full."""
        self._file.close()

    def _append(self, name: str, data: bytes) -> None:
        encoded, checksum = name.encode(), zlib.crc32(data)
        head = _LOCAL.pack(b"PK\3\4", 20, 0, 0, 0, _DATE, checksum, len(data), len(data), len(encoded), 0)
        self._names.append((encoded, checksum, len(data), self.size))
        self._write(head + encoded + data)

    def _write(self, data: bytes) -> None:
        with system_errors(f"The recording {self.path} stopped."):
            start = self.size
            try:
                rest = memoryview(data)
                while rest:
                    rest = rest[self._file.write(rest) or 0 :]
                os.fsync(self._file.fileno())
            except OSError:
                self._file.truncate(start)  # a part of an entry is of no use
                raise
            self.size += len(data)

    def _directory(self) -> bytes:
        if len(self._names) > _MOST_ENTRIES or self.size > _LARGEST // 2:
            return b""
        rows = b"".join(
            _CENTRAL.pack(b"PK\1\2", 20, 20, 0, 0, 0, _DATE, crc, size, size, len(name), *(0,) * 5, place)
            + name
            for name, crc, size, place in self._names
        )
        count = len(self._names)
        return rows + _END.pack(b"PK\5\6", 0, 0, count, count, len(rows), self.size, 0)


@dataclass(frozen=True, eq=False)
class Trace:
    """A recorded touch."""

    path: Path  # its file
    header: Mapping[str, Any]  # what was touched, by which device, at which rate and limits
    ticks: np.ndarray  # (N,) of dtype `TICK`, in order of time
    state: Mapping[str, Any] | None = None  # what the loop remembered as the recording began; None: not kept
    events: tuple[Mapping[str, Any], ...] = ()  # each with `tick` and `kind`
    end: Mapping[str, Any] | None = None  # how it ended; None where the file ends too early
    size: int = 0  # bytes of the file
    notes: tuple[str, ...] = field(default=())  # what is missing, in words

    def __len__(self) -> int:
        return len(self.ticks)

    def __str__(self) -> str:
        return f"Trace of {self.header.get('name', 'a body')}: {len(self)} ticks in {self.seconds:.3g} s"

    __repr__ = __str__

    @property
    def time(self) -> np.ndarray:
        """Time (N,) since the first tick, s."""
        return np.asarray(self.ticks["time"] - self.ticks["time"][:1])

    @property
    def seconds(self) -> float:
        """Time from the first tick to the last, s."""
        return float(self.time[-1]) if len(self) else 0.0

    @property
    def parameters(self) -> np.ndarray:
        """Inputs (N, p) that the hand doesn't supply, as they were in force."""
        return np.asarray(self.ticks["parameters"][:, : len(self.header.get("parameters", ()))])

    @property
    def velocity(self) -> np.ndarray:
        """Velocity of the hand (N, 3), m/s, by central differences of the recorded places."""
        if len(self) < 2 or (np.diff(self.time) <= 0.0).any():
            return np.zeros((len(self), 3))
        return np.asarray(np.gradient(self.ticks["hand"], self.time, axis=0))

    def flag(self, name: str) -> np.ndarray:
        """Return one of `palpate.devices.tick_record.FLAGS` for each tick, (N,) bool."""
        return (self.ticks["flags"] & (1 << FLAGS.index(name))).astype(bool)

    @property
    def lost(self) -> int:
        """Number of ticks that the recording is without, between its first and its last."""
        return int(self.ticks["tick"][-1] - self.ticks["tick"][0] + 1 - len(self)) if len(self) else 0


def read_trace(path: str | os.PathLike[str]) -> Trace:
    """Read a recorded touch, as `palpate run --record` writes it; what is missing or damaged is left out, with a note.

    A FileFormatError says that the file is missing, is no recording, is of a later version, or is damaged throughout; a
    ResourceError that its ticks take more than half of the memory that is free.
    """
    import psutil

    path = Path(path)
    data = read_input(path)
    records: dict[str, Any] = {}
    chunks: list[np.ndarray] = []
    events: list[Mapping[str, Any]] = []
    gaps: list[tuple[int, int]] = []
    used, room = 0, psutil.virtual_memory().available // 2  # once in chunks, and once in one piece
    for name, content, start, end in _entries(data):
        if start > used:
            gaps.append((used, start))
        used = end
        kind = name.partition(".")[0].removesuffix("-copy")
        try:
            if kind == "state":
                records[kind] = _arrays(content)
            elif kind.startswith("ticks-"):
                chunks.append(_unfold(path, _arrays(content), room))
                room -= chunks[-1].nbytes
            elif kind.startswith("events-"):
                events += [event for event in plain_texts(json.loads(content)) if isinstance(event, dict)]
            else:
                records[kind] = dict(plain_texts(json.loads(content)))
        except DAMAGE:
            gaps.append((start, end))
    header = _accepted(path, records.get("header"))
    if not header:
        raise FileFormatError(
            f"{path} is no recording of palpate.",
            why="It has no header of one.",
            fix="Record one with palpate run MODEL --record FILE.",
        )
    if gaps and not chunks:
        raise FileFormatError(
            f"{path} is damaged.",
            why="No tick of it can be read.",
            fix="Copy the file again, or record it anew.",
        )
    ticks = np.concatenate(chunks) if chunks else np.zeros(0, TICK)
    notes = _missing(data, used, gaps, has_end="end" in records)
    header |= records.get("loop", {})
    return Trace(
        path, header, ticks, records.get("state"), tuple(events), records.get("end"), len(data), notes
    )


def read_stroke(path: str | os.PathLike[str]) -> Trace:
    """Read a recorded touch that a hand can follow: one of two ticks or more."""
    trace = read_trace(path)
    if len(trace) < 2:
        raise UsageError(f"{path} holds no stroke.", fix="Record a longer touch.")
    return trace


def _missing(data: bytes, used: int, gaps: list[tuple[int, int]], *, has_end: bool) -> tuple[str, ...]:
    """Return in words what the file is without."""
    rest = len(data) - used
    if not has_end and rest and data.find(b"PK\5\6", used) >= 0:  # the directory that ends a whole one
        gaps, rest = [*gaps, (used, len(data))], 0
    notes = [
        f"The recording is damaged at byte {at}: {to - at} bytes from there on were left out."
        for at, to in gaps
    ]
    if not has_end and not notes:
        cut = f"; the last {rest} bytes are an unfinished chunk and were left out" if rest else ""
        notes.append(f"The recording has no end: its program was killed, or still records{cut}.")
    return tuple(notes)


def _accepted(path: Path, header: Any) -> dict[str, Any]:
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        return {}
    if not isinstance(header.get("version"), int) or header["version"] > VERSION:
        raise FileFormatError(
            f"{path} was recorded by a later version of palpate.",
            why=f"Its layout is {header['version']}; this version reads up to {VERSION}.",
            fix="Update palpate.",
        )
    return dict(header)


def _entries(data: bytes) -> Iterator[tuple[str, bytes, int, int]]:
    """Yield name, content, begin and end of each whole entry of a ZIP archive, by the entries' own headers.

    What lies between is damaged. Within it the next entry is searched for by its mark.
    """
    place, searches = 0, 0
    while place >= 0 and searches < _SEARCHES:
        if entry := _entry_at(data, place):
            yield entry
            place = entry[-1]
        else:
            searches += 1
            place = data.find(b"PK\3\4", place + 1)


def _entry_at(data: bytes, place: int) -> tuple[str, bytes, int, int] | None:
    """Return the entry that begins at a place; None where none of a recording's does, or it is damaged."""
    if place + _LOCAL.size > len(data):
        return None
    mark, _, flags, method, _, _, checksum, size, _, names, extra = _LOCAL.unpack_from(data, place)
    begin = place + _LOCAL.size
    start = begin + names + extra
    known = _NAME.fullmatch(data, begin, min(begin + names, len(data)))
    if not known or mark != b"PK\3\4" or flags & 8 or method != 0 or start + size > len(data):
        return None
    content = data[start : start + size]
    return (known[0].decode(), content, place, start + size) if zlib.crc32(content) == checksum else None


def _npz(arrays: Mapping[str, Any]) -> bytes:
    file = io.BytesIO()
    columns: dict[str, Any] = {name: np.asarray(value) for name, value in arrays.items()}
    np.savez_compressed(file, **columns)
    return file.getvalue()


def _arrays(content: bytes) -> dict[str, np.ndarray]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
        if size > _LARGEST_CHUNK:
            raise ValueError(f"A chunk claims to be {size} bytes long.")
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def _fold(ticks: np.ndarray) -> dict[str, np.ndarray]:
    """Return the columns of ticks (N,), without those that repeat another one or themselves."""
    columns: dict[str, np.ndarray] = {}
    same: list[tuple[str, str]] = []
    for name in COLUMNS:
        column = np.ascontiguousarray(ticks[name])
        bits = column.tobytes()
        likely = (known for known, other in columns.items() if other.dtype == column.dtype)
        double = next((known for known in likely if columns[known].tobytes() == bits), "")
        if double:
            same.append((name, double))
        else:
            columns[name] = column
    for name, column in columns.items():
        if column[:1].tobytes() * len(column) == column.tobytes():
            columns[name] = column[:1]
    return columns | {"same": np.array(same, dtype="U16").reshape(-1, 2), "count": np.array(len(ticks))}


def _unfold(path: Path, columns: Mapping[str, np.ndarray], room: int) -> np.ndarray:
    """Return the ticks (N,) of a chunk, where they take no more than `room`, bytes."""
    count = int(columns["count"])
    if not 0 <= count <= _LARGEST_CHUNK // TICK.itemsize:
        raise ValueError(f"A chunk claims to hold {count} ticks.")
    if count * TICK.itemsize > room:
        raise ResourceError(
            f"The recording {path} does not fit into memory.",
            why="Its ticks take more than half of what is free.",
            fix="End other programs or take a machine with more memory; if it should be small, it is damaged.",
        )
    ticks = np.zeros(count, TICK)
    for name in COLUMNS:
        if name in columns:
            ticks[name] = columns[name]
    for name, double in np.asarray(columns["same"], dtype=str).tolist():
        ticks[name] = ticks[double]
    return ticks
