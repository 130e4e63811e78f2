"""The distance of a touched surface, and its overlap, are built once for a dataset and kept in its store."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import FileFormatError, UsageError
from palpate.network.container import Container, read_container, write_container
from palpate.surrogates import TouchedSurface
from palpate.surrogates.surface import Overlap

__all__ = ["touched_overlap", "touched_surface"]

NAME = ".touched_surface"  # in the folder of the store, where Zarr looks for no array
KIND = "touched-surface"
OVERLAP_NAME, OVERLAP_KIND = ".overlap", "overlap"
OVERLAP_BUILT = 1
BUILT = 3  # another number where distances of the same surface are built otherwise


def touched_surface(
    data: Dataset, points: np.ndarray, triangles: np.ndarray, *, radius: float, inner: float, shoulder: float
) -> TouchedSurface:
    """Return the distance of a surface: that which the dataset's store keeps, or a new one, which it keeps then.

    The surface's points (P, 3) are at rest, in m, its triangles (t, 3); the lengths in m are those of
    `TouchedSurface.of`. A dataset that was not read from a store keeps nothing.
    """
    lengths = {"radius": radius, "inner": inner, "shoulder": shoulder}
    digest = hashlib.sha256(f"{BUILT} {sorted(lengths.items())}".encode())
    digest.update(np.ascontiguousarray(points[triangles]).tobytes())
    folder = data.folder
    if folder is None:
        return TouchedSurface.of(points, triangles, **lengths)
    path = folder / NAME
    tensors = _read(path, KIND, digest.hexdigest())
    if tensors is not None:
        with contextlib.suppress(FileFormatError):  # it is built anew
            return TouchedSurface.from_arrays(tensors)
    surface = TouchedSurface.of(points, triangles, **lengths)
    with contextlib.suppress(UsageError):  # a store that can't be written to is as good to learn from
        write_container(path, Container(KIND, digest.hexdigest(), surface.arrays()))
    return surface


def touched_overlap(
    data: Dataset, surface: TouchedSurface, points: np.ndarray, triangles: np.ndarray
) -> Overlap | None:
    """Return the overlap of a ball on a surface made of these triangles, kept beside its distance; None if flat."""
    if surface.profile.size:
        return None
    digest = hashlib.sha256(f"{OVERLAP_BUILT}".encode())
    for array in (points[triangles], surface.coefficients):
        digest.update(np.ascontiguousarray(array).tobytes())
    path = None if data.folder is None else data.folder / OVERLAP_NAME
    tensors = None if path is None else _read(path, OVERLAP_KIND, digest.hexdigest())
    if tensors is not None:
        with contextlib.suppress(KeyError, ValueError):
            return Overlap.from_arrays(surface, tensors)
    overlap = Overlap.of(surface, points, triangles)
    if path is not None and overlap is not None:
        with contextlib.suppress(UsageError):
            write_container(path, Container(OVERLAP_KIND, digest.hexdigest(), overlap.arrays()))
    return overlap


def _read(path: Path, kind: str, digest: str) -> Mapping[str, np.ndarray] | None:
    """Return the arrays that are kept at a path, None if there are none or others."""
    if not path.is_file():
        return None
    try:
        container = read_container(path)
    except FileFormatError:  # it is built anew
        return None
    return container.tensors if (container.kind, container.content) == (kind, digest) else None
