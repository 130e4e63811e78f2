"""Datasets on disk: each is a Zarr store (format 3) with a checksum over everything in it."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset.schema import FORMAT, FORMAT_VERSION, TIMINGS
from palpate.dataset.stored_sizes import require_stored_sizes
from palpate.errors import FileFormatError, UsageError
from palpate.files import writing_folder
from palpate.input_files import read_input

if TYPE_CHECKING:
    import xarray

__all__ = ["fingerprint", "read", "write"]

CHUNK_BYTES = 4_000_000  # some 50 samples of 3,000 nodes; a file each


def fingerprint(data: xarray.Dataset, exclude: Iterable[str] = ()) -> str:
    """Return the SHA-256 of all variables and coordinates but `exclude`, as hexadecimal digits."""
    digest = hashlib.sha256()
    for name in sorted(set(map(str, data.variables)) - set(exclude)):
        values = data[name].values
        digest.update(f"{name} {data[name].dims} {values.shape}".encode())
        if values.dtype.kind in "TOU":
            digest.update("\0".join(map(str, values.ravel())).encode())
        else:
            digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def write(data: xarray.Dataset, path: Path, *, overwrite: bool) -> Path:
    """Write a dataset's arrays to `path`; the store appears whole or not at all."""
    if path.exists() and not overwrite:
        if _holds(path, data):
            return path
        raise UsageError(
            f"{path} exists already.",
            why="It holds something else than the dataset to be saved.",
            fix="Save under another name, delete it, or pass overwrite=True.",
        )
    if path.exists() and not (path / "zarr.json").is_file():
        raise UsageError(
            f"{path} won't be overwritten.",
            why="It is no Zarr store.",
            fix="Save under another name, or delete it yourself.",
        )
    stamped = data.assign_attrs(checksum=_checksum(data))
    with writing_folder(path) as staging:
        # consolidated metadata is no part of Zarr's format 3
        stamped.to_zarr(staging, mode="w-", zarr_format=3, consolidated=False, encoding=_chunks(data))
    return path


def read(path: Path) -> xarray.Dataset:
    """Read and check the arrays in the store at `path`."""
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
    return _load(path)


def _chunks(data: xarray.Dataset) -> dict[str, dict[str, Any]]:
    """Return chunks of whole samples for large fields, so that a reader of a few samples decodes no others."""
    encoding = {}
    for name, variable in data.data_vars.items():
        if variable.nbytes > CHUNK_BYTES and variable.dims[0] == "sample":
            row = variable.nbytes // variable.sizes["sample"]
            encoding[str(name)] = {"chunks": (max(1, CHUNK_BYTES // row), *variable.shape[1:])}
    return encoding


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
        require_stored_sizes(path)
        with warnings.catch_warnings():
            # what a file manager leaves in a folder is no part of it
            warnings.filterwarnings(
                "ignore", message=".*is not recognized as a component of a Zarr hierarchy"
            )
            data: xarray.Dataset = xarray.open_zarr(path, consolidated=False, chunks=None).load()
        written = data.attrs.pop("checksum", "none")
        computed = _checksum(data)
    # the kinds of errors that Zarr, its codecs and xarray raise on broken bytes
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, AttributeError) as error:
        raise _corrupt(path, f"a part of its data is damaged or cut off{_said(error)}.") from error
    if computed != written:
        raise _corrupt(
            path, f"its contents don't match its checksum ({computed[:12]} against {written[:12]})."
        )
    return data


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
