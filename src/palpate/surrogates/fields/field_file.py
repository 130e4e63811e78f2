"""Fields in a file: alone, or beside the energy of the same body; every part is checked when read."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.network import Archive, Network, save_archive
from palpate.surrogates.continuation import Continuation
from palpate.surrogates.fields.depth_amplitude import DepthAmplitude
from palpate.surrogates.fields.local_mode import LocalMode, Variation
from palpate.surrogates.file_parts import finite, number, read
from palpate.surrogates.surface import TouchedSurface

if TYPE_CHECKING:
    from palpate.surrogates.fields.field_surrogate import FieldSurrogate

__all__ = ["KIND", "arrays_of", "described", "field_of", "load_field", "save_field"]

KIND = "field-surrogate"
_NETWORK, _SURFACE = "coefficients", "surface/"
_OWN = ("modes", "rest", "points", "triangles", "mass")
_VARIED, _PARTS = "varied/", ("table", "powers", "axes", "scales")
_KEYS = {
    "name",
    "unit",
    "amplitude",
    "deepest",
    "length",
    "radius",
    "radius_input",
    "reach",
    "within",
    "widths",
}
_KEYS |= {"trained", "trained_width", "meta"}


def save_field(path: str | os.PathLike[str], field: FieldSurrogate) -> Path:
    """Write a field; the file appears whole or not at all.

    Raises
    ------
    UsageError
        If the folder does not exist or can't be written, or `meta` holds what JSON does not know.
    """
    arrays = arrays_of(field) | {_SURFACE + k: v for k, v in field.surface.arrays().items()}
    return save_archive(path, Archive({_NETWORK: field.network}, arrays, described(field), KIND))


def load_field(path: str | os.PathLike[str]) -> FieldSurrogate:
    """Read a field back, bit for bit.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign or from a later version, or its parts do not fit.
    """
    return read(path, KIND, "a field", _alone)


def _alone(archive: Archive) -> FieldSurrogate:
    arrays = dict(archive.arrays)
    taken = {k: arrays.pop(k) for k in list(arrays) if k.startswith(_SURFACE)}
    surface = TouchedSurface.from_arrays({k.removeprefix(_SURFACE): v for k, v in taken.items()})
    (network,) = archive.networks.values()
    return field_of(network, arrays, archive.meta, surface)


def arrays_of(field: FieldSurrogate) -> dict[str, np.ndarray]:
    """Its own arrays, network and surface apart."""
    arrays = {name: getattr(field, name) for name in _OWN}
    if field.local_mode is not None:
        arrays |= {"table": field.local_mode.table}
        if (own := field.local_mode.variation) is not None:
            arrays |= {_VARIED + name: getattr(own, name) for name in _PARTS}
    return arrays


def described(field: FieldSurrogate) -> dict[str, Any]:
    """All that is no array, for JSON."""
    going, amplitude, local_mode = field.continuation, field.amplitude, field.local_mode
    assert going is not None
    return {
        "name": field.name,
        "unit": field.unit,
        "amplitude": amplitude.name,
        "deepest": amplitude.deepest,
        "length": finite(amplitude.length),
        "radius": finite(field.radius),
        "radius_input": field.radius_input,
        "reach": None if local_mode is None else local_mode.reach,
        "within": None if local_mode is None else local_mode.within,
        "widths": going.widths.tolist(),
        "trained": finite(going.deepest),
        "trained_width": going.depth_width,
        "meta": dict(field.meta),
    }


def field_of(
    network: Network, arrays: Mapping[str, np.ndarray], meta: Mapping[str, Any], surface: TouchedSurface
) -> FieldSurrogate:
    """The field whose parts these are.

    Raises
    ------
    KeyError, TypeError, ValueError, UsageError
        If they are not those of one.
    """
    from palpate.surrogates.fields.field_surrogate import FieldSurrogate

    expected = {*_OWN, *(("table",) if meta.get("reach") is not None else ())}
    varies = meta.get("reach") is not None and any(name.startswith(_VARIED) for name in arrays)
    expected |= {_VARIED + name for name in _PARTS} if varies else set()
    if meta.keys() != _KEYS or arrays.keys() != expected or not isinstance(meta["meta"], dict):
        raise ValueError("it is not described as one")
    own = meta["radius_input"]
    if own is not None and type(own) is not int:
        raise TypeError(f"its radius is input {own!r}")
    if not (isinstance(meta["name"], str) and isinstance(meta["unit"], str)):
        raise TypeError("its name or unit is no text")
    kinds = {"triangles": np.int64, _VARIED + "powers": np.int64}
    for name, array in arrays.items():
        if array.dtype != kinds.get(name, np.float64):
            raise TypeError(f"its {name} holds {array.dtype} numbers")
    local_mode = None
    if meta["reach"] is not None:
        variation = Variation(**{name: arrays[_VARIED + name] for name in _PARTS}) if varies else None
        local_mode = LocalMode(arrays["table"], number(meta, "reach"), number(meta, "within"), variation)
    widths = np.array([number({"width": w}, "width") for w in meta["widths"]])
    return FieldSurrogate(
        name=meta["name"],
        unit=meta["unit"],
        network=network,
        **{name: arrays[name] for name in _OWN},
        amplitude=DepthAmplitude(
            meta["amplitude"], number(meta, "deepest"), number(meta, "length", math.inf)
        ),
        surface=surface,
        radius=number(meta, "radius", math.nan),
        local_mode=local_mode,
        radius_input=own,
        continuation=Continuation(widths, number(meta, "trained", math.inf), number(meta, "trained_width")),
        meta=meta["meta"],
    )
