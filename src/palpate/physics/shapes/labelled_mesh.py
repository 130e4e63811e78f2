"""Bodies of several tissues from the labelmap of a segmented scan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from os import fspath
from pathlib import Path
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.file_kinds import SCAN_ENDINGS, part_kind
from palpate.format import millimetres
from palpate.physics.apart import mesh_apart, read_apart
from palpate.physics.shapes.body_file import (
    SurfacePatch,
    apply_patches,
    digest_of,
    require_same,
    tell_repairs,
)
from palpate.physics.shapes.label_surface import LabelSurface, label_surface
from palpate.physics.shapes.mesh import BodyMesh, outer_faces, tetrahedron_volumes, to_ngsolve
from palpate.physics.shapes.mesh_file import refine_mesh
from palpate.physics.shapes.meshing import GRADING, THREADS, FineMesh, require_budget
from palpate.physics.shapes.naming import require_name
from palpate.physics.shapes.outer_layer import ThinLayer, add_layer, thin_layer, without_layer
from palpate.physics.shapes.packed_file import require_file
from palpate.physics.shapes.scan_file import LabelImage, clear_specks, name_labels, read_scan
from palpate.physics.shapes.shape import Shape, require_size

__all__ = ["CUT_FACE", "UPWARDS", "ImportedScan", "turn_upwards"]

UPWARDS = {
    "superior": (0.0, 0.0, 1.0),
    "inferior": (0.0, 0.0, -1.0),
    "anterior": (0.0, -1.0, 0.0),
    "posterior": (0.0, 1.0, 0.0),
    "left": (1.0, 0.0, 0.0),
    "right": (-1.0, 0.0, 0.0),
}
"""Directions of a patient that can point upwards, in the file's coordinates: x left, y posterior, z superior."""

CUT_FACE = "cut"
"""Name of the surface at which the body reaches the end of the image."""

CUBES = 2000  # of an element's edge that fill the body, where no size is given: seconds a solve
COARSER = 1.5  # largest element inside over that of the surfaces
LENGTH = 100.0  # longest side in the units in which Netgen meshes: its tolerances are those of millimetres
TELLS = 0.05  # difference of a tissue's volume from that of its voxels, which is told
KEEPS = 0.7  # of a layer's thickness: elements that leave it whole
LOST = 0.5  # share of a tissue's volume below which the mesh is refused
CUT = 0.75  # of an element: nearer to the end of the image, a surface is that of a cut
STRAIGHT = 0.7  # cosine of the angle to the image's axis within which a triangle faces the end


@dataclass(frozen=True)
class ImportedScan(Shape):
    """The labelled tissues of a scan: NRRD, NIfTI, MetaImage, DICOM. Needs SimpleITK: ``pip install 'palpate[scan]'``.

    Regions are the labels. Tissues share the nodes between them, and keep the volume of their voxels. Surfaces are the
    outer ones of each label, ``fat surface``, and ``cut`` where the body reaches the end of the image. Spacing,
    directions and origin of the file are used, in mm; voxels may be anisotropic and oblique.

    Attributes
    ----------
    path : str
        The file, or the folder of a DICOM series; a slice (``.dcm``) stands for its series.
    labels : mapping of str to int, or tuple of pairs
        Names of the numbers that belong to the body; what else the file holds is left out. By default all numbers but
        0, by the names that the file states or as ``label 1``, ``label 2``, ….
    element : float, optional
        Size in m of elements at the surfaces of tissues, by default such that 2,000 cubes of it fill the body. An
        outermost tissue that is thinner, such as skin, becomes one layer of flat elements; another is lost in part,
        and told.
    up : {"superior", "inferior", "anterior", "posterior", "left", "right"}
        Direction of the patient that becomes z. "superior" keeps the coordinates of the file; for a breast or belly of
        a patient who lies on the back it is "anterior".
    patches : tuple of SurfacePatch
        Names for parts of the surface; they go over those of the labels.
    digest : str
        SHA-256 of the file, found when the value is made: the body is the file's content, not its name.

    Raises
    ------
    UsageError
        If the file is missing or no labelmap of a volume (colours, series in time, grey values), states no size of a
        voxel, a label is empty, or the mesh would lose more than half of a tissue.
    FileFormatError
        If the file is empty, corrupt or of another format.
    """

    path: str
    labels: Any = ()
    element: float | None = None
    up: str = "superior"
    patches: tuple[SurfacePatch, ...] = ()
    digest: str = field(default="", repr=False)

    foreign = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", fspath(self.path))
        pairs = self.labels.items() if isinstance(self.labels, Mapping) else self.labels
        object.__setattr__(self, "labels", tuple((name, int(number)) for name, number in pairs))
        object.__setattr__(self, "patches", tuple(self.patches))
        for name, number in self.labels:
            require_name("The name of a label", name)
            checks.fits(f"The number of the label {name}", number, "", least=1, whole=True)
        if len(dict(self.labels)) < len(self.labels) or len({n for _, n in self.labels}) < len(self.labels):
            raise UsageError(
                "Two labels share a name or a number.",
                why=f"They are {', '.join(f'{name}={number}' for name, number in self.labels)}.",
                fix="Give each number one name.",
            )
        checks.one_of("The direction upwards", self.up, tuple(UPWARDS))
        if self.element is not None:
            checks.positive("The element size", self.element, "m")
        if part_kind(self.path) != "scan":
            require_file(self.path)  # a folder that is gone has no kind
            raise UsageError(
                f"{self.path} is no labelmap of a scan.",
                why=f"Its name ends in {Path(self.path).suffix or 'nothing'!r}.",
                fix=f"Give a file that ends in {', '.join(SCAN_ENDINGS)}.",
            )
        if not self.digest:
            object.__setattr__(self, "digest", digest_of(self.path))

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names of the outer surfaces of the labels, or given by patches."""
        return _named(self).surfaces

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the labels."""
        return _whole(self)[0].regions

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence about each thing in the file that was left out, removed or decided."""
        return _whole(self)[1]

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data."""
        return {
            "type": "ImportedScan",
            "labels": dict(self.labels),
            "element": self.element,
            "up": self.up,
            "patches": [patch.describe() for patch in self.patches],
            "sha256": self.digest,
        }

    def __str__(self) -> str:
        return f"scan of {Path(self.path).name}"

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """A new `netgen.meshing.Mesh` in m, whose names of surfaces and regions are set."""
        if not refinements:
            return to_ngsolve(_named(self)).ngmesh
        return mesh_apart(refine_mesh, _named(self), refinements, doing=f"refining the {self}")


@lru_cache(maxsize=8)
def _named(shape: ImportedScan) -> BodyMesh:
    """Return the mesh with the names of the patches."""
    mesh = _whole(replace(shape, patches=()))[0]
    centres = mesh.points[mesh.triangles].mean(axis=1)
    surfaces, index = apply_patches(mesh.surfaces, mesh.surface_of, centres, shape.patches, mesh.normals)
    return replace(mesh, surfaces=surfaces, surface_of=index)


def _whole(shape: ImportedScan) -> tuple[BodyMesh, tuple[str, ...]]:
    """Return the mesh without patches, and notes on how it came to be."""
    return _meshed(shape.path, shape.digest, shape.labels, shape.element, shape.up)


@lru_cache(maxsize=4)
def _meshed(
    path: str, digest: str, labels: tuple[tuple[str, int], ...], element: float | None, up: str
) -> tuple[BodyMesh, tuple[str, ...]]:
    require_same(path, digest)
    mesh, notes = read_apart(_mesh_scan, path, dict(labels), element, up, doing=f"meshing {path}")
    tell_repairs(path, notes)
    return mesh, notes


def _mesh_scan(
    path: str, labels: dict[str, int], element: float | None, up: str
) -> tuple[BodyMesh, tuple[str, ...]]:
    """Return the mesh of a labelmap and notes about it: a function for the child process in which Netgen runs."""
    image = clear_specks(name_labels(path, read_scan(path), labels))
    size = np.array(image.labels.shape) * image.spacing
    require_size(path, float(size.max()), "mm")
    turned = turn_upwards(image, up)
    volume = sum(image.volumes.values())
    spacing = element or float(f"{(volume / CUBES) ** (1 / 3):.2g}")
    require_budget([(volume, spacing)], [])
    layer = thin_layer(turned, spacing)
    surface = label_surface(without_layer(turned, layer) if layer else turned, spacing)
    solid = _fill(path, surface, spacing)
    if layer:
        ends = _on_cut(turned, surface.points[surface.triangles], spacing)
        surface, solid = add_layer(turned, layer, surface, solid, ends)
    # the numbers of regions that the mesh has are those of the labels, from 1
    mesh = _body(turned, surface, *solid, spacing)
    return mesh, (*image.notes, *_notes(path, image, surface, mesh, spacing, layer))


def turn_upwards(image: LabelImage, up: str) -> LabelImage:
    """Return the image in coordinates whose z is a direction of the patient."""
    if up == "superior":
        return image
    z = np.array(UPWARDS[up])
    x = np.array([1.0, 0.0, 0.0]) if not z[0] else np.array([0.0, 1.0, 0.0])
    turn = np.stack([x, np.cross(z, x), z])
    return replace(image, axes=turn @ image.axes, origin=turn @ image.origin)


def _fill(path: str, surface: LabelSurface, spacing: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points (n, 3) in m, right-handed tetrahedra (e, 4) between surfaces, and the label (e,) of each."""
    import ngsolve
    from netgen.meshing import FaceDescriptor, Mesh, NgException

    ngsolve.SetNumThreads(1)
    scale = LENGTH / float(np.ptp(surface.points, axis=0).max())
    mesh = Mesh(dim=3)
    mesh.AddPoints(np.ascontiguousarray(surface.points * scale))
    sides = np.column_stack([surface.inside, surface.outside])
    for number, (inside, outside) in enumerate(np.unique(sides, axis=0).tolist()):
        index = mesh.Add(FaceDescriptor(surfnr=number + 1, domin=inside, domout=outside, bc=number + 1))
        rows = surface.triangles[(sides == (inside, outside)).all(axis=1)]
        mesh.AddElements(dim=2, index=index, data=np.ascontiguousarray(rows, dtype=np.int32), base=0)
    try:
        mesh.GenerateVolumeMesh(maxh=COARSER * spacing * scale, grading=GRADING, nthreads=THREADS)
        failure = "" if len(mesh.Elements3D()) else "it gave up"  # which it may without an exception
    except NgException as error:
        failure = str(error).strip()
    if failure:
        raise UsageError(
            f"Netgen could not mesh the tissues of {path}: {failure}.",
            why=f"A layer or gap is thinner than the elements of {millimetres(spacing)}.",
            fix="Choose smaller elements, or smooth the labels in the program that made them.",
        )
    solid = mesh.Elements3D().NumPy()
    tetrahedra = solid["nodes"][:, :4].astype(np.int64) - 1
    points = np.asarray(mesh.Coordinates()) / scale
    wrong = tetrahedron_volumes(points, tetrahedra) < 0
    tetrahedra[wrong] = tetrahedra[wrong][:, [0, 2, 1, 3]]
    return points, tetrahedra, solid["index"].astype(np.int64)


def _body(
    image: LabelImage,
    surface: LabelSurface,
    points: np.ndarray,
    tetrahedra: np.ndarray,
    region: np.ndarray,
    spacing: float,
) -> BodyMesh:
    """Return the mesh of the tissues, whose outer surface is named after them, and the cut at the end of the image."""
    order = np.argsort(region, kind="stable")
    tetrahedra, region = tetrahedra[order], region[order] - 1
    outer = outer_faces(tetrahedra)
    key = {
        tuple(row): int(k)
        for row, k in zip(np.sort(surface.triangles, axis=1).tolist(), surface.inside, strict=True)
    }
    behind = np.array([key.get(tuple(row), 0) for row in np.sort(outer, axis=1).tolist()])
    names = list(image.names)
    present = [k for k in range(len(names)) if (region == k).any()]
    # sides of a thin layer are of no tissue's surface: it ends at the cut
    is_cut = _on_cut(image, points[outer], spacing) | (behind == 0)
    index = np.where(is_cut, len(names), behind - 1)
    every = [*(f"{name} surface" for name in names), CUT_FACE]
    used, surface_of = np.unique(index, return_inverse=True)
    return BodyMesh(
        points,
        tetrahedra,
        outer,
        surface_of,
        np.searchsorted(present, region),
        tuple(every[k] for k in used),
        tuple(names[k] for k in present),
    )


def _on_cut(image: LabelImage, corners: np.ndarray, spacing: float) -> np.ndarray:
    """Return which triangles (t, 3, 3) in m lie at an end of the image and face it."""
    back = np.linalg.inv(image.axes).T
    along = (corners.mean(axis=1) - image.origin) @ back / image.spacing + 0.5  # voxels from its corner
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = across @ back / np.linalg.norm(across, axis=1)[:, None]
    near = CUT * spacing / image.spacing
    first = (along < near) & (facing < -STRAIGHT)
    last = (along > image.labels.shape - near) & (facing > STRAIGHT)
    return np.asarray((first | last).any(axis=1))


def _notes(
    path: str,
    image: LabelImage,
    surface: LabelSurface,
    mesh: BodyMesh,
    spacing: float,
    layer: ThinLayer | None,
) -> list[str]:
    """Return sentences about what became of each tissue; refuse a mesh that has lost one."""
    told = []
    if CUT_FACE in mesh.surfaces:
        told.append(f"The body reaches the end of the image; its surface there is called {CUT_FACE!r}.")
    sizes = np.linalg.norm(surface.area_vectors, axis=1)
    for number, (name, wanted) in enumerate(image.volumes.items(), 1):
        there = mesh.region_volumes.get(name, 0.0)
        around = sizes[(surface.inside == number) | (surface.outside == number)].sum()
        # of a layer; of other shapes about as much as of a layer as thick as they
        thick = 2 * wanted / max(around, 1e-12)
        said = f"{1e6 * there:.3g} ml of {name} in the mesh, {1e6 * wanted:.3g} ml in the voxels"
        if there < LOST * wanted:
            finer = millimetres(min(KEEPS * thick, spacing / 2))
            raise UsageError(
                f"Elements of {millimetres(spacing)} are too large for {name!r} in {path}.",
                why=f"It is too thin: {said}.",
                fix=f"Choose smaller ones, such as {finer}, or leave the label out.",
            )
        if layer and name == layer.name:
            told.append(
                f"{name} is about {millimetres(thick)} thick, and elements {millimetres(spacing)}: it is one layer of "
                f"flat elements over the rest, {said}."
            )
        elif thick < spacing or abs(there - wanted) > TELLS * wanted:
            told.append(
                f"{name} is about {millimetres(thick)} thick, and elements {millimetres(spacing)}: {said}, but "
                "layers thinner than an element come out ragged. "
                f"Elements of {millimetres(KEEPS * thick)} keep them, and take longer."
            )
    return told
