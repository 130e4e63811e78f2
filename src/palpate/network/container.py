"""The container under every ``.palpate`` file: arrays and one JSON text in a safetensors archive.

safetensors holds plain numbers and a size-checked header, so opening a file can't run code.
The header carries

    palpate   the kind of the archive: "networks" or a richer one
    version   of this layout; a reader refuses later ones
    sha256    over the other entries and names, types, shapes and bytes of all arrays
    content   JSON text, which `palpate.network.archive` writes and reads

A checksum only tells accidents; a file made with bad intent is for the reader of the content to refuse.
Version 1 knew Gaussian units only.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.file_kinds import file_kind, way_for
from palpate.files import write_file
from palpate.input_files import open_input
from palpate.output_files import is_own

__all__ = ["MAKE_ANEW", "Container", "read_container", "write_container"]

VERSION = 2
MAKE_ANEW = "Copy the file again, or make it anew with `palpate learn`."
_HEADER_MAX = 100_000_000  # bytes of a header, as safetensors allows
_KINDS = {"BOOL", "U8", "I8", "U16", "I16", "U32", "I32", "U64", "I64", "F16", "F32", "F64"}


@dataclass(frozen=True, eq=False)
class Container:
    """The raw parts of one file."""

    kind: str  # the sort of thing that the file holds
    content: str  # JSON text
    tensors: Mapping[str, np.ndarray]  # arrays of plain numbers by name
    version: str = str(VERSION)  # version of the layout, "1" to the latest

    @property
    def header(self) -> dict[str, str]:
        """The safetensors metadata: kind, version, content, and the checksum over these and the arrays."""
        digest = hashlib.sha256("|".join((self.kind, self.version, self.content)).encode())
        for name in sorted(self.tensors):
            a = self.tensors[name]
            digest.update(f"{name}|{a.dtype.str}|{a.shape}".encode())
            digest.update(a.tobytes())
        return {
            "palpate": self.kind,
            "version": self.version,
            "content": self.content,
            "sha256": digest.hexdigest(),
        }


def write_container(path: str | os.PathLike[str], container: Container) -> Path:
    """Write a container; the file appears whole or not at all, and replaces none but an archive of palpate's.

    A full disk or a write-protected folder ends in a ResourceError.
    """
    from safetensors.numpy import save

    target = Path(path)
    if target.is_file() and target.stat().st_size and not is_own(target):
        raise UsageError(
            f"{target} exists already, and palpate did not write it.",
            why="What was learnt would take its place.",
            fix="Choose another name, or remove the file yourself.",
        )
    return write_file(target, _in_order(save(dict(container.tensors), container.header)))


def _in_order(archive: bytes) -> bytes:
    """Return an archive with the entries of its metadata in the order of their names.

    safetensors writes them in one that differs from call to call, so that the same body would be another file each
    time; a recorded touch knows its body again by the checksum of the file.
    """
    end = 8 + int.from_bytes(archive[:8], "little")
    table = json.loads(archive[8:end])
    table["__metadata__"] = dict(sorted(table["__metadata__"].items()))
    text = json.dumps(table, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)  # the numbers behind it begin at a multiple of eight bytes
    return b"".join((len(text).to_bytes(8, "little"), text, archive[end:]))


def read_container(path: str | os.PathLike[str]) -> Container:
    """Read a container back, bit for bit; refuse one that is truncated, corrupt, foreign or of a later version."""
    path = Path(path)
    header, tensors = _read(path)
    if not {"palpate", "version", "content"} <= header.keys():
        raise FileFormatError(f"{path} is a safetensors file, but not one of palpate's.")
    if header["version"] not in {str(v) for v in range(1, VERSION + 1)}:
        raise FileFormatError(
            f"{path} has file version {header['version']}; this palpate reads up to {VERSION}.",
            fix="Upgrade palpate.",
        )
    container = Container(header["palpate"], header["content"], tensors, header["version"])
    if header.get("sha256") != container.header["sha256"]:
        raise FileFormatError(f"{path} is damaged: its contents do not match its checksum.", fix=MAKE_ANEW)
    return container


def _read(path: Path) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        state = "is a folder, not a network file" if path.is_dir() else "does not exist"
        raise FileFormatError(
            f"{path} {state}.", fix="`palpate learn` writes such a file; or give the path of another."
        )
    _refuse_foreign(path)
    try:
        with safe_open(path, framework="numpy") as file:
            header = dict(file.metadata() or {})
            return header, {name: _tensor(file, name) for name in file.keys()}  # noqa: SIM118 - not a mapping
    except (SafetensorError, OSError, ValueError, TypeError, KeyError) as error:
        raise FileFormatError(
            f"{path} is cut off or damaged: its contents are not where its first bytes say.", fix=MAKE_ANEW
        ) from error


def _refuse_foreign(path: Path) -> None:
    """Refuse a file that doesn't begin as an archive does: eight bytes of a length, then as many of a JSON table."""
    with open_input(path) as file:
        begin = file.read(9)
    if not begin:
        raise FileFormatError(f"{path} is empty.", fix=MAKE_ANEW)
    if begin[8:] == b"{" and int.from_bytes(begin[:8], "little") < _HEADER_MAX:
        return
    if file_kind(path) == "a model file":
        raise FileFormatError(f"{path} is not a .palpate file, or its beginning is lost.", fix=MAKE_ANEW)
    kind = f": it is {file_kind(path)}" if file_kind(path) else ""
    way = way_for(path) or "Give the path of a .palpate file, as `palpate learn` writes it."
    raise FileFormatError(f"{path} is not a .palpate file{kind}.", fix=way)


def _tensor(file: Any, name: str) -> np.ndarray:
    kind = file.get_slice(name).get_dtype()
    if kind not in _KINDS:  # asked for these, NumPy refuses in ways that differ
        raise TypeError(f"{name!r} holds numbers of kind {kind}")
    return np.asarray(file.get_tensor(name))
