"""Closed surfaces of files: read, repaired, searched for faults, split into named parts, filled with tetrahedra."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.files import TemporaryFolder
from palpate.format import millimetres
from palpate.physics.apart import read_apart
from palpate.physics.shapes.body_file import UNITS, SurfacePatch, apply_patches, segments, tell_repairs
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
from palpate.physics.shapes.surface_checks import require_closed, shells_of, surface_gap
from palpate.physics.shapes.surface_file import parse_surface
from palpate.physics.shapes.surface_repair import Surface, is_manifold, open_edges, place, repair_surface
from palpate.physics.shapes.surface_simplify import MANY, TOLERANCE, simplify_surface
from palpate.physics.shapes.surface_wrap import wrap_surface

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["bodies_apart", "fill_surface", "name_parts", "read_surface"]

LENGTH = 100.0  # longest side in the units in which Netgen meshes: its tolerances are those of millimetres
WRAP_SIMPLIFIED = 0.05  # of a wrap's size: how far its many small triangles are simplified
FLAT = 1e-7  # thickness over length below which a surface lies in a plane
# weight of a normal's direction against distance over the body's length, where faces are compared
SHARP = 0.05


def read_surface(
    path: str, unit: str, simplify: float | None = None, wrap: float | None = None
) -> tuple[Trimesh, Surface, Surface]:
    """Read the surface of a file, repaired, simplified if it is large, and searched for faults.

    `unit` is a key of `UNITS`. `simplify` is the distance in m by which a surface of more than 20,000 triangles may
    be simplified; by default 1/2,000 of its length, 0 for not at all. With `wrap`, a size in m, a closed surface is
    laid around the file's, whatever faults that has. Returns the surface with its edges, in m, and the same with the
    names of the file's parts and a note about each repair, and the surface before it was simplified.
    """
    surface = parse_surface(path)
    surface = replace(surface, points=surface.points * UNITS[unit])
    require_size(path, surface.length, unit)
    _require_thickness(path, surface)
    surface = wrap_surface(surface, wrap)[0] if wrap else _turn_outwards(repair_surface(surface))
    if wrap and simplify is None:
        simplify = WRAP_SIMPLIFIED * wrap
    topology, whole = _simplify(path, surface, simplify)
    tell_repairs(path, surface.notes)
    return topology, whole, surface


def _require_thickness(path: str, surface: Surface) -> None:
    """Refuse a surface that lies in a plane."""
    corners = surface.points[surface.triangles].reshape(-1, 3)
    middle = corners.mean(axis=0)
    # root of the least mean square distance from any plane through the middle
    thickness = float(np.sqrt(max(0.0, np.linalg.eigvalsh(np.cov((corners - middle).T))[0])))
    if thickness < FLAT * surface.length:
        raise UsageError(
            f"The surface of {path} has no thickness.",
            why=f"All of its triangles lie in a plane around {place(middle)}, so that there is no volume between them.",
            fix="Give the sheet a thickness in the program that made the file (solidify, thicken, extrude).",
        )


def _turn_outwards(surface: Surface) -> Surface:
    """Return the surface with closed shells that are inside out turned, and a note that tells it.

    Turned are all shells where all face the wrong way, else those that lie in no other one.
    """
    from trimesh import Trimesh

    if not is_manifold(surface.triangles):
        return surface
    shells = shells_of(Trimesh(surface.points, surface.triangles, process=False))
    depth = np.array([len(around) for around in shells.inside])
    wrong = (shells.volumes < 0) == (depth % 2 == 0)
    turned = wrong if wrong.all() else wrong & (depth == 0)
    if not turned.any():
        return surface
    chosen = turned[shells.shell_of]
    triangles = np.where(chosen[:, None], surface.triangles[:, ::-1], surface.triangles)
    what = "It was" if turned.all() else f"{int(turned.sum())} of its {len(turned)} closed shells were"
    return replace(surface, triangles=triangles).with_note(
        f"{what} inside out: its triangles faced inwards, and were turned."
    )


def _simplify(path: str, surface: Surface, simplify: float | None) -> tuple[Trimesh, Surface]:
    """Return a surface with its edges, of fewer triangles where there are many, and searched for faults."""
    from trimesh import Trimesh

    tolerance = TOLERANCE * surface.length if simplify is None else simplify
    if tolerance and len(surface.triangles) > MANY and is_manifold(surface.triangles):
        simple = simplify_surface(surface, tolerance)
        topology = Trimesh(simple.points, simple.triangles, process=False)
        # walls thinner than the tolerance may cross each other
        with contextlib.suppress(UsageError):
            require_closed(topology, path)
            return topology, simple
    topology = Trimesh(surface.points, surface.triangles, process=False)
    require_closed(topology, path)
    return topology, surface


def bodies_apart(topology: Trimesh) -> tuple[str, ...]:
    """Return a sentence for each body after the first that hangs apart from those before it."""
    shells = shells_of(topology)
    bodies = [number for number, volume in enumerate(shells.volumes) if volume > 0]
    corners = np.asarray(topology.triangles)
    notes = []
    for rank, number in enumerate(bodies[1:], 1):
        others = np.isin(shells.shell_of, bodies[:rank])
        gap, where = surface_gap(corners[shells.shell_of == number], corners[others])
        notes.append(
            f"Closed shell {number + 1} is a body of its own, {millimetres(gap)} from the others around {place(where)}."
        )
    return tuple(notes)


def name_parts(
    topology: Trimesh, surface: Surface, patches: tuple[SurfacePatch, ...], angle: float
) -> BodyMesh:
    """Return the surface, without tetrahedra, with names: those that the file gives to its parts, then by sharp edges.

    Names are the file's, then ``face 1``, ``face 2``, … by falling area.
    """
    part = segments(topology, angle)
    rest = np.ones(len(part), dtype=bool)
    names: list[str] = []
    index = np.empty(len(part), dtype=np.int64)
    if len(surface.labels) > 1:
        for number, name in enumerate(surface.labels):
            mine = surface.label_of == number
            # what is closed on its own is a body, whose faces are told apart by their edges
            if name and mine.any() and len(open_edges(surface.triangles[mine])):
                index[mine] = len(names)
                names.append(name)
                rest &= ~mine
    left, index[rest] = np.unique(part[rest], return_inverse=True)
    index[rest] += len(names)
    names += [f"face {i + 1}" for i in range(len(left))]
    surfaces, surface_of = apply_patches(
        names, index, topology.triangles_center, patches, topology.face_normals
    )
    return BodyMesh(
        topology.vertices, np.empty((0, 4)), topology.faces, surface_of, np.empty(0), surfaces, ("body",)
    )


def fill_surface(skin: BodyMesh, volume: float, coarse: float, refinements: tuple[FineMesh, ...]) -> BodyMesh:
    """Return tetrahedra inside a closed surface, whose triangles are renewed.

    The skin is in m, `volume` is what it encloses in m³, `coarse` the largest element size in m. SolverError if
    Netgen ends its process or takes too long.
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
