"""The network file: one safetensors archive of arrays, with everything else as JSON in its header.

safetensors holds plain numbers and a size-checked header, so opening a file can't run code.
The header carries

    palpate   what the archive is: "networks" or a richer kind such as "touch"
    version   of this layout; a reader refuses later ones
    sha256    over the other entries and names, types, shapes and bytes of all arrays
    content   JSON: per network its inputs, outputs and meta; and the archive's own meta
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.network.network import Network, Scaling
from palpate.units import Quantity, Range

__all__ = ["Archive", "load_archive", "save_archive"]

VERSION = 1
_PARTS = ("factors", "shifts", "weights", "tail")
_SCALES = ("input_centre", "input_half", "output_centre", "output_scale")


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
        If the folder does not exist or can't be written.
    """
    from safetensors.numpy import save

    path = Path(path)
    tensors = {f"array/{k}": np.ascontiguousarray(v) for k, v in archive.arrays.items()}
    for name, network in archive.networks.items():
        tensors |= {f"net/{name}/{k}": v for k, v in _tensors(network).items()}
    content = json.dumps(
        {"networks": {k: _describe(v) for k, v in archive.networks.items()}, "meta": dict(archive.meta)}
    )
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
        If the file is missing, truncated, corrupt, foreign, of another kind or from a later version.
    """
    path = Path(path)
    header, tensors = _read(path)
    _check_header(path, header, kind)
    if header.get("sha256") != _digest(tensors, header):
        raise FileFormatError(
            f"{path} is damaged: its contents do not match its checksum.",
            fix="Copy the file again, or make it anew with `palpate learn`.",
        )
    try:
        content = json.loads(header["content"])
        networks = {k: _network(k, v, tensors) for k, v in content["networks"].items()}
        meta = dict(content["meta"])
    except (ValueError, KeyError, TypeError, AttributeError, UsageError) as error:
        raise FileFormatError(
            f"{path} does not describe a network.", why=f"{type(error).__name__}: {error}"
        ) from error
    arrays = {k.removeprefix("array/"): v for k, v in tensors.items() if k.startswith("array/")}
    return Archive(networks, arrays, meta, header["palpate"])


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
            return header, {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - not a mapping
    except (SafetensorError, OSError, ValueError, TypeError, KeyError) as error:
        raise FileFormatError(
            f"{path} is not a network file, or it is truncated.",
            why=str(error),
            fix="Copy the file again, or make it anew with `palpate learn`.",
        ) from error


def _check_header(path: Path, header: Mapping[str, str], kind: str | None) -> None:
    if not {"palpate", "version", "content"} <= header.keys():
        raise FileFormatError(f"{path} is a safetensors file, but not one of palpate's.")
    version = header["version"]
    if not version.isdecimal() or int(version) > VERSION:
        raise FileFormatError(
            f"{path} has file version {version}; this palpate reads up to {VERSION}.", fix="Upgrade palpate."
        )
    if kind is not None and header["palpate"] != kind:
        raise FileFormatError(f"{path} holds {header['palpate']!r}; {kind!r} is needed here.")


def _digest(tensors: Mapping[str, np.ndarray], header: Mapping[str, str]) -> str:
    digest = hashlib.sha256("|".join(header[k] for k in ("palpate", "version", "content")).encode())
    for name in sorted(tensors):
        a = tensors[name]
        digest.update(f"{name}|{a.dtype.str}|{a.shape}".encode())
        digest.update(a.tobytes())
    return digest.hexdigest()


def _tensors(network: Network) -> dict[str, np.ndarray]:
    parts = {k: getattr(network, k) for k in _PARTS} | {k: getattr(network.scaling, k) for k in _SCALES}
    return {k: np.ascontiguousarray(v, dtype=np.float64) for k, v in parts.items()}


def _describe(network: Network) -> dict[str, Any]:
    return {
        "inputs": [asdict(r) for r in network.inputs],
        "outputs": [asdict(q) for q in network.outputs],
        "meta": dict(network.meta),
    }


def _network(name: str, description: Mapping[str, Any], tensors: Mapping[str, np.ndarray]) -> Network:
    part = {k: tensors[f"net/{name}/{k}"] for k in _PARTS + _SCALES}
    if not all(np.issubdtype(a.dtype, np.float64) and np.isfinite(a).all() for a in part.values()):
        raise ValueError(f"the arrays of network {name!r} are not all finite double-precision numbers")
    inputs = tuple(Range(**r) for r in description["inputs"])
    outputs = tuple(Quantity(**q) for q in description["outputs"])
    scaling = Scaling(*(part[k] for k in _SCALES))
    return Network(inputs, outputs, scaling=scaling, meta=description["meta"], **{k: part[k] for k in _PARTS})
