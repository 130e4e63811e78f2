"""Bodies whose volume mesh comes from a file."""

from __future__ import annotations

import re
from collections import Counter
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
    require_same,
    require_unit,
    segments,
    tell_repairs,
)
from palpate.physics.shapes.mesh import BodyMesh, outer_faces, tetrahedron_volumes, to_ngsolve
from palpate.physics.shapes.mesh_cells import duplicate_cells, merge_nodes, shortest_edge, split_cells
from palpate.physics.shapes.mesh_groups import Group, MeshSource
from palpate.physics.shapes.mesh_source import read_source
from palpate.physics.shapes.meshing import INSIDE, MOST_ELEMENTS, FineMesh, boxes_meet
from palpate.physics.shapes.naming import AND
from palpate.physics.shapes.shape import Shape, require_size
from palpate.physics.shapes.surface_checks import touching_shells
from palpate.physics.shapes.surface_repair import place

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["ImportedMesh", "refine_mesh"]

PLURAL = {"hexahedron": "hexahedra", "wedge": "wedges", "pyramid": "pyramids"}


@dataclass(frozen=True)
class ImportedMesh(Shape):
    """A volume mesh from a file: VTU, VTK, MSH, Abaqus, Nastran, TetGen, Medit, XDMF and others that meshio reads.

    Cells of first or higher order are taken by their corners: edges are straight. Hexahedra, wedges and pyramids are
    split into tetrahedra, nodes at one place are united. Regions are the groups, sets or numbers that the file
    gives to cells, surfaces those of faces and nodes; by their names where the file has names, else ``region 1``,
    ``surface 1`` by their numbers. Of several groups the smallest names a cell or face. What has no name is split
    along sharp edges into ``face 1``, ``face 2``, … by falling area.

    Attributes
    ----------
    path : str
        The file; its ending tells the format.
    unit : {"m", "dm", "cm", "mm", "um", "in"}
        Unit of the file's coordinates.
    patches : tuple of SurfacePatch
        Names for parts of the surface; they go over those of the file.
    labels : str, optional
        Name of the cell data that numbers regions and surfaces, where a file has several; by default that of a
        usual name, else the first whole numbers that differ.
    digest : str
        SHA-256 of the file, found when the value is made: the body is the file's content, not its name.

    Raises
    ------
    UsageError
        If the file is missing, has no cells of volume, inverted or flat ones, or kinds that are not read; if its parts
        touch with unequal triangles, its size tells of mistaken units, or a package is needed to read it.
    FileFormatError
        If the file is empty, corrupt or of an unknown format.
    """

    path: str
    unit: str = "m"
    patches: tuple[SurfacePatch, ...] = ()
    labels: str | None = None
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
        return _read(self)[0].surfaces

    @property
    def regions(self) -> tuple[str, ...]:
        """Names found in the file; ``body`` where it has none."""
        return _read(self)[0].regions

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence about each thing in the file that was repaired, passed over or decided."""
        return _read(self)[1]

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data."""
        patches = [patch.describe() for patch in self.patches]
        plain = {"type": "ImportedMesh", "unit": self.unit, "patches": patches, "sha256": self.digest}
        return plain if self.labels is None else plain | {"labels": self.labels}

    def __str__(self) -> str:
        return f"mesh of {Path(self.path).name}"

    foreign = True

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """The file's mesh, its tetrahedra bisected where a refinement asks for smaller ones."""
        if not refinements:
            return to_ngsolve(_read(self)[0]).ngmesh
        return mesh_apart(refine_mesh, _read(self)[0], refinements, doing=f"refining the {self}")


def refine_mesh(bare: BodyMesh, refinements: tuple[FineMesh, ...]) -> Any:
    """Return the `netgen.meshing.Mesh` of a body, bisected behind parts of surfaces."""
    mesh = to_ngsolve(bare)
    for refinement in refinements:
        _bisect(mesh, refinement)
    return mesh.ngmesh


@lru_cache(maxsize=8)
def _read(shape: ImportedMesh) -> tuple[BodyMesh, tuple[str, ...]]:
    """The file's content in m, checked; and notes about what was passed over or decided."""
    require_same(shape.path, shape.digest)
    source = read_source(shape.path, shape.labels)
    if source.unread:
        count = ", ".join(f"{number} cells of the kind {kind!r}" for kind, number in source.unread.items())
        raise UsageError(
            f"{shape.path} has cells that are not read: {count}.",
            why="Tetrahedra, hexahedra, wedges and pyramids are read; without these others the body would have holes.",
            fix="Export the mesh with cells of these kinds only.",
        )
    if not source.solids:
        raise _without_volume(source)
    mesh, node_of = _volume(source, shape)
    mesh = _with_surfaces(mesh, source, node_of, shape)
    tell_repairs(shape.path, source.notes)
    counts: Counter[str] = Counter()
    for kind, cells in source.solids:
        counts[PLURAL.get(kind, "")] += len(cells)
    split = " and ".join(f"{count} {kind}" for kind, count in counts.items() if kind)
    return mesh, (*source.notes, f"{split} were split into tetrahedra.") if split else tuple(source.notes)


def _without_volume(source: MeshSource) -> UsageError:
    """Return the error of a mesh that has no cells of volume, with its cause where the file shows it."""
    kinds = ", ".join(f"{count} of the kind {kind}" for kind, count in source.others.items()) or "none"
    why = f"Its cells are {kinds}; tetrahedra, hexahedra, wedges or pyramids are needed."
    fix = (
        "Export the volume mesh, or the closed surface as STL, OBJ or PLY (for ImportedSolid): it is filled."
    )
    named = ", ".join(dict.fromkeys(repr(group.name) for group in source.faces))
    if named and not source.regions:
        why += f" It has groups of surfaces alone ({named}), and some programs leave out what is in no group."
        fix = (
            "Add a group of the volume (in Gmsh a Physical Volume, or Mesh.SaveAll = 1) and save it again. "
            + fix
        )
    return UsageError(f"{source.path} has no cells of volume.", why=why, fix=fix)


def _volume(source: MeshSource, shape: ImportedMesh) -> tuple[BodyMesh, np.ndarray]:
    """Tetrahedra with their regions, without surfaces; and the node of the mesh for each of the file, or -1."""
    points = source.points * UNITS[shape.unit]
    corners = np.unique(np.concatenate([cells.ravel() for _, cells in source.solids]))
    require_size(shape.path, float(np.ptp(points[corners], axis=0).max()), shape.unit)
    merged = np.arange(len(points))
    node, apart = merge_nodes(points[corners], shortest_edge(points, source.solids))
    merged[corners] = corners[node]
    if twins := int((merged != np.arange(len(points))).sum()):
        lie = "1 node lies on another" if twins == 1 else f"{twins} nodes lie on others"
        source.notes.append(
            f"{lie}, at most {1e3 * apart:.2g} mm apart, and were united: their cells are bonded."
        )
    solids = [(kind, merged[cells]) for kind, cells in source.solids]
    points, tetrahedra, origin = split_cells(points, solids)
    lead = duplicate_cells(tetrahedra)
    first = lead == np.arange(len(tetrahedra))
    region_of, regions = _regions(source, np.abs(tetrahedron_volumes(points, tetrahedra)), origin, lead)
    tetrahedra, region_of = tetrahedra[first], region_of[first]
    used, renumbered = np.unique(tetrahedra, return_inverse=True)
    tetrahedra = _turn_right_handed(points[used], renumbered.reshape(tetrahedra.shape), shape.path)
    order = np.argsort(region_of, kind="stable")
    bare = BodyMesh(
        points[used], tetrahedra[order], np.empty((0, 3)), np.empty(0), region_of[order], (), regions
    )
    new = np.full(len(points), -1)
    new[used] = np.arange(len(used))
    return bare, new[merged]


def _regions(
    source: MeshSource, volumes: np.ndarray, origin: np.ndarray, lead: np.ndarray
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Region of each tetrahedron: of its groups the one of the least rank, then of the least volume, then the last."""
    cells = sum(len(block) for _, block in source.solids)
    masks = []
    for group in source.regions:
        chosen = np.zeros(cells, dtype=bool)
        chosen[group.members] = True
        mask = chosen[origin]
        # a cell that is there twice has the groups of both
        mask = np.bincount(lead, mask, minlength=len(lead))[lead] > 0
        masks.append(np.zeros_like(mask) if group.numbered and mask.all() else mask)
    index, names = _choose(source.regions, masks, volumes)
    rest = index < 0
    every = [*names, "body"] if rest.any() else names
    index[rest] = len(names)
    present, region_of = np.unique(index, return_inverse=True)
    return region_of.ravel(), tuple(every[i] for i in present)


def _choose(groups: list[Group], masks: list[np.ndarray], sizes: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Index into the names of groups for each part, -1 for none: the least rank, then the smallest, then the last."""
    names = list(dict.fromkeys(group.name for group in groups))
    extent = [float(sizes[mask].sum()) for mask in masks]
    worst_first = sorted(range(len(groups)), key=lambda k: (-groups[k].rank, -round(extent[k], 15), k))
    index = np.full(len(sizes), -1)
    for k in worst_first:
        index[masks[k]] = names.index(groups[k].name)
    return index, names


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


def _with_surfaces(bare: BodyMesh, source: MeshSource, node_of: np.ndarray, shape: ImportedMesh) -> BodyMesh:
    """Add the outer triangles with the names of the file, of sharp-edged parts and of patches."""
    from trimesh import Trimesh

    outer = outer_faces(bare.tetrahedra)
    surface = Trimesh(bare.points, outer, process=False)
    _require_manifold(surface, shape.path)
    if (contact := touching_shells(surface)) is not None:
        first, second, centre = contact
        raise UsageError(
            f"Parts {first} and {second} of the mesh in {shape.path} touch around {place(centre)} and share no nodes.",
            why="Faces of them lie on each other with unequal triangles, so that they can't be united.",
            fix="Mesh the parts together, with common nodes where they touch.",
        )
    groups = [*source.faces, *(replace(group, rank=group.rank + 1) for group in source.node_sets)]
    masks = [*_named_faces(outer, source.faces, node_of)]
    masks += [_faces_between(outer, group, node_of) for group in source.node_sets]
    # a number, or a set of nodes, for all of the surface tells nothing apart
    vague = [
        (group.numbered or group.rank > 1) and bool(mask.all())
        for group, mask in zip(groups, masks, strict=True)
    ]
    masks = [np.zeros_like(mask) if v else mask for mask, v in zip(masks, vague, strict=True)]
    index, names = _choose(groups, masks, np.asarray(surface.area_faces))
    parts = segments(surface)
    part_of = np.unique(parts[index < 0], return_inverse=True)[1]
    index[index < 0] = len(names) + part_of
    every = (*names, *(f"face {i + 1}" for i in range(int(part_of.max(initial=-1)) + 1)))
    surfaces, surface_of = apply_patches(
        every, index, surface.triangles_center, shape.patches, surface.face_normals
    )
    return replace(bare, triangles=outer, surface_of=surface_of, surfaces=surfaces)


def _named_faces(outer: np.ndarray, groups: list[Group], node_of: np.ndarray) -> list[np.ndarray]:
    """Masks of the outer triangles (t, 3) that lie on the faces of each group."""
    row_of = {tuple(key): row for row, key in enumerate(np.sort(outer, axis=1).tolist())}
    masks = []
    for group in groups:
        corners = node_of[group.members]
        rows = [
            row_of.get(tuple(key), -1)
            # the triangles that a face of four corners may be cut into; of a triangle the others have a corner twice
            for triple in ((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3))
            for key in np.sort(corners[:, triple], axis=1).tolist()
        ]
        mask = np.zeros(len(outer) + 1, dtype=bool)
        mask[rows] = True
        masks.append(mask[:-1])
    return masks


def _faces_between(outer: np.ndarray, group: Group, node_of: np.ndarray) -> np.ndarray:
    """Mask of the outer triangles whose corners are in a set of nodes; none where it has nodes within the body."""
    nodes = node_of[group.members]
    nodes = nodes[nodes >= 0]
    within = not np.isin(nodes, outer).all()
    chosen = np.asarray(np.isin(outer, nodes).all(axis=1))
    return np.zeros_like(chosen) if within else chosen


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
    if name == INSIDE:
        raise UsageError(
            "A mesh from a file can't be made fine inside.",
            why="Its elements are bisected behind a surface only.",
            fix="Make it fine there in the program that it comes from.",
        )
    pattern = "|".join(re.escape(part) for part in name.split(AND))
    for _ in range(40):
        marked = set()
        for face in mesh.Boundaries(pattern).Elements():
            corners = np.array([mesh[v].point for v in face.vertices])
            longest = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()
            if longest > 1.5 * refinement.element and boxes_meet(
                corners.min(axis=0), corners.max(axis=0), refinement
            ):
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
