"""A touch surrogate in one file: a network archive of its own kind, with every part checked when read."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.network import Archive, TrainedRegion, save_archive
from palpate.surrogates.continuation import Continuation
from palpate.surrogates.file_parts import doubles, finite, number, read
from palpate.surrogates.laws import ContactLaw
from palpate.surrogates.surface import TouchedSurface

if TYPE_CHECKING:
    from palpate.surrogates.touch_surrogate import TouchSurrogate

__all__ = ["KIND", "archive_of", "load_surrogate", "save_surrogate", "surrogate_of"]

KIND = "touch-surrogate"
_NETWORK, _SURFACE = "log-factor", "surface/"
_KEYS = {"law", "length", "radius", "radius_input", "region_radius", "deepest", "depth_width", "meta"}


def save_surrogate(path: str | os.PathLike[str], surrogate: TouchSurrogate) -> Path:
    """Write a surrogate; the file appears whole or not at all.

    Raises
    ------
    UsageError
        If the folder does not exist or can't be written, or `meta` holds what JSON does not know.
    """
    return save_archive(path, archive_of(surrogate))


def archive_of(surrogate: TouchSurrogate) -> Archive:
    """What its file holds."""
    going, region = surrogate.continuation, surrogate.region
    assert going is not None
    arrays = {_SURFACE + k: v for k, v in surrogate.surface.arrays().items()} | {"widths": going.widths}
    if region is not None:
        arrays["region"] = region.points
    if surrogate.root is not None:
        arrays["root"] = surrogate.root
    meta = {
        "law": surrogate.law.name,
        "length": finite(surrogate.law.length),
        "radius": finite(surrogate.radius),
        "radius_input": surrogate.radius_input,
        "region_radius": None if region is None else region.radius,
        "deepest": finite(going.deepest),
        "depth_width": going.depth_width,
        "meta": dict(surrogate.meta),
    }
    return Archive({_NETWORK: surrogate.network}, arrays, meta, KIND)


def load_surrogate(path: str | os.PathLike[str]) -> TouchSurrogate:
    """Read a surrogate back, bit for bit.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign or from a later version, or its parts do not fit.
    """
    return read(path, KIND, "a touch surrogate", surrogate_of)


def surrogate_of(archive: Archive) -> TouchSurrogate:
    """The surrogate that an archive holds.

    Raises
    ------
    KeyError, TypeError, ValueError, UsageError
        If it holds none, or its parts do not fit.
    """
    from palpate.surrogates.touch_surrogate import TouchSurrogate

    meta, arrays = archive.meta, dict(archive.arrays)
    if meta.keys() != _KEYS or archive.networks.keys() != {_NETWORK} or not isinstance(meta["meta"], dict):
        raise ValueError("it is not described as one")
    own = meta["radius_input"]
    if own is not None and type(own) is not int:
        raise TypeError(f"its radius is input {own!r}")
    surface = {k.removeprefix(_SURFACE): arrays.pop(k) for k in list(arrays) if k.startswith(_SURFACE)}
    region = arrays.pop("region", None)
    going = Continuation(
        doubles(arrays.pop("widths")), number(meta, "deepest", math.inf), number(meta, "depth_width")
    )
    root = arrays.pop("root", None)
    if arrays:
        raise ValueError(f"it holds {sorted(arrays)}, which belong to nothing")
    return TouchSurrogate(
        network=archive.networks[_NETWORK],
        law=ContactLaw(meta["law"], number(meta, "length", math.inf)),
        surface=TouchedSurface.from_arrays(surface),
        radius=number(meta, "radius", math.nan),
        radius_input=own,
        region=None if region is None else TrainedRegion(doubles(region), number(meta, "region_radius")),
        continuation=going,
        root=None if root is None else doubles(root),
        meta=meta["meta"],
    )
