"""Closed surfaces of the formats that scanners, segmentations and modelling programs write, as triangles.

STL is read here, OBJ, PLY, OFF and GLB by trimesh, VTK's polydata by PyVista in a child process. What comes of all of
them goes the same way: repaired, searched for faults, filled.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.file_kinds import part_ending
from palpate.physics.shapes.naming import plain_name
from palpate.physics.shapes.packed_file import read_part, require_counts
from palpate.physics.shapes.polygon_faces import split_concave_polygons
from palpate.physics.shapes.stl_text import parse_stl
from palpate.physics.shapes.surface_repair import Surface
from palpate.physics.shapes.vtk_file import read_polydata

__all__ = ["parse_surface"]

Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # glTF has y upwards


def parse_surface(path: str) -> Surface:
    """Return the triangles of a surface's file in its own unit; polygons are cut into triangles.

    Reads STL, OBJ, PLY, OFF, GLB, VTP or legacy polydata, also packed with gzip.
    """
    content, ending = read_part(path), part_ending(path)
    if ending == ".stl":
        return parse_stl(path, content)
    require_counts(path, content)
    if ending in {".vtp", ".vtk"}:
        surface = _surface([("", *read_polydata(path))])
    else:
        surface = _surface(_read_scene(path, content, ending.removeprefix(".")))
    if ending == ".glb":
        surface = _turn_upright(surface)
    _require_sound(path, surface)
    return surface


def _read_scene(path: str, content: bytes, kind: str) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return name, points and triangles of each mesh of a file that trimesh reads, at its place."""
    from trimesh import Trimesh, load_scene

    # groups of an OBJ file are names of its parts; pictures and materials are of no use here
    more: dict[str, Any] = {
        "obj": {"skip_materials": True, "split_groups": True, "group_material": False}
    }.get(kind, {})
    more = {"skip_materials": True} if kind == "glb" else more
    try:
        content = split_concave_polygons(content) if kind == "obj" else content
        scene = load_scene(io.BytesIO(content), file_type=kind, process=False, **more)
        parts = [(name, *scene.graph[name]) for name in scene.graph.nodes_geometry]
    except (
        *(ValueError, KeyError, IndexError, TypeError, AttributeError, NotImplementedError),
        *(AssertionError, OverflowError, ArithmeticError, UnicodeError, RecursionError, OSError),
    ) as error:
        raise _damaged(path, kind, str(error).partition("\n")[0] or type(error).__name__) from error
    meshes = []
    for name, matrix, key in parts:
        mesh = scene.geometry[key]
        if isinstance(mesh, Trimesh) and len(mesh.faces):
            if np.shape(mesh.vertices)[1:] != (3,):
                raise _damaged(path, kind, "A vertex has not three coordinates")
            points = np.asarray(mesh.vertices, dtype=float) @ matrix[:3, :3].T + matrix[:3, 3]
            turned = np.linalg.det(matrix[:3, :3]) < 0
            meshes.append((str(name), points, np.asarray(mesh.faces)[:, ::-1] if turned else mesh.faces))
    return meshes


def _surface(parts: list[tuple[str, np.ndarray, np.ndarray]]) -> Surface:
    """Return parts as one surface, whose names are theirs where there are several."""
    sizes = [len(points) for _, points, _ in parts]
    starts = np.cumsum([0, *sizes[:-1]])
    labels: dict[str, int] = {}
    label_of = [
        np.full(len(triangles), labels.setdefault(plain_name(name) if name else "", len(labels)))
        for name, _, triangles in parts
    ]
    join: Callable[[list[np.ndarray]], np.ndarray] = np.concatenate
    return Surface(
        join([np.empty((0, 3)), *(points for _, points, _ in parts)]),
        join(
            [
                np.empty((0, 3), dtype=np.int64),
                *(
                    start + np.asarray(t, dtype=np.int64)
                    for start, (_, _, t) in zip(starts, parts, strict=False)
                ),
            ]
        ),
        join([np.empty(0, dtype=np.int64), *label_of]),
        tuple(labels) or ("",),
    )


def _turn_upright(surface: Surface) -> Surface:
    from dataclasses import replace

    turned = replace(surface, points=surface.points @ Z_UP.T)
    return turned.with_note("Its y points upwards, as glTF has it; the body was turned so that z does.")


def _require_sound(path: str, surface: Surface) -> None:
    """Refuse a surface without triangles, with triangles of nodes that are not there, or with nodes at no place."""
    if not len(surface.triangles):
        raise UsageError(
            f"{path} holds no triangles.",
            why="It is empty, or holds points or lines alone, as raw scans do.",
            fix="Make a closed surface of the points in the program that made the file, and export that.",
        )
    low, high = int(surface.triangles.min()), int(surface.triangles.max())
    if low < 0 or high >= len(surface.points):
        raise FileFormatError(
            f"A triangle of {path} has a corner that is not there.",
            why=f"Its corners are numbered up to {high if low >= 0 else low}, of {len(surface.points)} nodes.",
            fix="Export the surface again.",
        )
    bad = ~np.isfinite(surface.points[surface.triangles]).all(axis=(1, 2))
    if bad.any():
        raise FileFormatError(
            f"{int(bad.sum())} triangles of {path} have corners that are no finite numbers.",
            why=f"The first is triangle {int(bad.argmax()) + 1}.",
            fix="Export the surface again.",
        )


def _damaged(path: str, kind: str, said: str) -> FileFormatError:
    return FileFormatError(
        f"The file {path} can't be read as {kind.upper()}.",
        why=f"It is corrupt, cut short or of another format ({said}).",
        fix="Open it in the program that made it and export it again, as STL for example.",
    )
