"""The distance of a touched surface is built once for a dataset and kept in its store."""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import FileFormatError, UsageError
from palpate.network.container import Container, read_container, write_container
from palpate.surrogates import TouchedSurface

__all__ = ["touched_surface"]

NAME = ".touched_surface"  # in the folder of the store, where Zarr looks for no array
KIND = "touched-surface"
BUILT = 2  # another number where distances of the same surface are built otherwise


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
    kept = _read(path, digest.hexdigest())
    if kept is not None:
        return kept
    surface = TouchedSurface.of(points, triangles, **lengths)
    with contextlib.suppress(UsageError):  # a store that can't be written to is as good to learn from
        write_container(path, Container(KIND, digest.hexdigest(), surface.arrays()))
    return surface


def _read(path: Path, digest: str) -> TouchedSurface | None:
    """Return the surface that is kept at a path, None if there is none or another."""
    if not path.is_file():
        return None
    try:
        container = read_container(path)
        if (container.kind, container.content) != (KIND, digest):
            return None
        return TouchedSurface.from_arrays(container.tensors)
    except FileFormatError:  # it is built anew
        return None
