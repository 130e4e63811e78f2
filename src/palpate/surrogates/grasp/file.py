"""A grasp surrogate in one file: a network archive of its own kind, with every part checked when read."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from palpate.network import Archive, TrainedRegion, save_archive
from palpate.surrogates.continuation import Continuation
from palpate.surrogates.file_parts import doubles, number, read
from palpate.surrogates.grasp.rest import RestStiffness
from palpate.surrogates.grasp.stiffening import Stiffening
from palpate.surrogates.grasp.surrogate import GraspSurrogate

__all__ = ["KIND", "archive_of", "grasp_of", "load_grasp", "save_grasp"]

KIND = "grasp-surrogate"
_NETWORK = "log-factor"


def save_grasp(path: str | os.PathLike[str], surrogate: GraspSurrogate) -> Path:
    """Write a surrogate; the file appears whole or not at all.

    Raises
    ------
    UsageError
        If the folder does not exist or can't be written, or `meta` holds what JSON does not know.
    """
    return save_archive(path, archive_of(surrogate))


def archive_of(surrogate: GraspSurrogate) -> Archive:
    """What its file holds."""
    going, region = surrogate.continuation, surrogate.region
    assert going is not None
    assert surrogate.stiffening is not None
    arrays = {
        "widths": going.widths,
        "rest": surrogate.rest.coefficients,
        "stiffening": surrogate.stiffening.coefficients,
        "exponents": surrogate.stiffening.exponents,
    }
    if region is not None:
        arrays["region"] = region.points
    if surrogate.root is not None:
        arrays["root"] = surrogate.root
    meta = {"region_radius": None if region is None else region.radius, "meta": dict(surrogate.meta)}
    return Archive({_NETWORK: surrogate.network}, arrays, meta, KIND)


def load_grasp(path: str | os.PathLike[str]) -> GraspSurrogate:
    """Read a surrogate back, bit for bit.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign or from a later version, or its parts do not fit.
    """
    return read(path, KIND, "a grasp surrogate", grasp_of)


def grasp_of(archive: Archive) -> GraspSurrogate:
    """The surrogate that an archive holds.

    Raises
    ------
    KeyError, TypeError, ValueError, UsageError
        If it holds none, or its parts do not fit.
    """
    meta, arrays = archive.meta, dict(archive.arrays)
    known = meta.keys() == {"region_radius", "meta"} and isinstance(meta["meta"], dict)
    if not known or archive.networks.keys() != {_NETWORK}:
        raise ValueError("it is not described as one")
    network = archive.networks[_NETWORK]
    region, root = arrays.pop("region", None), arrays.pop("root", None)
    going = Continuation(doubles(arrays.pop("widths")))
    rest = RestStiffness(doubles(arrays.pop("rest")), len(network.inputs) - 3)
    stiffening = Stiffening(doubles(arrays.pop("stiffening")), _whole(arrays.pop("exponents")))
    if arrays:
        raise ValueError(f"it holds {sorted(arrays)}, which belong to nothing")
    return GraspSurrogate(
        network=network,
        rest=rest,
        stiffening=stiffening,
        region=None if region is None else TrainedRegion(doubles(region), number(meta, "region_radius")),
        continuation=going,
        root=None if root is None else doubles(root),
        meta=meta["meta"],
    )


def _whole(array: np.ndarray) -> np.ndarray:
    if array.dtype != np.int64:
        raise TypeError(f"its exponents are {array.dtype} numbers, not whole ones")
    return array
