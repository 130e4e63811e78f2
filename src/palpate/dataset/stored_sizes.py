"""Sizes of a Zarr store, checked before anything in it is decoded.

Each array states its shape and how it is cut into chunks; each chunk states in its head how long it is when it is
decoded. Both have to agree, be possible, and fit into memory.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from palpate.errors import ResourceError
from palpate.sizes import HEAD, promised_size

__all__ = ["require_stored_sizes"]

_LONGEST_TEXT = 1 << 16  # bytes of a single text, such as a message with its traceback
_TEXT_HEAD = 4  # bytes before each text, and before all of them


def require_stored_sizes(path: Path) -> None:
    """Refuse a store in which an array or a chunk promises a size that can't be.

    Raises
    ------
    ValueError
        If sizes contradict each other, or something is stored in a way that palpate does not write; names the place.
    KeyError, TypeError
        If metadata are no tables of Zarr's.
    ResourceError
        If the arrays are larger than the memory that is free.
    """
    total = sum(_check_array(file.parent) for file in sorted(path.glob("*/zarr.json")))
    free = psutil.virtual_memory().available
    if total > free:
        raise ResourceError(
            f"The dataset {path} does not fit into memory.",
            why=f"Its arrays take {total / 1e9:.3g} GB, and {free / 1e9:.3g} GB are free.",
            fix="End other programs or take a machine with more memory; if it should be small, its files are damaged.",
        )


def _check_array(folder: Path) -> int:
    """Return the number of bytes that an array takes, after a look at each of its chunks."""
    metadata = json.loads((folder / "zarr.json").read_text(encoding="utf-8"))
    if metadata["node_type"] != "array":
        return 0
    chunk = metadata["chunk_grid"]["configuration"]["chunk_shape"]
    text = metadata["data_type"] == "string"
    try:
        item = _TEXT_HEAD + _LONGEST_TEXT if text else np.dtype(metadata["data_type"]).itemsize
        expected = math.prod(chunk) * item + (_TEXT_HEAD if text else 0)
        compressor = _compressor(metadata, "vlen-utf8" if text else "bytes")
    except ValueError as error:
        raise ValueError(f"{folder.name}: {error}") from error
    for file in folder.rglob("*"):
        if file.is_file() and not file.name.startswith((".", "zarr.json")):
            try:
                _check_chunk(file, compressor, expected, exactly=not text)
            except ValueError as error:
                raise ValueError(f"{folder.name}, chunk {file.relative_to(folder)}: {error}") from error
    return int(math.prod(metadata["shape"])) * (np.dtypes.StringDType().itemsize if text else item)


def _compressor(metadata: Mapping[str, Any], first: str) -> str:
    """Return the name of the compressor after the codec that makes bytes; empty without one."""
    names = [codec["name"] for codec in metadata["codecs"]]
    if names[:1] != [first] or len(names) > 2:
        raise ValueError(f"it is stored by {', '.join(names)}, which palpate does not write")
    return names[1] if len(names) == 2 else ""


def _check_chunk(file: Path, compressor: str, expected: int, *, exactly: bool) -> None:
    length = file.stat().st_size
    if compressor:
        with file.open("rb") as content:
            size = promised_size(compressor, content.read(HEAD), length)
    else:
        size = length
    if size > expected or (exactly and size != expected):
        raise ValueError(f"it holds {size:,} bytes where {expected:,} belong")
