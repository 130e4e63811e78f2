"""Closed surfaces of STL files: read, cleaned, searched for faults, split into named parts, filled with tetrahedra."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.files import TemporaryFolder
from palpate.physics.apart import read_apart
from palpate.physics.shapes.body_file import UNITS, SurfacePatch, apply_patches, read_with_meshio, segments
from palpate.physics.shapes.mesh import BodyMesh, body_mesh
from palpate.physics.shapes.meshing import (
    GRADING,
    THREADS,
    FineMesh,
    points_on,
    require_budget,
    split_triangles,
)
from palpate.physics.shapes.shape import require_size

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["fill_surface", "name_parts", "read_stl", "require_closed", "unite_points"]

FLUSH = 1e-6  # of the body's length, below which two faces lie on each other
LENGTH = 100.0  # longest side in the units in which Netgen meshes: its tolerances are those of millimetres
SHARP = (
    0.05  # weight of a normal's direction against distance over the body's length, where faces are compared
)


def unite_points(points: np.ndarray, triangles: np.ndarray) -> Trimesh:
    """Return a surface whose coinciding points are united and whose triangles without area are dropped.

    Parameters
    ----------
    points : (n, 3) array
        Positions in m; those that agree to about 1e-6 of the body's length are one.
    triangles : (t, 3) int array
        Nodes, counter-clockwise as seen from outside.
    """
    from trimesh import Trimesh

    surface = Trimesh(points, triangles, process=False)
    tolerance = 1e-6 * float(surface.extents.max() or 1.0)
    surface.merge_vertices(digits_vertex=round(-np.log10(tolerance)))
    surface.update_faces(surface.area_faces > tolerance**2 / 2)
    return surface


def require_closed(surface: Trimesh, source: str) -> None:
    """Refuse a surface that bounds no body: empty, open, not a manifold, facing inwards or cutting itself.

    Raises
    ------
    UsageError
        Naming the fault, how many edges have it and where.
    """
    if not len(surface.faces):
        raise UsageError(
            f"{source} holds no triangles.",
            why="The file is empty.",
            fix="Export the surface of the body again.",
        )
    edges, count = surface.edges_unique, np.bincount(surface.edges_unique_inverse)
    open_edges, crowded = edges[count == 1], edges[count > 2]
    if len(open_edges):
        raise UsageError(
            f"The surface of {source} is open: {len(open_edges)} edges belong to one triangle only.",
            why=f"There is a hole {_where(surface, open_edges)}, and a body needs a closed surface.",
            fix="Close the hole in the program that made the file, with its repair or fill-holes function.",
        )
    if len(crowded):
        raise UsageError(
            f"The surface of {source} is not a manifold: {len(crowded)} edges belong to more than two triangles.",
            why=f"Sheets meet {_where(surface, crowded)}, so that inside and outside are not defined.",
            fix="Remove inner walls and doubled sheets, or unite touching bodies, before the export.",
        )
    if not surface.is_winding_consistent:
        twice = len(surface.edges) - len(np.unique(surface.edges, axis=0))
        raise UsageError(
            f"The triangles of {source} disagree on which side is outside, along {twice} edges.",
            why="Some of them are inverted: their corners run the other way than their neighbours'.",
            fix="Make the normals consistent (recalculate outside) and export again.",
        )
    if surface.volume < 0:
        raise UsageError(
            f"The surface of {source} is inside out.",
            why="Its triangles face inwards, so that the body would be everything around it.",
            fix="Flip the normals and export again.",
        )
    if (crossing := _crossing(surface)) is not None:
        place = ", ".join(f"{v:.4g}" for v in surface.triangles_center[crossing[0]])
        raise UsageError(
            f"The surface of {source} cuts itself: triangles {crossing[0]} and {crossing[1]} cross.",
            why=f"They do so near ({place}) m; a body's surface has an inside and an outside everywhere.",
            fix="Unite overlapping parts (Boolean union) in the program that made the file.",
        )

    if (contact := _contact(surface)) is not None:
        first, second, centre = contact
        where = ", ".join(f"{v:.4g}" for v in centre)
        raise UsageError(
            f"Closed shells {first} and {second} of the surface of {source} touch around ({where}) m.",
            why="Faces of them lie on each other and share no nodes, so that the body is neither one nor two.",
            fix="Unite the parts (Boolean union) in the program that made the file, or move them apart.",
        )


def _where(surface: Trimesh, edges: np.ndarray) -> str:
    middle = surface.vertices[edges].mean(axis=(0, 1))
    return "around (" + ", ".join(f"{v:.4g}" for v in middle) + ") m"


def _crossing(surface: Trimesh) -> tuple[int, int] | None:
    """Two triangles that cross without sharing a node; None where there are none."""
    corners, nodes = np.asarray(surface.triangles), np.asarray(surface.faces)
    for i, near in _neighbours(corners, 0.0):
        near = near[~(nodes[near][:, :, None] == nodes[i]).any(axis=(1, 2))]
        if len(near):
            mine = np.broadcast_to(corners[i], (len(near), 3, 3))
            hit = _pierces(mine, corners[near]) | _pierces(corners[near], mine)
            if hit.any():
                return int(i), int(near[hit.argmax()])
    return None


def _neighbours(corners: np.ndarray, slack: float) -> Iterator[tuple[int, np.ndarray]]:
    """Yield each triangle of (t, 3, 3) with those after it, in x, whose boxes come within `slack` m of its own."""
    low, high = corners.min(axis=1) - slack, corners.max(axis=1)
    order = np.argsort(low[:, 0], kind="stable")
    starts = low[order, 0]
    for rank, i in enumerate(order):
        stop = int(np.searchsorted(starts, high[i, 0], side="right"))
        others = order[rank + 1 : stop]
        overlaps = (low[others] <= high[i]) & (high[others] >= low[i])
        yield int(i), others[overlaps.all(axis=1)]


def _contact(surface: Trimesh) -> tuple[int, int, np.ndarray] | None:
    """Two closed shells, counted from 1, with faces in one plane that overlap, and where in m; None without such."""
    from trimesh.graph import connected_component_labels

    shell = connected_component_labels(surface.face_adjacency, node_count=len(surface.faces))
    if not shell.any():
        return None
    corners, normals = np.asarray(surface.triangles), np.asarray(surface.face_normals)
    tolerance = FLUSH * float(surface.extents.max())
    for i, near in _neighbours(corners, tolerance):
        near = near[(shell[near] != shell[i]) & (np.abs(normals[near] @ normals[i]) > 1 - FLUSH)]
        distance = np.abs((corners[near] - corners[i, 0]) @ normals[i]).max(axis=1, initial=0.0)
        near = near[distance < tolerance]
        touching = near[_overlap(corners[i], corners[near], normals[i], tolerance)]
        if len(touching):
            first, second = sorted((int(shell[i]) + 1, int(shell[touching[0]]) + 1))
            return first, second, corners[touching].mean(axis=(0, 1))
    return None


def _overlap(corners: np.ndarray, others: np.ndarray, normal: np.ndarray, tolerance: float) -> np.ndarray:
    """Mask (n,) of the triangles (n, 3, 3) that share an area with one in the same plane: no edge separates them."""
    together = np.ones(len(others), dtype=bool)
    for triangles in (np.broadcast_to(corners, others.shape), others):
        edges = np.roll(triangles, -1, axis=1) - triangles
        across = np.cross(edges, normal)
        across /= np.linalg.norm(across, axis=2, keepdims=True)
        mine = np.einsum("nek,ck->nec", across, corners)
        theirs = np.einsum("nek,nck->nec", across, others)
        depth = np.minimum(mine.max(axis=2), theirs.max(axis=2)) - np.maximum(
            mine.min(axis=2), theirs.min(axis=2)
        )
        together &= (depth > tolerance).all(axis=1)
    return together


def _pierces(edges_of: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Mask (n,) of pairs (n, 3, 3) in which an edge of the first triangle passes through the inside of the second.

    Segment against triangle by Möller & Trumbore 1997 (J. Graph. Tools 2, 21-28).
    """
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    hit = np.zeros(len(triangles), dtype=bool)
    for k in range(3):
        start = edges_of[:, k]
        along = edges_of[:, (k + 1) % 3] - start
        across = np.cross(along, v)
        determinant = np.einsum("ni,ni->n", u, across)
        slanted = np.abs(determinant) > 1e-12 * np.linalg.norm(u, axis=1) * np.linalg.norm(across, axis=1)
        scale = 1 / np.where(slanted, determinant, 1.0)
        reach = start - a
        turned = np.cross(reach, u)
        p = scale * np.einsum("ni,ni->n", reach, across)
        q = scale * np.einsum("ni,ni->n", along, turned)
        t = scale * np.einsum("ni,ni->n", v, turned)
        edge = 1e-9
        hit |= slanted & (p > edge) & (q > edge) & (p + q < 1 - edge) & (t > edge) & (t < 1 - edge)
    return hit


def read_stl(path: str, unit: str) -> Trimesh:
    """Read the surface of an STL file, cleaned, in m.

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
    surface = unite_points(np.asarray(mesh.points, dtype=float) * UNITS[unit], np.concatenate(blocks))
    require_size(path, float(surface.extents.max()), unit)
    require_closed(surface, path)
    return surface


def name_parts(surface: Trimesh, patches: tuple[SurfacePatch, ...], angle: float) -> BodyMesh:
    """Return the surface, split along sharp edges into ``face 1``, ``face 2``, …; a mesh without tetrahedra."""
    part = segments(surface, angle)
    names = [f"face {i + 1}" for i in range(part.max() + 1)]
    surfaces, surface_of = apply_patches(names, part, surface.triangles_center, patches, surface.face_normals)
    return BodyMesh(
        surface.vertices, np.empty((0, 4)), surface.faces, surface_of, np.empty(0), surfaces, ("body",)
    )


def fill_surface(skin: BodyMesh, volume: float, coarse: float, refinements: tuple[FineMesh, ...]) -> BodyMesh:
    """Return tetrahedra inside a closed surface, whose triangles are renewed.

    Parameters
    ----------
    skin : BodyMesh
        The surface with its names, in m.
    volume : float
        Volume that the surface encloses, m³.
    coarse : float
        Largest element size in m.
    refinements : tuple of FineMesh
        Parts of surfaces that shall have smaller elements.

    Raises
    ------
    UsageError
        If there would be too many elements, or Netgen can't mesh the body.
    SolverError
        If Netgen ends its process or takes too long.
    """
    low, high = skin.corners
    scale = LENGTH / float((high - low).max())
    fine = [(*points_on(skin, refinement), refinement.element) for refinement in refinements]
    require_budget([(volume, coarse)], [(area, size) for _, area, size in fine])
    sizes = [(at * scale, size * scale) for at, _, size in fine]
    work = (skin.points * scale, skin.triangles, coarse * scale, sizes, 1 / scale)
    return _rename_surfaces(read_apart(_fill, *work, doing="meshing a closed surface"), skin)


def _fill(
    points: np.ndarray,
    triangles: np.ndarray,
    coarse: float,
    sizes: list[tuple[np.ndarray, float]],
    scale: float,
) -> BodyMesh:
    """Return the mesh inside a surface, scaled: a function for the child process in which Netgen runs."""
    mesh = _generate_mesh(_stl_geometry(points, triangles), coarse, sizes)
    mesh.Scale(scale)
    return body_mesh(mesh)


def _stl_geometry(points: np.ndarray, triangles: np.ndarray) -> Any:
    """Return Netgen's geometry of a surface, which only a file can be made into."""
    from netgen.stl import STLGeometry
    from trimesh import Trimesh

    with TemporaryFolder() as folder:
        path = folder / "body.stl"
        # as text, which keeps all digits
        Trimesh(points, triangles, process=False).export(str(path), file_type="stl_ascii")
        return STLGeometry(str(path))


def _generate_mesh(geometry: Any, coarse: float, fine: list[tuple[np.ndarray, float]]) -> Any:
    import ngsolve
    from netgen.meshing import NgException

    ngsolve.SetNumThreads(1)
    rows = [(*point, size) for points, size in fine for point in points.tolist()]
    try:
        with TemporaryFolder() as folder:
            # Netgen takes sizes at points of such a geometry from a file only
            sizes = folder / "sizes.txt"
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


def _rename_surfaces(mesh: BodyMesh, skin: BodyMesh) -> BodyMesh:
    """Give each new triangle the name of the nearest old one that faces the same way."""
    from scipy.spatial import cKDTree

    low, high = skin.corners
    length = float((high - low).max())
    corners, origin = split_triangles(skin.points[skin.triangles], length / 100)
    known = np.hstack([corners.mean(axis=1) / length, SHARP * skin.normals[origin]])
    wanted = np.hstack([mesh.points[mesh.triangles].mean(axis=1) / length, SHARP * mesh.normals])
    _, nearest = cKDTree(known).query(wanted)
    index = skin.surface_of[origin[nearest]]
    present = np.unique(index)
    position = np.full(len(skin.surfaces), -1)
    position[present] = np.arange(len(present))
    surfaces = tuple(skin.surfaces[i] for i in present)
    return replace(mesh, surface_of=position[index], surfaces=surfaces, regions=("body",))
