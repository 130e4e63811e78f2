"""Bodies from CAD files and surface scans."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from os import fspath
from pathlib import Path
from typing import Any

from palpate.errors import UsageError
from palpate.physics.arguments import require_positive
from palpate.physics.geometry.faces import Face, faces_of
from palpate.physics.geometry.files import digest_of, require_same, require_unit
from palpate.physics.geometry.mesh import BodyMesh, to_ngsolve
from palpate.physics.geometry.meshing import mesh_solid
from palpate.physics.geometry.refinement import FineMesh
from palpate.physics.geometry.segments import FEATURE_ANGLE, SurfacePatch
from palpate.physics.geometry.shape import Shape
from palpate.physics.geometry.step_file import INTERFACE, read_step
from palpate.physics.geometry.stl_file import fill, named, read_stl
from palpate.physics.geometry.triangulation import Triangulation

__all__ = ["ImportedSolid"]

STEP, STL = (".step", ".stp"), (".stl",)


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
        Of an STL file's coordinates, which are bare numbers. A STEP file states its own.
    element : float, optional
        Largest element size in m, by default a third of the least extent.
    patches : tuple of SurfacePatch
        Names for parts of the surface; they go over those of the file. In a STEP file they name whole faces.
    feature_angle : float
        In degrees: from which angle between triangles an edge of an STL file is sharp.
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
    digest: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", fspath(self.path))
        object.__setattr__(self, "patches", tuple(self.patches))
        if self.element is not None:
            require_positive("The element size", self.element, "m")
        require_positive("The feature angle", self.feature_angle, "degrees")
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

    @property
    def is_step(self) -> bool:
        """Whether this is a STEP file."""
        return Path(self.path).suffix.lower() in STEP

    @property
    def curved(self) -> bool:  # type: ignore[override]  # a class variable of shapes of one kind
        """Whether elements follow the surface between their vertices: those of a STEP file do."""
        return self.is_step

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names found in the file or made from it, or given by patches."""
        if not self.is_step:
            return _skin(self)[0].surfaces
        return tuple(dict.fromkeys(f.name for f in _solid(self).faces if f.name != INTERFACE))

    @property
    def faces(self) -> tuple[Face, ...]:
        """Place, size and direction of each surface; those of an STL file are found without meshing."""
        return super().faces if self.is_step else faces_of(_skin(self)[0])

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the solids, or ``body``."""
        if not self.is_step:
            return ("body",)
        return tuple(dict.fromkeys(solid.name for solid in _solid(self).solids))

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data."""
        return {
            "type": "ImportedSolid",
            "unit": self.unit,
            "element": self.element,
            "patches": [patch.describe() for patch in self.patches],
            "feature_angle": self.feature_angle,
            "sha256": self.digest,
        }

    def __str__(self) -> str:
        return f"solid of {Path(self.path).name}"

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """A new `netgen.meshing.Mesh` in m, whose names of surfaces and regions are set."""
        if self.is_step:
            # read anew: meshing sets element sizes on the faces
            solid = _solid.__wrapped__(self)
            return mesh_solid(solid, self._coarse(*solid.bounding_box), refinements)
        skin, volume = _skin(self)
        return to_ngsolve(fill(skin, volume, self._coarse(*skin.corners), refinements)).ngmesh

    def _coarse(self, low: Any, high: Any) -> float:
        return self.element if self.element is not None else min(high[i] - low[i] for i in range(3)) / 3


@lru_cache(maxsize=8)
def _solid(shape: ImportedSolid) -> Any:
    require_same(shape.path, shape.digest)
    return read_step(shape.path, shape.patches)


@lru_cache(maxsize=8)
def _skin(shape: ImportedSolid) -> tuple[BodyMesh, float]:
    require_same(shape.path, shape.digest)
    surface: Triangulation = read_stl(shape.path, shape.unit or "m")
    return named(surface, shape.patches, shape.feature_angle), surface.volume
