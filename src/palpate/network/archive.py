"""The file of everything learnt: an archive of networks, arrays and JSON, checked part by part when it is read.

    save_archive(path, Archive(networks, arrays, meta, kind))     load_archive(path, kind=…)

A checksum tells accidents only, so everything read is also checked to be what it must be: a file made with bad
intent ends in `FileFormatError` or in a network of finite answers. Frozen dataclasses go in and out of an archive
through `palpate.network.codec`. The content of a container is JSON of

    networks   for each network its inputs, outputs, radial function, whether it has a basis, the names of its
               further arrays, and meta; its arrays are the tensors ``net/<name>/…``
    meta       the archive's own; its arrays are the tensors ``array/…``
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.input_files import plain_texts
from palpate.network.container import MAKE_ANEW, Container, read_container, write_container
from palpate.network.network import Network, Scaling
from palpate.network.soundness import flaw
from palpate.units import Quantity, Range

__all__ = [
    "Archive",
    "load_archive",
    "load_single_network",
    "network_to_json",
    "quantity_from_json",
    "range_from_json",
    "save_archive",
]

_WORDS = {
    "networks": "a network of data",
    "surrogate": "a learnt body",
    "held-paths": "load histories",
    "touched-surface": "a touched surface",
}
_WAYS = {
    "networks": "`palpate ask {0} --at …` answers, `palpate export c {0}` and `palpate export onnx {0}` export it.",
    "surrogate": "`palpate view {0}` shows it, `palpate run {0}` times it, `palpate ask {0} --at …` answers.",
}
_PARTS = ("factors", "shifts", "weights", "tail")
_SCALES = ("input_centre", "input_half", "output_centre", "output_scale")
_BEND = "input_bend"  # an array of a network whose inputs' scales are bent
_EXTRA = "extra/"
_KEYS = {"inputs": list, "outputs": list, "meta": dict}
_KEYS_SINCE_2 = {"radial": str, "basis": bool, "extras": list}


@dataclass(frozen=True, eq=False)
class Archive:
    """The contents of one file.

    Attributes
    ----------
    networks : mapping of name to Network
        Networks by name; a name has no slash.
    arrays : mapping of name to array
        Further arrays, such as rest positions.
    meta : mapping
        JSON-able settings and provenance.
    kind : str
        The sort of thing that the parts make up: "networks" for networks alone.
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
    tensors = {f"array/{k}": np.ascontiguousarray(v) for k, v in archive.arrays.items()}
    networks = {}
    for name, network in archive.networks.items():
        fault = "its name has a slash" if "/" in name else flaw(network)
        if fault:
            raise UsageError(f"Network {name!r} can't be saved: {fault}.", fix="Learn it again.")
        networks[name], parts = network_to_json(network)
        tensors |= {f"net/{name}/{k}": v for k, v in parts.items()}
    try:
        content = json.dumps({"networks": networks, "meta": dict(archive.meta)})
    except (TypeError, ValueError) as error:
        raise UsageError(
            "Settings that go with a network can't be saved.",
            why=str(error),
            fix="Keep text, numbers, lists and dictionaries of them in `meta`.",
        ) from error
    return write_container(path, Container(archive.kind, content, tensors))


def load_archive(path: str | os.PathLike[str], *, kind: str | None = None) -> Archive:
    """Read an archive back, bit for bit.

    Parameters
    ----------
    path : path
        The file.
    kind : str, optional
        Refuse archives of another kind.

    Raises
    ------
    FileFormatError
        If the file is missing, truncated, corrupt, foreign, of another kind, from a later version, or
        describes no network that could be evaluated.
    """
    container = read_container(path)
    if kind is not None and container.kind != kind:
        raise FileFormatError(
            f"{path} holds {_WORDS.get(container.kind, repr(container.kind))}; "
            f"{_WORDS.get(kind, repr(kind))} is needed here.",
            why="Learnt bodies, networks of data and load histories are files of different kinds.",
            fix=_WAYS.get(container.kind, "`palpate ask` says what the file holds.").format(path)
            + " `palpate learn` writes a learnt body, `palpate fit` a network.",
        )
    try:
        return _archive(container)
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
            f"{path} does not describe a network.", why=f"{type(error).__name__}: {error}", fix=MAKE_ANEW
        ) from error


def load_single_network(path: str | os.PathLike[str]) -> Network:
    """Return the only network of an archive, read as `load_archive` does; more or fewer than one are refused."""
    networks = load_archive(path, kind=Archive.kind).networks
    if len(networks) != 1:
        raise FileFormatError(
            f"{path} holds {len(networks)} networks, not one.", fix="Read it with load_archive."
        )
    return next(iter(networks.values()))


def _archive(container: Container) -> Archive:
    content = plain_texts(json.loads(container.content, object_pairs_hook=_distinct))
    if not (isinstance(content, dict) and isinstance(content["meta"], dict)):
        raise TypeError("its content is not a mapping")
    tensors = dict(container.tensors)
    networks: dict[str, Network] = {}
    for name, description in content["networks"].items():
        begin = f"net/{name}/"
        own = {k.removeprefix(begin): tensors.pop(k) for k in list(tensors) if k.startswith(begin)}
        networks[name] = _network_from_json(description, own, old=container.version == "1")
        if fault := flaw(networks[name]):
            raise ValueError(f"network {name!r}: {fault}")
    arrays = {k.removeprefix("array/"): v for k, v in tensors.items() if k.startswith("array/")}
    if len(arrays) != len(tensors):
        raise ValueError("it holds arrays that belong to nothing")
    return Archive(networks, arrays, content["meta"], container.kind)


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object; one key given twice is refused, since readers differ in which they take."""
    if len({k for k, _ in pairs}) != len(pairs):
        raise ValueError("a key stands twice in its description")
    return dict(pairs)


def network_to_json(network: Network) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the JSON description of a network, and its arrays by name."""
    parts = {k: getattr(network, k) for k in _PARTS} | {k: getattr(network.scaling, k) for k in _SCALES}
    if network.basis is not None:
        parts["basis"] = network.basis
    if network.scaling.is_bent:
        parts[_BEND] = network.scaling.input_bend
    arrays = {k: np.ascontiguousarray(v, dtype=np.float64) for k, v in parts.items()}
    arrays |= {_EXTRA + k: np.ascontiguousarray(v) for k, v in network.extras.items()}
    description = {
        "inputs": [asdict(r) for r in network.inputs],
        "outputs": [asdict(q) for q in network.outputs],
        "radial": network.radial,
        "basis": network.basis is not None,
        "extras": sorted(network.extras),
        "meta": dict(network.meta),
    }
    return description, arrays


def _network_from_json(
    description: Mapping[str, Any], arrays: Mapping[str, np.ndarray], *, old: bool = False
) -> Network:
    """Return the network of a description and exactly its arrays; `old` ones don't mention kernel and basis."""
    _exactly(description, _KEYS if old else _KEYS | _KEYS_SINCE_2)
    if old:
        description = {**description, "radial": "gaussian", "basis": False, "extras": []}
    names = {*_PARTS, *_SCALES, *(["basis"] if description["basis"] else [])}
    extras = {k.removeprefix(_EXTRA): v for k, v in arrays.items() if k.startswith(_EXTRA)}
    plain = {k: v for k, v in arrays.items() if not k.startswith(_EXTRA)}
    if plain.keys() - {_BEND} != names or sorted(extras) != description["extras"]:
        raise ValueError(f"its arrays are {sorted(arrays)}, which is not what a network has")
    for name, array in plain.items():
        if array.dtype != np.float64:
            raise TypeError(f"{name} holds {array.dtype} numbers; double precision is needed")
    return Network(
        inputs=tuple(range_from_json(r) for r in description["inputs"]),
        outputs=tuple(quantity_from_json(q) for q in description["outputs"]),
        factors=plain["factors"],
        shifts=plain["shifts"],
        weights=plain["weights"],
        tail=plain["tail"],
        scaling=Scaling(*(plain[k] for k in _SCALES), plain.get(_BEND)),  # type: ignore[arg-type]
        meta=description["meta"],
        radial=description["radial"],
        basis=plain.get("basis"),
        extras=extras,
    )


def range_from_json(description: Any) -> Range:
    """A range from its JSON, checked."""
    _exactly(description, {"name": str, "low": float, "high": float, "unit": str})
    low, high = float(description["low"]), float(description["high"])
    return Range(description["name"], low, high, description["unit"])


def quantity_from_json(description: Any) -> Quantity:
    """A quantity from its JSON, checked."""
    _exactly(description, {"name": str, "unit": str})
    return Quantity(description["name"], description["unit"])


def _exactly(description: Any, keys: Mapping[str, type]) -> None:
    if not isinstance(description, dict) or description.keys() != keys.keys():
        raise ValueError(f"a description of {sorted(keys)} is needed")
    for key, kind in keys.items():
        # a bool is an int to Python, but not to us; a whole number may stand for a float
        allowed = (int, float) if kind is float else (kind,)
        if type(description[key]) not in allowed:
            raise TypeError(f"{key} is {description[key]!r:.40}, not of type {kind.__name__}")
