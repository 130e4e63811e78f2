"""The network file: one safetensors archive of arrays, with everything else as JSON in its header.

safetensors holds plain numbers and a size-checked header, so opening a file can't run code.
The header carries

    palpate   what the archive is: "networks" or a richer kind such as "touch"
    version   of this layout; a reader refuses later ones
    sha256    over the other entries and names, types, shapes and bytes of all arrays
    content   JSON: per network its inputs, outputs, radial function, whether it has a basis, the names of its
              further arrays, and meta; and the archive's own meta

A checksum only tells accidents: everything read is also checked to be what it must be, so that a file made with
bad intent ends in `FileFormatError` or in a network of finite answers. Version 1 knew Gaussian units only.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.network.description import describe, described
from palpate.network.network import Network
from palpate.network.soundness import flaw

__all__ = ["Archive", "load_alone", "load_archive", "save_archive"]

VERSION = 2
_LOADERS = {
    "networks": "palpate.Network.load or palpate.Fitted.load",
    "touch": "palpate.TouchModel.load",
    "touched-body": "palpate.TouchedBody.load",
    "touch-surrogate": "palpate.TouchSurrogate.load",
    "field-surrogate": "palpate.surrogates.FieldSurrogate.load",
    "grasp-surrogate": "palpate.GraspSurrogate.load",
    "held-body": "palpate.HeldBody.load",
    "held-paths": "palpate.learning.plastic.HeldPaths.load",
}
"""What reads a file of a kind, for the message where it is given to another."""
_KINDS = {"BOOL", "U8", "I8", "U16", "I16", "U32", "I32", "U64", "I64", "F16", "F32", "F64"}
_MAKE = "Copy the file again, or make it anew with `palpate learn`."


@dataclass(frozen=True, eq=False)
class Archive:
    """What one file holds.

    Attributes
    ----------
    networks : mapping of name to Network
    arrays : mapping of name to array
        Further arrays, such as rest positions.
    meta : mapping
        JSON-able settings and provenance.
    kind : str
    """

    networks: Mapping[str, Network]
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)
    meta: Mapping[str, Any] = field(default_factory=dict)
    kind: str = "networks"


def save_archive(path: str | os.PathLike[str], archive: Archive) -> Path:
    """Write an archive; the file appears whole or not at all.

    Raises
    ------
    UsageError
        If the folder does not exist or can't be written, or the archive holds what no reader would take: a
        network whose numbers can't be evaluated, a name with a slash, settings that JSON does not know.
    """
    from safetensors.numpy import save

    path = Path(path)
    content, tensors = _content(archive)
    header = {"palpate": archive.kind, "version": str(VERSION), "content": content}
    header["sha256"] = _digest(tensors, header)
    temporary = path.with_name(path.name + ".part")
    try:
        temporary.write_bytes(save(tensors, header))
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise UsageError(
            f"Could not write {path}.", why=str(error), fix="Choose a folder that exists."
        ) from error
    return path


def _content(archive: Archive) -> tuple[str, dict[str, np.ndarray]]:
    tensors = {f"array/{k}": np.ascontiguousarray(v) for k, v in archive.arrays.items()}
    described_networks = {}
    for name, network in archive.networks.items():
        fault = "its name has a slash" if "/" in name else flaw(network)
        if fault:
            raise UsageError(f"Network {name!r} can't be saved: {fault}.", fix="Learn it again.")
        described_networks[name], parts = describe(network)
        tensors |= {f"net/{name}/{k}": v for k, v in parts.items()}
    try:
        return json.dumps({"networks": described_networks, "meta": dict(archive.meta)}), tensors
    except (TypeError, ValueError) as error:
        raise UsageError(
            "Settings that go with a network can't be saved.",
            why=str(error),
            fix="Keep text, numbers, lists and dictionaries of them in `meta`.",
        ) from error


def load_archive(path: str | os.PathLike[str], *, kind: str | None = None) -> Archive:
    """Read an archive back, bit for bit.

    Parameters
    ----------
    path : path
    kind : str, optional
        Refuse archives of another kind.

    Raises
    ------
    FileFormatError
        If the file is missing, truncated, corrupt, foreign, of another kind, from a later version, or
        describes no network that could be evaluated.
    """
    path = Path(path)
    header, tensors = _read(path)
    _check_header(path, header, kind)
    if header.get("sha256") != _digest(tensors, header):
        raise FileFormatError(
            f"{path} is damaged: its contents do not match its checksum.",
            fix=_MAKE,
        )
    try:
        return _archive(header, tensors)
    except (
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        OverflowError,
        RecursionError,
        UsageError,
    ) as error:
        raise FileFormatError(
            f"{path} does not describe a network.", why=f"{type(error).__name__}: {error}", fix=_MAKE
        ) from error


def load_alone(path: str | os.PathLike[str]) -> Network:
    """The only network of an archive.

    Raises
    ------
    FileFormatError
        As `load_archive`, or if the archive holds more or less than one network.
    """
    networks = load_archive(path, kind=Archive.kind).networks
    if len(networks) != 1:
        raise FileFormatError(
            f"{path} holds {len(networks)} networks, not one.", fix="Read it with load_archive."
        )
    return next(iter(networks.values()))


def _archive(header: Mapping[str, str], tensors: dict[str, np.ndarray]) -> Archive:
    content = json.loads(header["content"], object_pairs_hook=_distinct)
    if not (isinstance(content, dict) and isinstance(content["meta"], dict)):
        raise TypeError("its content is not a mapping")
    old = header["version"] == "1"
    networks: dict[str, Network] = {}
    for name, description in content["networks"].items():
        begin = f"net/{name}/"
        own = {k.removeprefix(begin): tensors.pop(k) for k in list(tensors) if k.startswith(begin)}
        networks[name] = described(description, own, old=old)
        if fault := flaw(networks[name]):
            raise ValueError(f"network {name!r}: {fault}")
    arrays = {k.removeprefix("array/"): v for k, v in tensors.items() if k.startswith("array/")}
    if len(arrays) != len(tensors):
        raise ValueError("it holds arrays that belong to nothing")
    return Archive(networks, arrays, content["meta"], header["palpate"])


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object; one key given twice is refused, since readers differ in which they take."""
    if len({k for k, _ in pairs}) != len(pairs):
        raise ValueError("a key stands twice in its description")
    return dict(pairs)


def _read(path: Path) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        what = "is a folder, not a network file" if path.is_dir() else "does not exist"
        raise FileFormatError(
            f"{path} {what}.", fix="`palpate learn` writes such a file; or give the path of another."
        )
    try:
        with safe_open(path, framework="numpy") as file:
            header = dict(file.metadata() or {})
            return header, {name: _tensor(file, name) for name in file.keys()}  # noqa: SIM118 - not a mapping
    except (SafetensorError, OSError, ValueError, TypeError, KeyError) as error:
        raise FileFormatError(
            f"{path} is not a network file, or it is truncated.",
            why=str(error),
            fix=_MAKE,
        ) from error


def _tensor(file: Any, name: str) -> np.ndarray:
    kind = file.get_slice(name).get_dtype()
    if kind not in _KINDS:  # asked for these, NumPy refuses in ways that differ
        raise TypeError(f"{name!r} holds numbers of kind {kind}")
    return np.asarray(file.get_tensor(name))


def _check_header(path: Path, header: Mapping[str, str], kind: str | None) -> None:
    if not {"palpate", "version", "content"} <= header.keys():
        raise FileFormatError(f"{path} is a safetensors file, but not one of palpate's.")
    version = header["version"]
    if version not in {str(v) for v in range(1, VERSION + 1)}:
        raise FileFormatError(
            f"{path} has file version {version}; this palpate reads up to {VERSION}.", fix="Upgrade palpate."
        )
    if kind is not None and header["palpate"] != kind:
        raise FileFormatError(
            f"{path} holds {header['palpate']!r}; {kind!r} is needed here.",
            why="What was learnt of a beam, of a pressed or held body and of arrays are files of different kinds.",
            fix=f"Read it with {_LOADERS.get(header['palpate'], 'what wrote it')}, or give a file of the other kind.",
        )


def _digest(tensors: Mapping[str, np.ndarray], header: Mapping[str, str]) -> str:
    digest = hashlib.sha256("|".join(header[k] for k in ("palpate", "version", "content")).encode())
    for name in sorted(tensors):
        a = tensors[name]
        digest.update(f"{name}|{a.dtype.str}|{a.shape}".encode())
        digest.update(a.tobytes())
    return digest.hexdigest()
