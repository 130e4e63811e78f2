"""Datasets on disk: each is a Zarr store (format 3) with checksums of each chunk, of each array, and over everything.

Where a chunk is damaged, the rows in it are lost, and no others: the checksums of the rest tell that it is sound.
"""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset.schema import FORMAT, FORMAT_VERSION, TIMINGS
from palpate.dataset.stored_chunks import ChunkFault, chunk_faults, missing_chunks, unreadable_chunks
from palpate.errors import DataWarning, FileFormatError, UsageError
from palpate.files import restore_folder, writing_folder
from palpate.input_files import DAMAGE, plain_text, read_input

if TYPE_CHECKING:
    import xarray

__all__ = ["fingerprint", "read", "write"]

CHUNK_BYTES = 4_000_000  # bytes of a chunk, which is a file: some 50 samples of 3,000 nodes
_PROVENANCE = "provenance"  # attribute whose checksum stands beside those of the arrays
_CHUNK_ROWS, _CHUNKS = 64, 8  # rows at least in a chunk of a small array, and chunks that it has about


def fingerprint(data: xarray.Dataset, exclude: Iterable[str] = ()) -> str:
    """Return the SHA-256 of all variables and coordinates but `exclude`, as hexadecimal digits."""
    digest = hashlib.sha256()
    for name in sorted(set(map(str, data.variables)) - set(exclude)):
        _add_array(digest, name, data[name])
    return digest.hexdigest()


def _add_array(digest: Any, name: str, array: xarray.DataArray) -> None:
    values = array.values
    digest.update(f"{name} {array.dims} {values.shape}".encode())
    if values.dtype.kind in "TOU":
        digest.update("\0".join(map(str, values.ravel())).encode())
    else:
        digest.update(np.ascontiguousarray(values).tobytes())


def _array_checksum(name: str, array: xarray.DataArray) -> str:
    digest = hashlib.sha256()
    _add_array(digest, name, array)
    return digest.hexdigest()


def write(data: xarray.Dataset, path: Path, *, overwrite: bool) -> Path:
    """Write a dataset's arrays to `path`; the store appears whole or not at all."""
    restore_folder(path)
    if path.exists() and not overwrite:
        if _holds(path, data):
            return path
        raise UsageError(
            f"{path} exists already.",
            why="It holds something else than the dataset to be saved.",
            fix="Save under another name, delete it, or pass overwrite=True.",
        )
    head = path / "zarr.json"
    if path.exists() and not (head.is_file() and FORMAT.encode() in head.read_bytes()):
        raise UsageError(
            f"{path} won't be overwritten.",
            why="It is no dataset of palpate.",
            fix="Save under another name, or delete it yourself.",
        )
    parts = {str(name): _array_checksum(str(name), data[name]) for name in data.variables}
    parts[_PROVENANCE] = _text_checksum(data.attrs["provenance"])
    stamped = data.assign_attrs(checksum=_checksum(data), checksums=json.dumps(parts, sort_keys=True))
    with writing_folder(path) as staging:
        # consolidated metadata is no part of Zarr's format 3
        stamped.to_zarr(staging, mode="w-", zarr_format=3, consolidated=False, encoding=_encoding(data))
    return path


def read(path: Path) -> xarray.Dataset:
    """Read and check the arrays in the store at `path`."""
    restore_folder(path)
    attrs = _attributes(path)
    if attrs.get("format") != FORMAT:
        raise FileFormatError(
            f"{path} is no dataset of palpate.",
            why="It is a Zarr store, but its attribute 'format' doesn't say so.",
            fix="Open a store that palpate wrote.",
        )
    version = attrs.get("format_version")
    if not isinstance(version, int) or version > FORMAT_VERSION:
        raise FileFormatError(
            f"{path} has format version {version}.",
            why=f"This palpate reads versions up to {FORMAT_VERSION}.",
            fix="Open it with a newer palpate.",
        )
    return _with_plain_texts(_load(path))


def _encoding(data: xarray.Dataset) -> dict[str, dict[str, Any]]:
    """Return compression with a checksum, and chunks of whole samples: a reader of a few samples decodes no others."""
    from zarr.codecs import Crc32cCodec, ZstdCodec

    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in data.variables.items():
        encoding[str(name)] = {"compressors": (ZstdCodec(), Crc32cCodec())}
        if name in data.data_vars and variable.dims[:1] == ("sample",) and variable.size:
            count = variable.sizes["sample"]
            rows = min(max(_CHUNK_ROWS, -(-count // _CHUNKS)), CHUNK_BYTES * count // max(variable.nbytes, 1))
            encoding[str(name)]["chunks"] = (min(max(1, rows), count), *variable.shape[1:])
    return encoding


def _with_plain_texts(data: xarray.Dataset) -> xarray.Dataset:
    """Return the arrays with texts that show as they stand, see `plain_text`; changed only where one does not."""
    texts = {str(name): array for name, array in data.variables.items() if array.dtype.kind in "TOU"}
    plain = {
        name: np.array([plain_text(str(text)) for text in array.values.ravel()], dtype=array.dtype)
        for name, array in texts.items()
    }
    changed = {
        name: (texts[name].dims, values.reshape(texts[name].shape), texts[name].attrs)
        for name, values in plain.items()
        if not np.array_equal(values, texts[name].values.ravel())
    }
    return data.assign(changed) if changed else data


def _attributes(path: Path) -> dict[str, Any]:
    """Read the attributes of the store's root from its metadata file."""
    if not path.exists():
        raise FileFormatError(
            f"There is no dataset at {path}.",
            why="Nothing is there.",
            fix="Check the path, or run a sweep that writes it.",
        )
    metadata = path / "zarr.json"
    if not metadata.exists():
        raise FileFormatError(
            f"{path} is no dataset of palpate.",
            why="It isn't a folder with a file zarr.json.",
            fix="Open a store that palpate wrote, a folder NAME.zarr.",
        )
    try:
        attrs = json.loads(read_input(metadata))["attributes"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise _corrupt(path, f"its zarr.json can't be read ({type(error).__name__}).") from error
    if not isinstance(attrs, dict):
        raise _corrupt(path, "the attributes in zarr.json are no table.")
    return attrs


def _load(path: Path) -> xarray.Dataset:
    import xarray

    if part := _part_without_metadata(path):
        raise _corrupt(path, f"its part {part} has no zarr.json.")
    try:
        faults = chunk_faults(path)
        with warnings.catch_warnings():
            # what a file manager leaves in a folder is no part of it
            warnings.filterwarnings(
                "ignore", message=".*is not recognized as a component of a Zarr hierarchy"
            )
            data: xarray.Dataset = xarray.open_zarr(path, consolidated=False, chunks=None)
        written, parts = (data.attrs.pop(name, "") for name in ("checksum", "checksums"))
        if not faults:
            try:
                computed = _checksum(data.load())
            except DAMAGE:
                if not parts:
                    raise
                computed = ""
            if computed == written:
                return data
        return _sound_rows(path, data, faults, json.loads(parts) if parts else {})
    except DAMAGE as error:
        raise _corrupt(path, f"a part of its data is damaged or cut off{_said(error)}.") from error


def _sound_rows(
    path: Path, data: xarray.Dataset, faults: Mapping[str, list[ChunkFault]], checksums: Mapping[str, str]
) -> xarray.Dataset:
    """Return the rows that no damage has reached, with a warning.

    A `ValueError` says that something else than rows is damaged, or that no row is left.
    """
    stated = {name: text for name, text in checksums.items() if name != _PROVENANCE}
    first = next((str(fault) for found in faults.values() for fault in found), "")
    if checksums.get(_PROVENANCE) != _text_checksum(data.attrs["provenance"]) or stated.keys() != set(
        map(str, data.variables)
    ):
        raise ValueError(first or "its contents don't match its checksum")
    lost = np.zeros(data.sizes.get("sample", 0), dtype=bool)
    for name, checksum in stated.items():
        known = faults.get(name, [])
        bad = known + unreadable_chunks(path, name, data[name], known)
        if not bad and _array_checksum(name, data[name].load()) != checksum:
            bad = missing_chunks(path, name)  # which an array has too where all is empty
            if not bad:
                raise ValueError(f"{name} doesn't match its checksum")
        for fault in bad:
            first = first or str(fault)
            lost[fault.rows] = True
    if lost.all() or not lost.any():
        raise ValueError(first or "its contents don't match its checksum")
    warnings.warn(
        f"{int(lost.sum())} of {lost.size} rows of {path} are damaged and left out.\n"
        f"Probably a disk or a copy has changed them: {first}.\n"
        "Copy it again; or delete it and sweep again, if these rows are needed.",
        DataWarning,
        stacklevel=4,
    )
    return data.isel(sample=np.flatnonzero(~lost)).load()


def _said(error: Exception) -> str:
    """Return the first line of what a library said, in brackets; "" if it said nothing."""
    lines = str(error).strip().splitlines()
    return f" ({lines[0].strip().rstrip('.')})" if lines else ""


def _part_without_metadata(path: Path) -> str:
    """Find a variable whose metadata are lost, of which Zarr only warns; "" if there is none."""
    parts = sorted(p for p in path.iterdir() if p.is_dir() and not p.name.startswith((".", "_")))
    return next((p.name for p in parts if not (p / "zarr.json").is_file()), "")


def _checksum(data: xarray.Dataset) -> str:
    """Return the SHA-256 of all variables and the provenance, as hexadecimal digits."""
    origin = json.dumps(json.loads(data.attrs["provenance"]), sort_keys=True)
    return hashlib.sha256((fingerprint(data) + origin).encode()).hexdigest()


def _text_checksum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _corrupt(path: Path, why: str) -> FileFormatError:
    return FileFormatError(
        f"The dataset {path} is corrupt.",
        why=f"Probably a copy was cut short or a file changed: {why}",
        fix="Copy it again, or run the sweep again.",
    )


def _holds(path: Path, data: xarray.Dataset) -> bool:
    """Tell whether the store holds these arrays and this provenance; timings may differ."""
    try:
        stored = read(path)
    except FileFormatError:
        return False
    if json.loads(stored.attrs["provenance"]) != json.loads(data.attrs["provenance"]):
        return False
    return fingerprint(stored, TIMINGS) == fingerprint(data, TIMINGS)
