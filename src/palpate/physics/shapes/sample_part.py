"""A part to try things with: the surface of a kidney-like organ, made by a formula."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from palpate.errors import UsageError
from palpate.files import write_file
from palpate.output_files import SAMPLE_HEAD

__all__ = ["kidney_surface", "write_sample_part"]

HALF_AXES = (0.055, 0.030, 0.022)  # m, of the ellipsoid that is bent
BEND = 0.20  # by how much the two poles lie to the side of the middle, over the half length
POLES = 0.10  # by how much thicker one pole is than the middle, and the other thinner
HILUM = 0.007  # m, depth of the dent in the hollow side
HILUM_SIZE = (0.014, 0.012)  # m, half sizes of the dent along x and z
FLAT = 0.18  # share of its height that the underside is flattened by
SUBDIVISIONS = 4  # of an icosahedron: 5,120 triangles with edges of about 4 mm


def kidney_surface(subdivisions: int = SUBDIVISIONS) -> tuple[np.ndarray, np.ndarray]:
    """Return the closed surface of a kidney-like organ that lies on its flattened side, about 110 × 60 × 40 mm.

    An ellipsoid with one pole thicker than the other, bent, dented in its hollow and flattened below. Each step moves
    points along one axis by a function that grows along it, so the surface never cuts itself. It is a smooth stand-in,
    no patient's anatomy.

    The 20 triangles of an icosahedron are divided into four `subdivisions` times. Returns points (n, 3) in m, the
    lowest at z = 0, and triangles (t, 3), counter-clockwise as seen from outside.
    """
    from trimesh.creation import icosphere

    sphere = icosphere(subdivisions=subdivisions)
    a, b, c = HALF_AXES
    x, y, z = np.asarray(sphere.vertices).T
    thick = 1 + POLES * x
    dent = HILUM * np.exp(-((a * x / HILUM_SIZE[0]) ** 2) - (c * z / HILUM_SIZE[1]) ** 2)
    across = b * thick * y + BEND * a * x * x - dent * ((1 + y) / 2) ** 2
    upright = c * thick * z * np.where(z < 0, 1 - FLAT * z * z, 1.0)
    points = np.stack([a * x, across, upright - upright.min()], axis=1)
    return points, np.asarray(sphere.faces, dtype=np.int64)


def write_sample_part(path: str | os.PathLike[str]) -> Path:
    """Write the kidney-like organ as a binary STL file in mm; the name ends in .stl."""
    from trimesh import Trimesh

    path = Path(path)
    if path.suffix.lower() != ".stl":
        raise UsageError(
            f"The sample part can't be written to {path}.",
            why="It is a surface in the format STL.",
            fix=f"Name a file such as {path.with_suffix('.stl')}.",
        )
    points, triangles = kidney_surface()
    surface = Trimesh(np.round(1e3 * points, 4), triangles, process=False)
    content = surface.export(file_type="stl")
    assert isinstance(content, bytes)
    write_file(path, SAMPLE_HEAD.ljust(80) + content[80:])
    return path
