"""Bodies from CAD files and surface scans: solids of STEP files with their names, and the insides of STL surfaces."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache
from os import fspath
from pathlib import Path
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import FileFormatError, UsageError
from palpate.format import number
from palpate.physics.apart import mesh_apart, read_apart
from palpate.physics.shapes.body_file import (
    FEATURE_ANGLE,
    SurfacePatch,
    apply_patches,
    digest_of,
    require_same,
    require_unit,
    tell_repairs,
)
from palpate.physics.shapes.mesh import BodyMesh, body_mesh, to_ngsolve
from palpate.physics.shapes.meshing import FineMesh, mesh_solid
from palpate.physics.shapes.naming import INTERFACE, plain_name
from palpate.physics.shapes.shape import Shape, require_size
from palpate.physics.shapes.step_patches import FacePatches, cuts_faces, number_faces
from palpate.physics.shapes.stl_file import bodies_apart, fill_surface, name_parts, read_stl

__all__ = [
    "ImportedSolid",
    "read_step",
]

SHARED = 1e-6  # of a solid's volume: what two solids may have in common by rounding
MILLIMETRE = 1e-3  # the CAD kernel turns every unit that a STEP file states into mm
STEP, STL = (".step", ".stp"), (".stl",)


def read_step(
    path: str, patches: tuple[SurfacePatch, ...]
) -> tuple[Any, tuple[str, ...], FacePatches | None]:
    """Read the solids of a STEP file, glued where they touch.

    A face is called by its name, else by its colour (``colour ff0000``), else ``face 1``, ``face 2``, … in the
    order of the file, with the solid's name before it where there are several; a solid by its name, else ``body``,
    or ``body 1``, ``body 2``, …. Where a face is covered in part, the rest keeps its name.

    Parameters
    ----------
    path : str
        A STEP file, in any unit that it states.
    patches : tuple of SurfacePatch
        Names for the faces whose centres they contain.

    Returns
    -------
    body : netgen.occ.TopoDS_Shape
        In m.
    notes : tuple of str
        A sentence about each solid that was left out.
    naming : FacePatches, optional
        What names the faces of a mesh of the solid, where a patch is chosen by its direction; until then the faces are
        called by numbers.

    Raises
    ------
    FileFormatError
        If the file is no STEP file.
    UsageError
        If it holds no closed solid, solids overlap, or its size tells of mistaken units.
    """
    shape = _load(path)
    solids = list(shape.solids)
    if not solids:
        raise _not_a_solid(path, shape)
    for index, solid in enumerate(solids):
        name = plain_name(solid.name) if solid.name else "body" if len(solids) == 1 else f"body {index + 1}"
        _name_faces(solid, "" if len(solids) == 1 else f"{name} ")
        solid.mat(name)
    solids, notes = _without_overlap(path, solids)
    body = _scale_to_metres(solids)
    low, high = body.bounding_box
    require_size(path, max(high[i] - low[i] for i in range(3)), "stated in the file")
    _name_interfaces(body)
    outer = [face for face in body.faces if face.name != INTERFACE]
    names, centres = (
        tuple(face.name for face in outer),
        np.array([[f.center[i] for i in range(3)] for f in outer]),
    )
    if any(cuts_faces(patch, names, centres) for patch in patches):
        return body, notes, number_faces(patches, body)
    _name_patches(patches, body)
    return body, notes, None


def _without_overlap(path: str, solids: list[Any]) -> tuple[list[Any], tuple[str, ...]]:
    """Leave out solids that are there twice, and refuse those that share a volume; names are set."""
    kept: list[Any] = []
    notes = []
    for solid in solids:
        for other in kept:
            if not _boxes_meet(solid, other):
                continue
            common = solid * other
            if common.mass <= SHARED * min(solid.mass, other.mass):
                continue
            if common.mass >= (1 - SHARED) * max(solid.mass, other.mass):
                notes.append(f"The solid {solid.name!r} is the same as {other.name!r}, and was left out.")
                break
            nested = common.mass >= (1 - SHARED) * min(solid.mass, other.mass)
            raise UsageError(
                f"The solids {other.name!r} and {solid.name!r} of {path} overlap by {number(common.mass, 3)} mm³.",
                why=f"{'One lies inside the other, around' if nested else 'They do so around'} "
                f"({', '.join(number(v, 4) for v in common.center)}) mm; a place can have one material only.",
                fix="Cut one out of the other in the CAD program (subtract, keep both), so that they touch in a face.",
            )
        else:
            kept.append(solid)
    return kept, tuple(notes)


def _boxes_meet(solid: Any, other: Any) -> bool:
    (low, high), (other_low, other_high) = solid.bounding_box, other.bounding_box
    return all(low[i] < other_high[i] and other_low[i] < high[i] for i in range(3))


def _load(path: str) -> Any:
    from netgen.meshing import NgException
    from netgen.occ import OCCException, OCCGeometry

    try:
        return OCCGeometry(path).shape
    except (NgException, OCCException, RuntimeError) as error:
        raise FileFormatError(
            f"The file {path} can't be read as STEP.",
            why=f"It is corrupt, cut short or of another format ({str(error).strip()}).",
            fix="Open it in the CAD program and export it again as STEP AP214 or AP242.",
        ) from error


def _not_a_solid(path: str, shape: Any) -> UsageError:
    places = [tuple(round(v, 7) for v in edge.center) for face in shape.faces for edge in face.edges]
    lone = [place for place, count in Counter(places).items() if count == 1]
    if not places:
        return FileFormatError(
            f"The file {path} holds no shape.",
            why="The CAD kernel found neither solids nor faces in it: it is empty, cut short or damaged.",
            fix="Open it in the CAD program and export the solid again.",
        )
    where = f" around ({', '.join(f'{v * MILLIMETRE:.4g}' for v in np.mean(lone, axis=0))}) m" if lone else ""
    return UsageError(
        f"{path} holds no solid: its surface is open, {len(lone)} edges belong to one face only.",
        why=f"There is a hole{where}, or the faces were not sewn into a solid.",
        fix="Close and sew the faces in the CAD program, and export a solid.",
    )


def _name_faces(solid: Any, before: str) -> None:
    """Name the faces of a solid; `before` stands before the number of one that the file tells nothing about."""
    for index, face in enumerate(solid.faces):
        if face.name:
            face.name = plain_name(face.name)
        elif face.col is not None:
            red, green, blue = (round(255 * v) for v in tuple(face.col)[:3])
            face.name = f"colour {red:02x}{green:02x}{blue:02x}"
        else:
            face.name = f"{before}face {index + 1}"


def _scale_to_metres(solids: list[Any]) -> Any:
    from netgen.occ import Glue, Pnt

    scaled = []
    for solid in solids:
        small = solid.Scale(Pnt(0, 0, 0), MILLIMETRE)
        small.mat(solid.name)
        for face, original in zip(small.faces, solid.faces, strict=True):
            face.name = original.name
        scaled.append(small)
    return scaled[0] if len(scaled) == 1 else Glue(scaled)


def _name_interfaces(body: Any) -> None:
    """Name the faces that belong to two solids: by their identity, since many have the same centre."""
    owners = Counter(face for solid in body.solids for face in solid.faces)
    for face in body.faces:
        if owners[face] > 1:
            face.name = INTERFACE


def _name_patches(patches: tuple[SurfacePatch, ...], body: Any) -> None:
    if not patches:
        return
    # a wall between solids may have its centre in a patch, too, and is no part of the surface
    faces = [face for face in body.faces if face.name != INTERFACE]
    names, index = apply_patches(
        [face.name for face in faces],
        np.arange(len(faces)),
        np.array([[face.center[i] for i in range(3)] for face in faces]),
        patches,
    )
    for face, i in zip(faces, index, strict=True):
        face.name = names[i]


@dataclass(frozen=True)
class ImportedSolid(Shape):
    """A solid from a STEP file, or the inside of a closed surface from an STL file.

    Surfaces of a STEP file are its faces by name, colour or number, those of an STL file its parts between sharp
    edges, ``face 1`` the largest. Regions are the solids of a STEP file, or ``body``.

    Attributes
    ----------
    path : str
        Ending in .step, .stp or .stl.
    unit : {"m", "dm", "cm", "mm", "um", "in"}, optional
        Unit of an STL file's coordinates, which are bare numbers. A STEP file states its own.
    element : float, optional
        Largest element size in m, by default a third of the least extent.
    patches : tuple of SurfacePatch
        Names for parts of the surface; they go over those of the file. In a STEP file they name whole faces, unless
        they are chosen by the way that they face.
    feature_angle : float
        In degrees: from which angle between triangles an edge of an STL file is sharp.
    simplify : float, optional
        Distance in m by which the surface of an STL file of more than 20,000 triangles may be simplified; by default
        1/2,000 of its length, 0 for not at all. `notes` tells how far it is from the file's.
    digest : str
        SHA-256 of the file, found when the value is made: the body is the file's content, not its name.

    Raises
    ------
    UsageError
        If the file is missing or its surface bounds no body (open, inside out, cutting itself, not a manifold), or
        its size tells of mistaken units.
    FileFormatError
        If the file is empty, corrupt or of another format.
    """

    path: str
    unit: str | None = None
    element: float | None = None
    patches: tuple[SurfacePatch, ...] = ()
    feature_angle: float = FEATURE_ANGLE
    simplify: float | None = None
    digest: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", fspath(self.path))
        object.__setattr__(self, "patches", tuple(self.patches))
        if self.element is not None:
            checks.positive("The element size", self.element, "m")
        checks.positive("The feature angle", self.feature_angle, "degrees")
        if self.simplify is not None:
            checks.fits("The distance by which a surface is simplified", self.simplify, "m", least=0)
        self._check_kind()
        if not self.digest:
            object.__setattr__(self, "digest", digest_of(self.path))

    def _check_kind(self) -> None:
        ending = Path(self.path).suffix.lower()
        if ending not in STEP + STL:
            raise UsageError(
                f"{self.path} is neither a STEP nor an STL file.",
                why=f"Its name ends in {ending or 'nothing'!r}.",
                fix="Use .step, .stp or .stl here, and ImportedMesh for a volume mesh.",
            )
        if ending in STEP and self.unit is not None:
            raise UsageError(
                f"A unit was given for {self.path}.",
                why="A STEP file states its own unit.",
                fix="Leave unit out; if the file states a wrong one, scale the model in the CAD program.",
            )
        if ending in STL and self.unit is None:
            raise UsageError(
                f"The unit of {self.path} is not given.",
                why="An STL file holds bare numbers.",
                fix='Pass unit="mm" if it is in millimetres, unit="m" if in metres.',
            )
        if self.unit is not None:
            require_unit(self.unit)

    foreign = True

    @property
    def is_step(self) -> bool:
        """True for a STEP file, False for an STL file."""
        return Path(self.path).suffix.lower() in STEP

    @property
    def curved(self) -> bool:  # type: ignore[override]  # a class variable of shapes of one kind
        """True where elements follow the surface between their vertices: those of a STEP file do."""
        return self.is_step

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names found in the file or made from it, or given by patches."""
        if not self.is_step:
            return _skin(self)[0].surfaces
        return _names(self)[0]

    @property
    def skin(self) -> BodyMesh:
        """Triangles of the surface with their names; those of an STL file are found without meshing."""
        return super().skin if self.is_step else _skin(self)[0]

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the solids, or ``body``."""
        if not self.is_step:
            return ("body",)
        return _names(self)[1]

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence about each thing in the file that was repaired or passed over."""
        return _names(self)[2] if self.is_step else _skin(self)[2]

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data."""
        plain = {
            "type": "ImportedSolid",
            "unit": self.unit,
            "element": self.element,
            "patches": [patch.describe() for patch in self.patches],
            "feature_angle": self.feature_angle,
            "sha256": self.digest,
        }
        return plain if self.simplify is None else plain | {"simplify": self.simplify}

    def __str__(self) -> str:
        return f"solid of {Path(self.path).name}"

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """A new `netgen.meshing.Mesh` in m, whose names of surfaces and regions are set."""
        if self.is_step:
            return mesh_apart(_mesh_step, self, refinements, doing=f"meshing the {self}")
        skin, volume, _ = _skin(self)
        return to_ngsolve(fill_surface(skin, volume, self.coarse(*skin.corners), refinements)).ngmesh

    def coarse(self, low: Any, high: Any) -> float:
        """Return the largest element size in m of a body between two corners."""
        return self.element if self.element is not None else min(high[i] - low[i] for i in range(3)) / 3


def _mesh_step(shape: ImportedSolid, refinements: tuple[FineMesh, ...]) -> Any:
    solid, _, naming = _read_solid(shape)
    rename = None if naming is None else naming.name_mesh
    return mesh_solid(solid, shape.coarse(*solid.bounding_box), refinements, rename)


def _read_solid(shape: ImportedSolid) -> tuple[Any, tuple[str, ...], FacePatches | None]:
    require_same(shape.path, shape.digest)
    return read_step(shape.path, shape.patches)


@lru_cache(maxsize=8)
def _names(shape: ImportedSolid) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Names of the surfaces and regions of a STEP file, and notes about it."""
    surfaces, regions, notes = read_apart(_read_names, shape, doing=f"reading the {shape}")
    tell_repairs(shape.path, notes)
    return surfaces, regions, notes


def _read_names(shape: ImportedSolid) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    solid, notes, naming = _read_solid(shape)
    if naming is None:
        surfaces = dict.fromkeys(face.name for face in solid.faces if face.name != INTERFACE)
    else:  # which parts there are is known of a mesh
        mesh = mesh_solid(solid, shape.coarse(*solid.bounding_box), (), naming.name_mesh)
        surfaces = dict.fromkeys(name for name in body_mesh(mesh).surfaces if name != INTERFACE)
    return tuple(surfaces), tuple(dict.fromkeys(part.name for part in solid.solids)), notes


@lru_cache(maxsize=8)
def _skin(shape: ImportedSolid) -> tuple[BodyMesh, float, tuple[str, ...]]:
    """Named surface of an STL file, the volume in it in m³, and notes about repairs."""
    topology, surface = _stl_surface(shape.path, shape.digest, shape.unit or "m", shape.simplify)
    skin = name_parts(topology, surface, shape.patches, shape.feature_angle)
    return skin, float(topology.volume), (*surface.notes, *bodies_apart(topology))


@lru_cache(maxsize=2)
def _stl_surface(path: str, digest: str, unit: str, simplify: float | None) -> tuple[Any, Any]:
    """Surface of an STL file, which all patches of it share: large ones take seconds to simplify."""
    require_same(path, digest)
    return read_stl(path, unit, simplify)
