"""Bodies from CAD files and surface scans: solids with their names, and the insides of closed surfaces."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from os import fspath
from pathlib import Path
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.file_kinds import part_kind
from palpate.physics.apart import mesh_apart, read_apart
from palpate.physics.shapes.body_file import (
    FEATURE_ANGLE,
    SurfacePatch,
    digest_of,
    require_same,
    require_unit,
    tell_repairs,
)
from palpate.physics.shapes.cad_file import read_cad, states_unit
from palpate.physics.shapes.detail_size import detail_note, least_element
from palpate.physics.shapes.divided_surface import MOST_DRAWN
from palpate.physics.shapes.filled_surface import bodies_apart, fill_surface, name_parts, read_surface
from palpate.physics.shapes.mesh import BodyMesh, body_mesh, to_ngsolve
from palpate.physics.shapes.meshing import GRADING, FineMesh, mesh_solid
from palpate.physics.shapes.naming import INTERFACE
from palpate.physics.shapes.shape import Shape
from palpate.physics.shapes.step_patches import FacePatches
from palpate.physics.shapes.surface_repair import is_manifold
from palpate.physics.shapes.surface_simplify import TOLERANCE, simplify_surface

__all__ = ["ImportedSolid"]


@dataclass(frozen=True)
class ImportedSolid(Shape):
    """A solid of a CAD file (STEP, IGES, BREP), or the inside of a surface (STL, OBJ, PLY, OFF, GLB, VTP, VTK).

    Surfaces of a CAD file are its faces by name, colour or number, those of a surface its parts between sharp
    edges, ``face 1`` the largest. Regions are the solids of a CAD file, or ``body``.

    Attributes
    ----------
    path : str
        The file; its ending in any case tells the format. It may be packed with gzip.
    unit : {"m", "dm", "cm", "mm", "um", "in"}, optional
        Unit of the coordinates of a surface or a BREP file, which are bare numbers. STEP and IGES files state theirs.
    element : float, optional
        Largest element size in m, by default a third of the least extent.
    patches : tuple of SurfacePatch
        Names for parts of the surface; they go over those of the file. In a CAD file they name whole faces, unless
        they are chosen by the way that they face.
    feature_angle : float
        In degrees: from which angle between triangles an edge of a surface is sharp.
    simplify : float, optional
        Distance in m by which a surface of more than 20,000 triangles may be simplified; by default
        1/2,000 of its length, 0 for not at all. `notes` tells how far it is from the file's.
    wrap : float, optional
        Size in m by which a closed surface is wrapped around one that cuts itself or has holes or triangles inside out:
        it lies about so far from the file's at most, and what is thinner may vanish. `notes` tells how far it lies.
        Left out: the file's surface is taken as it is, and refused where it bounds no body.
    digest : str
        SHA-256 of the file, found when the value is made: the body is the file's content, not its name.

    Raises
    ------
    UsageError
        If the file is missing or its surface bounds no body (open, flat, cutting itself, not a manifold), or
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
    wrap: float | None = None
    digest: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", fspath(self.path))
        object.__setattr__(self, "patches", tuple(self.patches))
        if self.element is not None:
            checks.positive("The element size", self.element, "m")
        checks.positive("The feature angle", self.feature_angle, "degrees")
        if self.simplify is not None:
            checks.fits("The distance by which a surface is simplified", self.simplify, "m", least=0)
        if self.wrap is not None:
            checks.positive("The size of a wrap", self.wrap, "m")
        self._check_kind()
        if not self.digest:
            object.__setattr__(self, "digest", digest_of(self.path))

    def _check_kind(self) -> None:
        if part_kind(self.path) not in ("cad", "surface"):
            raise UsageError(
                f"{self.path} is neither a CAD file nor a surface.",
                why=f"Its name ends in {Path(self.path).suffix or 'nothing'!r}.",
                fix="Use STEP, IGES, BREP, STL, OBJ, PLY, OFF, GLB or VTP here, and ImportedMesh for a volume mesh.",
            )
        if states_unit(self.path) and self.unit is not None:
            raise UsageError(
                f"A unit was given for {self.path}.",
                why="STEP and IGES files state their own unit.",
                fix="Leave unit out; if the file states a wrong one, scale the model in the CAD program.",
            )
        if not states_unit(self.path) and self.unit is None:
            raise UsageError(
                f"The unit of {self.path} is not given.",
                why="The file holds bare numbers.",
                fix='Pass unit="mm" if it is in millimetres, unit="m" if in metres.',
            )
        if self.unit is not None:
            require_unit(self.unit)
        if self.wrap is not None and self.is_cad:
            raise UsageError(
                f"{self.path} is a CAD file, and can't be wrapped.",
                why="A wrap closes a surface of triangles.",
                fix="Leave wrap out, or export the part as STL.",
            )

    foreign = True

    @property
    def is_cad(self) -> bool:
        """True for a file of the CAD kernel, False for a surface of triangles."""
        return part_kind(self.path) == "cad"

    @property
    def curved(self) -> bool:  # type: ignore[override]  # a class variable of shapes of one kind
        """True where elements follow the surface between their vertices: those of a CAD file do."""
        return self.is_cad

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names found in the file or made from it, or given by patches."""
        if not self.is_cad:
            return _skin(self)[0].surfaces
        return _names(self)[0]

    @property
    def skin(self) -> BodyMesh:
        """Triangles of the surface with their names; those of a surface's file are found without meshing."""
        return super().skin if self.is_cad else _skin(self)[0]

    @property
    def drawn_apart(self) -> bool:  # type: ignore[override]  # a class variable of shapes of one kind
        """True where pictures show the file's own triangles: elements of a surface's file are coarser."""
        return not self.is_cad

    @property
    def drawn(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Points (p, 3) in m and triangles (q, 3) of a surface's file, at most 100,000; None for a CAD file.

        A larger surface is simplified within 1/2,000 of its length.
        """
        return (
            None
            if self.is_cad
            else _drawn_surface(self.path, self.digest, self.unit or "m", self.simplify, self.wrap)
        )

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the solids, or ``body``."""
        if not self.is_cad:
            return ("body",)
        return _names(self)[1]

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence about each thing in the file that was repaired or passed over."""
        return _names(self)[2] if self.is_cad else _skin(self)[2]

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
        further = {"simplify": self.simplify, "wrap": self.wrap}
        return plain | {name: value for name, value in further.items() if value is not None}

    def __str__(self) -> str:
        return f"solid of {Path(self.path).name}"

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """A new `netgen.meshing.Mesh` in m, whose names of surfaces and regions are set."""
        if self.is_cad:
            return mesh_apart(_mesh_cad, self, refinements, doing=f"meshing the {self}")
        skin, volume, _ = _skin(self)
        return to_ngsolve(fill_surface(skin, volume, self.coarse(*skin.corners), refinements)).ngmesh

    def coarse(self, low: Any, high: Any) -> float:
        """Return the largest element size in m of a body between two corners."""
        return self.element if self.element is not None else min(high[i] - low[i] for i in range(3)) / 3


def _mesh_cad(shape: ImportedSolid, refinements: tuple[FineMesh, ...]) -> Any:
    solid, _, naming = _read_solid(shape)
    rename = None if naming is None else naming.name_mesh
    coarse = shape.coarse(*solid.bounding_box)
    return mesh_solid(solid, coarse, refinements, rename, least_element(solid, coarse, GRADING)[0])


def _read_solid(shape: ImportedSolid) -> tuple[Any, tuple[str, ...], FacePatches | None]:
    require_same(shape.path, shape.digest)
    return read_cad(shape.path, shape.unit, shape.patches)


@lru_cache(maxsize=8)
def _names(shape: ImportedSolid) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Names of the surfaces and regions of a CAD file, and notes about it."""
    surfaces, regions, notes = read_apart(_read_names, shape, doing=f"reading the {shape}")
    tell_repairs(shape.path, notes)
    return surfaces, regions, notes


def _read_names(shape: ImportedSolid) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    solid, notes, naming = _read_solid(shape)
    coarse = shape.coarse(*solid.bounding_box)
    if note := detail_note(solid, coarse, GRADING):
        notes = (*notes, note)
    if naming is None:
        surfaces = dict.fromkeys(face.name for face in solid.faces if face.name != INTERFACE)
    else:  # which parts there are is known of a mesh
        least = least_element(solid, coarse, GRADING)[0]
        mesh = mesh_solid(solid, coarse, (), naming.name_mesh, least)
        surfaces = dict.fromkeys(name for name in body_mesh(mesh).surfaces if name != INTERFACE)
    return tuple(surfaces), tuple(dict.fromkeys(part.name for part in solid.solids)), notes


@lru_cache(maxsize=8)
def _skin(shape: ImportedSolid) -> tuple[BodyMesh, float, tuple[str, ...]]:
    """Named surface of a file, the volume in it in m³, and notes about repairs."""
    topology, surface, _ = _whole_surface(
        shape.path, shape.digest, shape.unit or "m", shape.simplify, shape.wrap
    )
    skin = name_parts(topology, surface, shape.patches, shape.feature_angle)
    return skin, float(topology.volume), (*surface.notes, *bodies_apart(topology))


@lru_cache(maxsize=2)
def _drawn_surface(
    path: str, digest: str, unit: str, simplify: float | None, wrap: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a file's surface for pictures."""
    surface = _whole_surface(path, digest, unit, simplify, wrap)[2]
    if len(surface.triangles) > MOST_DRAWN and is_manifold(surface.triangles):
        surface = simplify_surface(surface, TOLERANCE * surface.length, MOST_DRAWN)
    return surface.points, surface.triangles


@lru_cache(maxsize=2)
def _whole_surface(
    path: str, digest: str, unit: str, simplify: float | None, wrap: float | None
) -> tuple[Any, Any, Any]:
    """Surface of a file, which all patches of it share: large ones take seconds to simplify."""
    require_same(path, digest)
    return read_surface(path, unit, simplify, wrap)
