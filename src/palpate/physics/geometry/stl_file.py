"""Closed surfaces from STL files, filled with tetrahedra."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.physics.geometry.checks import require_size
from palpate.physics.geometry.files import UNITS, read_with_meshio
from palpate.physics.geometry.mesh import BodyMesh, body_mesh
from palpate.physics.geometry.refinement import GRADING, THREADS, FineMesh, require_budget
from palpate.physics.geometry.sampling import points_on, scattered
from palpate.physics.geometry.segments import SurfacePatch, patched, segments
from palpate.physics.geometry.triangulation import Triangulation, merged, require_closed

__all__ = ["fill", "named", "read_stl"]

LENGTH = 100.0  # longest side in the units in which Netgen meshes: its tolerances are those of millimetres
SHARP = (
    0.05  # weight of a normal's direction against distance over the body's length, when faces are told apart
)


def read_stl(path: str, unit: str) -> Triangulation:
    """The cleaned surface of an STL file in m.

    Raises
    ------
    FileFormatError
        If the file is no STL file.
    UsageError
        If the surface bounds no body, or its size tells of mistaken units.
    """
    mesh = read_with_meshio(path)
    blocks = [np.asarray(block.data) for block in mesh.cells if block.type == "triangle"]
    if not blocks or not sum(map(len, blocks)) or not np.isfinite(mesh.points).all():
        raise FileFormatError(
            f"The file {path} holds no surface of finite triangles.",
            why="It is empty, cut short or damaged.",
            fix="Export the surface again.",
        )
    surface = merged(np.asarray(mesh.points, dtype=float) * UNITS[unit], np.concatenate(blocks))
    require_size(path, surface.longest, unit)
    require_closed(surface, path)
    return surface


def named(surface: Triangulation, patches: tuple[SurfacePatch, ...], angle: float) -> BodyMesh:
    """The surface, split along sharp edges into ``face 1``, ``face 2``, …; a mesh without tetrahedra."""
    part = segments(surface, angle)
    names = [f"face {i + 1}" for i in range(part.max() + 1)]
    surfaces, surface_of = patched(names, part, surface.corners.mean(axis=1), patches)
    return BodyMesh(
        surface.points, np.empty((0, 4)), surface.triangles, surface_of, np.empty(0), surfaces, ("body",)
    )


def fill(skin: BodyMesh, volume: float, coarse: float, refinements: tuple[FineMesh, ...]) -> BodyMesh:
    """Tetrahedra inside a closed surface, whose triangles are renewed.

    Parameters
    ----------
    skin : BodyMesh
        The surface with its names, in m.
    volume : float
        Enclosed, in m³.
    coarse : float
        Largest element size in m.
    refinements : tuple of FineMesh

    Raises
    ------
    UsageError
        If there would be too many elements, or Netgen can't mesh the body.
    """
    low, high = skin.corners
    scale = LENGTH / float((high - low).max())
    fine = [(*points_on(skin, refinement), refinement.element) for refinement in refinements]
    require_budget([(volume, coarse)], [(area, size) for _, area, size in fine])
    geometry = _geometry(skin.points[skin.triangles] * scale)
    netgen = _filled(geometry, coarse * scale, [(at * scale, size * scale) for at, _, size in fine])
    netgen.Scale(1 / scale)
    return _renamed(body_mesh(netgen), skin)


def _geometry(corners: np.ndarray) -> Any:
    """The triangles (t, 3, 3) as Netgen's geometry, which only a file can be made of."""
    from netgen.stl import STLGeometry

    a, b, c = np.moveaxis(corners, 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lines = ["solid body"]
    for normal, triangle in zip(normals.tolist(), corners.tolist(), strict=True):
        lines.append("facet normal {!r} {!r} {!r}\nouter loop".format(*normal))
        lines.extend("vertex {!r} {!r} {!r}".format(*corner) for corner in triangle)
        lines.append("endloop\nendfacet")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "body.stl"
        path.write_text("\n".join([*lines, "endsolid body"]) + "\n", encoding="ascii")
        return STLGeometry(str(path))


def _filled(geometry: Any, coarse: float, fine: list[tuple[np.ndarray, float]]) -> Any:
    import ngsolve
    from netgen.meshing import NgException

    ngsolve.SetNumThreads(1)
    rows = [(*point, size) for points, size in fine for point in points.tolist()]
    try:
        with tempfile.TemporaryDirectory() as folder:
            # Netgen takes sizes at points of such a geometry from a file only
            sizes = Path(folder) / "sizes.txt"
            lines = [str(len(rows)), *(" ".join(map(repr, row)) for row in rows), "0"]
            sizes.write_text("\n".join(lines) + "\n", encoding="ascii")
            return geometry.GenerateMesh(
                maxh=coarse, grading=GRADING, meshsizefilename=str(sizes), nthreads=THREADS
            )
    except NgException as error:
        raise UsageError(
            f"Netgen could not mesh the surface: {str(error).strip()}.",
            why="Its triangles are too slender or its details too fine for the element size.",
            fix=f"Remesh the surface evenly, or choose elements smaller than {coarse / LENGTH:.2g} of the length.",
        ) from error


def _renamed(mesh: BodyMesh, skin: BodyMesh) -> BodyMesh:
    """Give each new triangle the name of the nearest old one that faces the same way."""
    from scipy.spatial import cKDTree

    low, high = skin.corners
    length = float((high - low).max())
    corners, origin = scattered(skin.points[skin.triangles], length / 100)
    known = np.hstack([corners.mean(axis=1) / length, SHARP * skin.normals[origin]])
    wanted = np.hstack([mesh.points[mesh.triangles].mean(axis=1) / length, SHARP * mesh.normals])
    _, nearest = cKDTree(known).query(wanted)
    index = skin.surface_of[origin[nearest]]
    present = np.unique(index)
    position = np.full(len(skin.surfaces), -1)
    position[present] = np.arange(len(present))
    surfaces = tuple(skin.surfaces[i] for i in present)
    return replace(mesh, surface_of=position[index], surfaces=surfaces, regions=("body",))
