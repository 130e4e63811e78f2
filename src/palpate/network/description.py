"""A network as JSON and named arrays, and back with every part checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from palpate.network.network import Network
from palpate.network.scaling import Scaling
from palpate.units import Quantity, Range

__all__ = ["describe", "described", "quantity_of", "range_of"]

_PARTS = ("factors", "shifts", "weights", "tail")
_SCALES = ("input_centre", "input_half", "output_centre", "output_scale")
_EXTRA = "extra/"
_KEYS = {"inputs": list, "outputs": list, "meta": dict}
_NEW_KEYS = {"radial": str, "basis": bool, "extras": list}


def describe(network: Network) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What JSON tells of a network, and its arrays by name."""
    parts = {k: getattr(network, k) for k in _PARTS} | {k: getattr(network.scaling, k) for k in _SCALES}
    if network.basis is not None:
        parts["basis"] = network.basis
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


def described(description: Mapping[str, Any], arrays: Mapping[str, np.ndarray], *, old: bool) -> Network:
    """The network of a description and exactly its arrays; `old` ones say nothing of kernel and basis.

    Raises
    ------
    ValueError, TypeError, UsageError
        If anything is missing, too much, or not what it must be.
    """
    keys = _KEYS if old else _KEYS | _NEW_KEYS
    _exactly(description, keys)
    if old:
        description = {**description, "radial": "gaussian", "basis": False, "extras": []}
    names = {*_PARTS, *_SCALES, *(["basis"] if description["basis"] else [])}
    extras = {k.removeprefix(_EXTRA): v for k, v in arrays.items() if k.startswith(_EXTRA)}
    plain = {k: v for k, v in arrays.items() if not k.startswith(_EXTRA)}
    if plain.keys() != names or sorted(extras) != description["extras"]:
        raise ValueError(f"its arrays are {sorted(arrays)}, which is not what a network has")
    for name, array in plain.items():
        if array.dtype != np.float64:
            raise TypeError(f"{name} holds {array.dtype} numbers; double precision is needed")
    return Network(
        inputs=tuple(range_of(r) for r in description["inputs"]),
        outputs=tuple(quantity_of(q) for q in description["outputs"]),
        factors=plain["factors"],
        shifts=plain["shifts"],
        weights=plain["weights"],
        tail=plain["tail"],
        scaling=Scaling(*(plain[k] for k in _SCALES)),
        meta=description["meta"],
        radial=description["radial"],
        basis=plain.get("basis"),
        extras=extras,
    )


def _exactly(found: Any, keys: Mapping[str, type]) -> None:
    if not isinstance(found, dict) or found.keys() != keys.keys():
        raise ValueError(f"a description of {sorted(keys)} is needed")
    for key, kind in keys.items():
        # a bool is an int to Python, but not to us; a whole number may stand for a float
        allowed = (int, float) if kind is float else (kind,)
        if type(found[key]) not in allowed:
            raise TypeError(f"{key} is {found[key]!r:.40}, not of type {kind.__name__}")


def range_of(found: Any) -> Range:
    """A range from its JSON, checked."""
    _exactly(found, {"name": str, "low": float, "high": float, "unit": str})
    return Range(found["name"], float(found["low"]), float(found["high"]), found["unit"])


def quantity_of(found: Any) -> Quantity:
    """A quantity from its JSON, checked."""
    _exactly(found, {"name": str, "unit": str})
    return Quantity(found["name"], found["unit"])
