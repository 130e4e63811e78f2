"""Chunks of a Zarr store, checked before anything in them is decoded, and one by one where something is damaged.

Each array states its shape and how it is cut into chunks; each chunk states in its head how long it is when it is
decoded, and a chunk of texts how many they are. All have to agree, be possible, and fit into memory.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import psutil

from palpate.errors import FileFormatError, ResourceError
from palpate.input_files import DAMAGE, open_input, read_input
from palpate.sizes import HEAD, promised_size

if TYPE_CHECKING:
    import xarray

__all__ = ["ChunkFault", "chunk_faults", "missing_chunks", "unreadable_chunks"]

_LONGEST_TEXT = 1 << 16  # bytes of a single text, such as a message with its traceback
_TEXT_HEAD = 4  # bytes before each text, and before all of them
# bytes that a chunk of texts may hold, and more for each byte stored
_MOST_TEXT, _TEXT_RATIO = 250_000_000, 1000
_CRC = 4  # bytes of the checksum behind a chunk


@dataclass(frozen=True)
class ChunkFault:
    """A fault of one chunk."""

    name: str  # of the array
    key: str  # name of the chunk in it, such as ``c/0/0``
    reason: str  # what is wrong
    rows: slice  # its range of the array's first dimension

    def __str__(self) -> str:
        return f"{self.name}, chunk {self.key}: {self.reason}"


@dataclass(frozen=True)
class _Array:
    """An array of a store, by its metadata."""

    folder: Path
    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    item: int  # bytes; of a text, at most
    is_text: bool
    compressor: str
    has_checksum: bool
    is_by_rows: bool  # its chunks hold rows of the dataset

    @property
    def size(self) -> int:
        """Number of bytes that it takes in memory."""
        return math.prod(self.shape) * (np.dtypes.StringDType().itemsize if self.is_text else self.item)

    def fault(self, key: str, reason: str) -> ChunkFault:
        parts = key.split("/")
        first = int(parts[1]) if len(parts) > 1 and parts[1].isdecimal() else 0
        step = self.chunk[0] if self.chunk else 1
        return ChunkFault(self.folder.name, key, reason, slice(first * step, (first + 1) * step))


def chunk_faults(path: Path) -> dict[str, list[ChunkFault]]:
    """Return what is wrong with the sizes of chunks, by the arrays' names; nothing of it has been decoded.

    A `ValueError` names the place where metadata contradict each other, where something is stored in a way that palpate
    does not write, or where a chunk is faulty in an array without rows or of an earlier version, whose chunks have no
    checksums; metadata that are no tables of Zarr's raise `KeyError` or `TypeError`.
    """
    arrays = [array for file in sorted(path.glob("*/zarr.json")) if (array := _read_array(file.parent))]
    total, free = sum(array.size for array in arrays), psutil.virtual_memory().available
    if total > free:
        raise ResourceError(
            f"The dataset {path} does not fit into memory.",
            why=f"Its arrays take {total / 1e9:.3g} GB, and {free / 1e9:.3g} GB are free.",
            fix="End other programs or take a machine with more memory; if it should be small, its files are damaged.",
        )
    faults: dict[str, list[ChunkFault]] = {}
    for array in arrays:
        for file in sorted(array.folder.rglob("*")):
            if file.is_dir() or file.name.startswith((".", "zarr.json")):
                continue
            try:
                _check_chunk(file, array)
            except (ValueError, FileFormatError) as error:
                fault = array.fault(file.relative_to(array.folder).as_posix(), str(error))
                if not (array.has_checksum and array.is_by_rows):
                    raise ValueError(str(fault)) from error
                faults.setdefault(array.folder.name, []).append(fault)
    return faults


def unreadable_chunks(
    path: Path, name: str, array: xarray.DataArray, known: Sequence[ChunkFault] = ()
) -> list[ChunkFault]:
    """Return the chunks of an array that can't be decoded, or don't match their checksum, but those known as faulty."""
    stored = _read_array(path / name)
    if stored is None or not stored.is_by_rows:
        return []
    faults = []
    for number, start in enumerate(range(0, stored.shape[0], stored.chunk[0])):
        if any(fault.rows.start == start for fault in known):
            continue
        try:
            array.isel(sample=slice(start, start + stored.chunk[0])).load()
        except DAMAGE as error:
            faults.append(stored.fault(f"c/{number}", str(error).strip() or type(error).__name__))
    return faults


def missing_chunks(path: Path, name: str) -> list[ChunkFault]:
    """Return the chunks of an array that have no file."""
    stored = _read_array(path / name)
    if stored is None or not stored.is_by_rows:
        return []
    counts = [-(-length // chunk) for length, chunk in zip(stored.shape, stored.chunk, strict=True)]
    keys = ["/".join(["c", *map(str, place)]) for place in np.ndindex(*counts)]
    return [stored.fault(key, "its file is missing") for key in keys if not (path / name / key).exists()]


def _read_array(folder: Path) -> _Array | None:
    """Return what the metadata say of an array; None of a group."""
    metadata = json.loads(read_input(folder / "zarr.json"))
    if metadata["node_type"] != "array":
        return None
    chunk = metadata["chunk_grid"]["configuration"]["chunk_shape"]
    text = metadata["data_type"] == "string"
    try:
        item = _TEXT_HEAD + _LONGEST_TEXT if text else np.dtype(metadata["data_type"]).itemsize
        compressor, has_checksum = _codecs(metadata, "vlen-utf8" if text else "bytes")
    except ValueError as error:
        raise ValueError(f"{folder.name}: {error}") from error
    shape = tuple(map(int, metadata["shape"]))
    if len(shape) != len(chunk) or min((*shape, *chunk), default=1) < 0:
        raise ValueError(f"{folder.name}: its shape is {shape}, its chunks are {chunk}")
    is_by_rows = metadata.get("dimension_names", [""])[:1] == ["sample"] and folder.name != "sample"
    return _Array(folder, shape, tuple(chunk), item, text, compressor, has_checksum, is_by_rows)


def _codecs(metadata: Mapping[str, Any], first: str) -> tuple[str, bool]:
    """Return the name of the compressor, empty without one, and whether a checksum stands behind each chunk."""
    names = [codec["name"] for codec in metadata["codecs"]]
    has_checksum = len(names) > 1 and names[-1] == "crc32c"
    compressors = names[1:-1] if has_checksum else names[1:]
    if names[:1] != [first] or len(compressors) > 1:
        raise ValueError(f"it is stored by {', '.join(names)}, which palpate does not write")
    return (compressors[0] if compressors else ""), has_checksum


def _check_chunk(file: Path, array: _Array) -> None:
    length = file.stat().st_size - _CRC * array.has_checksum
    with open_input(file) as content:
        head = content.read(max(0, min(HEAD, length)))
    size = promised_size(array.compressor, head, length) if array.compressor else length
    expected = math.prod(array.chunk) * array.item + _TEXT_HEAD * array.is_text
    if array.is_text:
        expected = min(expected, _MOST_TEXT + _TEXT_RATIO * max(length, 0))
    if size > expected or (not array.is_text and size != expected):
        raise ValueError(f"it holds {size:,} bytes where {expected:,} belong")
    if array.is_text:
        _require_count(file, array)


def _require_count(file: Path, array: _Array) -> None:
    """Refuse a chunk that states another number of texts than belong there: the decoder makes room for all of them."""
    import numcodecs

    content = read_input(file)
    content = content[: len(content) - _CRC * array.has_checksum]
    try:
        if array.compressor:
            content = bytes(numcodecs.get_codec({"id": array.compressor}).decode(content))
    except DAMAGE as error:
        raise ValueError(f"it can't be decoded ({error})") from error
    number, belong = int.from_bytes(content[:_TEXT_HEAD], "little"), math.prod(array.chunk)
    if number > belong:
        raise ValueError(f"it promises {number:,} texts where {belong:,} belong")
