"""Bodies whose volume mesh comes from a file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.apart import mesh_apart
from palpate.physics.shapes.body_file import (
    UNITS,
    SurfacePatch,
    apply_patches,
    digest_of,
    read_with_meshio,
    require_same,
    require_unit,
    segments,
)
from palpate.physics.shapes.mesh import BodyMesh, outer_faces, tetrahedron_volumes, to_ngsolve
from palpate.physics.shapes.meshing import MOST_ELEMENTS, FineMesh
from palpate.physics.shapes.naming import plain_name
from palpate.physics.shapes.shape import Shape, require_size

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["ImportedMesh"]

TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "region", "Region", "material", "MaterialId")


@dataclass(frozen=True)
class ImportedMesh(Shape):
    """A volume mesh from a file that meshio reads: VTU, MSH, Medit, Abaqus, XDMF and others.

    Tetrahedra of first or second order are taken, by their vertices: edges are straight. Regions are the physical
    groups or the integer cell data of the tetrahedra, surfaces those of the triangles; by their names where the
    file has names, else ``region 1``, ``surface 1`` by their numbers. What has no name is split along sharp edges
    into ``face 1``, ``face 2``, … by falling area.

    Attributes
    ----------
    path : str
        The file; its ending tells the format.
    unit : {"m", "dm", "cm", "mm", "um", "in"}
        Unit of the file's coordinates.
    patches : tuple of SurfacePatch
        Names for parts of the surface; they go over those of the file.
    digest : str
        SHA-256 of the file, found when the value is made: the body is the file's content, not its name.

    Raises
    ------
    UsageError
        If the file is missing, has no tetrahedra, inverted or flat ones, or its size tells of mistaken units.
    FileFormatError
        If the file is empty, corrupt or of an unknown format.
    """

    path: str
    unit: str = "m"
    patches: tuple[SurfacePatch, ...] = ()
    digest: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", fspath(self.path))
        object.__setattr__(self, "patches", tuple(self.patches))
        require_unit(self.unit)
        if not self.digest:
            object.__setattr__(self, "digest", digest_of(self.path))

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names found in the file, or given by patches."""
        return _read(self).surfaces

    @property
    def regions(self) -> tuple[str, ...]:
        """Names found in the file; ``body`` where it has none."""
        return _read(self).regions

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data."""
        patches = [patch.describe() for patch in self.patches]
        return {"type": "ImportedMesh", "unit": self.unit, "patches": patches, "sha256": self.digest}

    def __str__(self) -> str:
        return f"mesh of {Path(self.path).name}"

    foreign = True

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """The file's mesh, its tetrahedra bisected where a refinement asks for smaller ones."""
        if not refinements:
            return to_ngsolve(_read(self)).ngmesh
        return mesh_apart(_refine, _read(self), refinements, doing=f"refining the {self}")


def _refine(bare: BodyMesh, refinements: tuple[FineMesh, ...]) -> Any:
    mesh = to_ngsolve(bare)
    for refinement in refinements:
        _bisect(mesh, refinement)
    return mesh.ngmesh


@lru_cache(maxsize=8)
def _read(shape: ImportedMesh) -> BodyMesh:
    """The file's content in m, checked."""
    require_same(shape.path, shape.digest)
    source = read_with_meshio(shape.path)
    points = np.zeros((len(source.points), 3))
    points[:, : source.points.shape[1]] = np.asarray(source.points, dtype=float) * UNITS[shape.unit]
    tetrahedra, regions, region_of = _cells(source, "tetra", 4, "region")
    if not len(tetrahedra):
        kinds = ", ".join(sorted({block.type for block in source.cells})) or "nothing"
        raise UsageError(
            f"{shape.path} has no tetrahedra.",
            why=f"It holds {kinds}; a volume mesh of tetrahedra is needed.",
            fix="Export the volume mesh, or for a closed surface use ImportedSolid with an STL file.",
        )
    used, renumbered = np.unique(tetrahedra, return_inverse=True)
    require_size(shape.path, float(np.ptp(points[used], axis=0).max()), shape.unit)
    tetrahedra = renumbered.reshape(tetrahedra.shape)
    tetrahedra = _turn_right_handed(points[used], tetrahedra, shape.path)
    order = np.argsort(region_of, kind="stable")
    bare = BodyMesh(
        points[used],
        tetrahedra[order],
        np.empty((0, 3)),
        np.empty(0),
        region_of[order],
        (),
        regions or ("body",),
    )
    return _with_surfaces(bare, source, used, shape)


def _cells(source: Any, kind: str, corners: int, word: str) -> tuple[np.ndarray, tuple[str, ...], np.ndarray]:
    """Corner nodes of all cells of a kind, the names of their groups, and each one's group."""
    blocks = [i for i, block in enumerate(source.cells) if block.type.startswith(kind)]
    blocks = [i for i in blocks if source.cells[i].type in {"tetra", "tetra10", "triangle", "triangle6"}]
    if not blocks:
        return np.empty((0, corners), dtype=np.int64), (), np.empty(0, dtype=np.int64)
    nodes = np.concatenate([np.asarray(source.cells[i].data)[:, :corners] for i in blocks]).astype(np.int64)
    key = next((tag for tag in TAGS if tag in source.cell_data), None)
    if key is None:
        return nodes, (), np.zeros(len(nodes), dtype=np.int64)
    tag = np.concatenate([np.asarray(source.cell_data[key][i]).ravel() for i in blocks]).astype(np.int64)
    dimension = corners - 1
    group_names = {
        int(v[0]): plain_name(n) for n, v in source.field_data.items() if len(v) == 2 and v[1] == dimension
    }
    numbers, index = np.unique(tag, return_inverse=True)
    if word == "region" and len(numbers) == 1 and not group_names:
        return nodes, (), np.zeros(len(nodes), dtype=np.int64)
    return nodes, tuple(group_names.get(int(k), f"{word} {k}") for k in numbers), index.ravel()


def _turn_right_handed(points: np.ndarray, tetrahedra: np.ndarray, source: str) -> np.ndarray:
    """Tetrahedra numbered right-handed; refuses a mesh that mixes both, or has flat ones."""
    volumes = tetrahedron_volumes(points, tetrahedra)
    inverted = volumes < 0
    flat = np.abs(volumes) < 1e-9 * np.abs(volumes).max()
    if flat.any() or 0 < inverted.sum() < len(tetrahedra):
        fault = flat if flat.any() else inverted if inverted.mean() < 0.5 else ~inverted
        place = ", ".join(f"{v:.4g}" for v in points[tetrahedra[fault.argmax()]].mean(axis=0))
        raise UsageError(
            f"{int(fault.sum())} of {len(tetrahedra)} tetrahedra of {source} are "
            f"{'flat' if flat.any() else 'inverted'}.",
            why=f"The first is element {int(fault.argmax())} near ({place}) m; its energy would not be defined.",
            fix="Repair or optimise the mesh in the program that made it.",
        )
    # all of them the other way round is another convention of numbering, no fault
    return tetrahedra[:, [0, 2, 1, 3]] if inverted.all() else tetrahedra


def _with_surfaces(bare: BodyMesh, source: Any, used: np.ndarray, shape: ImportedMesh) -> BodyMesh:
    """Add the outer triangles with the names of the file, of sharp-edged parts and of patches."""
    from trimesh import Trimesh

    outer = outer_faces(bare.tetrahedra)
    surface = Trimesh(bare.points, outer, process=False)
    _require_manifold(surface, shape.path)
    labelled, names, group = _cells(source, "triangle", 3, "surface")
    group_of: dict[tuple[int, ...], int] = {}
    if names:
        new = np.full(len(source.points), -1)
        new[used] = np.arange(len(used))
        keys = np.sort(new[labelled], axis=1).tolist()
        # 0 is what writers put where nothing was said
        named = [names[g] != "surface 0" for g in group]
        group_of = {tuple(k): int(g) for k, g, has_name in zip(keys, group, named, strict=True) if has_name}
    index = np.array([group_of.get(tuple(key), -1) for key in np.sort(outer, axis=1).tolist()])
    parts = segments(surface)
    part_of = np.unique(parts[index < 0], return_inverse=True)[1]
    index[index < 0] = len(names) + part_of
    every = (*names, *(f"face {i + 1}" for i in range(int(part_of.max(initial=-1)) + 1)))
    surfaces, surface_of = apply_patches(
        every, index, surface.triangles_center, shape.patches, surface.face_normals
    )
    return replace(bare, triangles=outer, surface_of=surface_of, surfaces=surfaces)


def _require_manifold(surface: Trimesh, source: str) -> None:
    crowded = int((np.bincount(surface.edges_unique_inverse) != 2).sum())
    if crowded:
        raise UsageError(
            f"The surface of the mesh in {source} is not a manifold: {crowded} edges don't belong to two triangles.",
            why="Parts touch along an edge only, or elements that should share nodes have nodes of their own.",
            fix="Merge coincident nodes, or remove the parts that hang on by an edge.",
        )


def _bisect(mesh: Any, refinement: FineMesh) -> None:
    """Bisect the tetrahedra behind a part of a surface until their edges there are short enough."""
    name = refinement.surface
    for _ in range(40):
        marked = set()
        for face in mesh.Boundaries(name).Elements():
            corners = np.array([mesh[v].point for v in face.vertices])
            long = (
                np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max() > 1.5 * refinement.element
            )
            if long and _overlaps(corners, refinement):
                marked |= {element.nr for f in face.facets for element in mesh[f].elements}
        if not marked:
            return
        if mesh.ne + 8 * len(marked) > MOST_ELEMENTS:
            raise UsageError(
                f"Refining {name!r} to {refinement.element:g} m would take more than {MOST_ELEMENTS} elements.",
                why=f"The mesh has {mesh.ne} elements before the next bisection.",
                fix="Choose larger elements, or refine a smaller part of the surface.",
            )
        for element in mesh.Elements():
            mesh.SetRefinementFlag(element, element.nr in marked)
        mesh.Refine()


def _overlaps(corners: np.ndarray, refinement: FineMesh) -> bool:
    if refinement.lower is None or refinement.upper is None:
        return True
    low, high = corners.min(axis=0), corners.max(axis=0)
    return bool(((low <= refinement.upper) & (high >= refinement.lower)).all())
