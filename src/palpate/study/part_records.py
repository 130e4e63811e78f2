"""A part from a file as the body of a study: `[body] kind = "part"`, and names for parts of its surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, ClassVar, Literal, TypeAlias

from pydantic import Field, field_validator, model_validator

from palpate.errors import UsageError
from palpate.file_kinds import part_kind
from palpate.physics import Body, ImportedMesh, ImportedScan, ImportedSolid, SurfacePatch
from palpate.physics.shapes.body_file import FEATURE_ANGLE, WITHIN
from palpate.physics.shapes.naming import require_name
from palpate.physics.shapes.triangle_list import read_triangles
from palpate.records import Metres, Number, Record
from palpate.study.material_records import SolidMaterial, build_material

__all__ = ["PartRecord", "PartSurfaceRecord", "part_shape"]

_DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
    **{
        sign + axis: (s * (axis == "x"), s * (axis == "y"), s * (axis == "z"))
        for axis in "xyz"
        for sign, s in (("+", 1.0), ("-", -1.0))
    },
}
Corner = tuple[Metres, Metres, Metres]
PartShape: TypeAlias = ImportedSolid | ImportedMesh | ImportedScan
UPWARD = "superior"  # as a scan's file has it


class PartSurfaceRecord(Record):
    """A surface with a name of your own: what keeps all bounds given here; without any, what the others leave."""

    name: str = Field(min_length=1, description="for `fixed` and `touches`")
    faces: str | tuple[str, ...] = Field((), description="surfaces of the file, by name")
    below: Metres | None = Field(
        None, description="what lies below this height along the axis", examples=["5 mm"]
    )
    above: Metres | None = Field(None, description="what lies above it", examples=["30 mm"])
    axis: Literal["x", "y", "z"] = Field("z", description="of `below` and `above`")
    lower: Corner | None = Field(
        None, description="lower corner of a box", examples=[["0 mm", "0 mm", "0 mm"]]
    )
    upper: Corner | None = Field(None, description="upper corner", examples=[["20 mm", "20 mm", "5 mm"]])
    facing: str | tuple[Number, Number, Number] | None = Field(
        None, description="up, down, +x, -x, +y, -y, or (x, y, z): what faces that way", examples=["up"]
    )
    within: Number = Field(WITHIN, gt=0, le=180, description="largest angle from that direction, degrees")
    triangles: str = Field(
        "",
        description="triangles of the surface as it is read, as `palpate touch` writes them; not for CAD files",
        examples=["0-17 25 40-80 of 5120"],
    )
    around: str = Field(
        "",
        description="another surface: what lies around it on the same side, as far as `reach`, and is not held; not "
        "for CAD files",
    )
    reach: Metres | None = Field(
        None, gt=0, description="how far from the surface `around`", examples=["7 mm"]
    )

    @field_validator("name")
    @classmethod
    def _plain(cls, name: str) -> str:
        try:
            require_name("The name of a surface", name)
        except UsageError as error:
            raise ValueError(" ".join(str(error).split("\n"))) from error
        return name

    @field_validator("facing")
    @classmethod
    def _a_direction(cls, facing: Any) -> Any:
        if isinstance(facing, str) and facing not in _DIRECTIONS:
            raise ValueError(f"{facing!r} is no direction; there are {', '.join(_DIRECTIONS)}, and (x, y, z)")
        if isinstance(facing, tuple) and not any(facing):
            raise ValueError("its direction (0, 0, 0) points nowhere")
        return facing

    @field_validator("triangles")
    @classmethod
    def _a_list(cls, triangles: str) -> str:
        if triangles:
            try:
                read_triangles(triangles)
            except UsageError as error:
                raise ValueError(" ".join(str(error).split("\n"))) from error
        return triangles

    @model_validator(mode="after")
    def _not_empty(self) -> PartSurfaceRecord:
        if bool(self.around) != (self.reach is not None):
            raise ValueError(
                '`around` and `reach` go together, such as around = "touched" and reach = "7 mm"'
            )
        low, high = self._corners()
        for axis, a, b in zip("xyz", low, high, strict=True):
            if a is not None and b is not None and not a < b:
                raise ValueError(f"it is empty: along {axis} {a:g} m is not below {b:g} m")
        return self

    @property
    def is_rest(self) -> bool:
        """True for a surface without bounds: what the others leave."""
        low, high = self._corners()
        return not (self.faces or self.facing or self.triangles or self.around) and not any(
            value is not None for value in (*low, *high)
        )

    def _corners(self) -> tuple[list[float | None], list[float | None]]:
        """Return the bounds along x, y and z in m, None where there is none."""
        low: list[float | None] = list(self.lower or (None,) * 3)
        high: list[float | None] = list(self.upper or (None,) * 3)
        i = "xyz".index(self.axis)
        if self.above is not None:
            low[i] = self.above if low[i] is None else max(low[i] or 0.0, self.above)
        if self.below is not None:
            high[i] = self.below if high[i] is None else min(high[i] or 0.0, self.below)
        return low, high

    def patch(self) -> SurfacePatch:
        """Return the patch of the surface of a part."""
        low, high = self._corners()
        facing = _DIRECTIONS[self.facing] if isinstance(self.facing, str) else self.facing
        faces = (self.faces,) if isinstance(self.faces, str) else self.faces
        return SurfacePatch(
            self.name,
            (low[0], low[1], low[2]),
            (high[0], high[1], high[2]),
            None,
            facing,
            self.within,
            faces,
            self.triangles,
            self.around,
            self.reach or 0.0,
        )


class PartRecord(Record):
    """A part from a file: a surface such as STL, CAD such as STEP, a mesh such as VTU, or the labelmap of a scan."""

    INTERACTIONS: ClassVar[tuple[str, ...]] = ("probe", "tool", "pinch", "pad")

    kind: Literal["part"] = "part"
    file: str = Field(min_length=1, description="beside the study file", examples=["part.stl"])
    unit: Literal["m", "dm", "cm", "mm", "um", "in"] | None = Field(
        None,
        description="of the file's numbers; STEP and IGES files and scans state their own",
        examples=["mm"],
    )
    element: Metres | None = Field(
        None,
        gt=0,
        description="largest element, where none touches, of a scan that of its surfaces; a mesh keeps its own",
        examples=["15 mm"],
    )
    feature_angle: Number | None = Field(
        None,
        gt=0,
        le=180,
        description=f"surfaces: from which angle on an edge is sharp, degrees; left out: {FEATURE_ANGLE:g}",
        examples=[FEATURE_ANGLE],
    )
    wrap: Metres | None = Field(
        None,
        gt=0,
        description="surfaces that cut themselves or have holes: a closed one is laid around, so far away at most",
        examples=["1 mm"],
    )
    labels: dict[str, int] = Field(
        default_factory=dict,
        description="scans: names of the numbers that belong to the body; left out: all but 0",
        examples=[{"fat": 1, "gland": 2}],
    )
    up: Literal["superior", "inferior", "anterior", "posterior", "left", "right"] | None = Field(
        None,
        description="scans: direction of the patient that points up; left out: superior",
        examples=["anterior"],
    )
    material: SolidMaterial | None = Field(
        None, description="of each region that `materials` doesn't name", examples=["ecoflex 00-30"]
    )
    materials: dict[str, SolidMaterial] = Field(default_factory=dict, description="by name of the region")
    fixed: str | tuple[str, ...] = Field(description="surfaces that don't move")
    surfaces: tuple[PartSurfaceRecord, ...] = ()

    @model_validator(mode="after")
    def _fits_its_file(self) -> PartRecord:
        names = [surface.name for surface in self.surfaces]
        if len(set(names)) < len(names):
            raise ValueError("two surfaces share a name")
        if sum(surface.is_rest for surface in self.surfaces) > 1:
            raise ValueError("two surfaces have no bounds; one alone can be what the others leave")
        kind = part_kind(self.file)
        if kind == "cad" and any(surface.around for surface in self.surfaces):
            raise ValueError(
                f"{self.file} is a CAD file: its surfaces can't be chosen by what they are around"
            )
        if kind == "scan" and self.unit is not None:
            raise ValueError(f"{self.file} is a scan and states its lengths: leave out unit")
        if kind not in {"scan", ""} and (self.labels or self.up):  # a folder that is gone has no kind
            raise ValueError("labels and up are for scans, such as NRRD files")
        if self.element is not None and kind == "mesh":
            raise ValueError(f"{self.file} is a mesh and keeps its elements: leave out element")
        if self.feature_angle is not None and kind != "surface":
            raise ValueError("feature_angle is for surfaces, such as STL files")
        if self.wrap is not None and kind != "surface":
            raise ValueError("wrap is for surfaces, such as STL files")
        regions = self.shape().regions  # its errors say more than a line of a list
        for region in self.materials:
            if region not in regions:
                raise ValueError(f"{self.file} has no region {region!r}; it has {', '.join(regions)}")
        missing = [region for region in regions if region not in self.materials]
        if missing and self.material is None:
            raise ValueError(
                f"the region {missing[0]!r} has no material: give `material`, or {missing[0]!r} in `materials`"
            )
        return self

    @property
    def has_memory(self) -> bool:
        """True if the answer depends on the history: not for a solid body, whose solves start from rest."""
        return False

    def surface_names(self) -> tuple[str, ...]:
        """Return the names of the body's surfaces."""
        return self.shape().surfaces

    def fixed_names(self) -> tuple[str, ...]:
        """Return the names of the surfaces that are fixed."""
        return (self.fixed,) if isinstance(self.fixed, str) else self.fixed

    def shape(self) -> PartShape:
        """Return the shape, with names for parts of its surface."""
        return self._shape(self.patches())

    def bare(self) -> PartShape:
        """Return the shape with the names of its file alone."""
        return self._shape(())

    def _shape(self, patches: tuple[SurfacePatch, ...]) -> PartShape:
        return part_shape(
            self.file,
            self.unit,
            self.element,
            self.feature_angle,
            patches,
            self.wrap,
            self.labels,
            self.up,
        )

    def patches(self) -> tuple[SurfacePatch, ...]:
        """Return the names for parts of the surface, in the order in which they are given: later ones go over."""
        # what the others leave comes first, what is around another one last
        ordered = sorted(self.surfaces, key=lambda surface: (bool(surface.around), not surface.is_rest))
        patches = [surface.patch() for surface in ordered]
        return tuple(
            replace(patch, spared=self.fixed_names()) if patch.around else patch for patch in patches
        )

    def build(self) -> Body:
        """Return the body."""
        shape = self.shape()
        others = None if self.material is None else build_material(self.material)
        materials = {
            region: build_material(self.materials[region]) if region in self.materials else others
            for region in shape.regions
        }
        return Body(shape, materials, fixed=self.fixed)


def part_shape(
    file: str,
    unit: str | None = None,
    element: float | None = None,
    feature_angle: float | None = None,
    patches: tuple[SurfacePatch, ...] = (),
    wrap: float | None = None,
    labels: Mapping[str, int] = MappingProxyType({}),
    up: str | None = None,
) -> PartShape:
    """Return the shape of a part's file: a solid of CAD or a surface, the tissues of a scan, else a volume mesh.

    STEP and IGES files state the unit of their numbers, a mesh is in m by default. `element` is the largest element in
    m, of a solid or a surface; `feature_angle` is in degrees, from which on an edge of a surface is sharp. The patches
    are names for parts of the surface; `wrap` is the size in m by which a surface is wrapped. Of a scan
    `labels` are names and numbers of its tissues, and `up` is the direction of the patient that becomes z.
    """
    if part_kind(file) == "scan":
        return ImportedScan(file, labels, element, up or UPWARD, patches)
    if part_kind(file) not in ("cad", "surface"):
        return ImportedMesh(file, unit or "m", patches)
    angle = FEATURE_ANGLE if feature_angle is None else feature_angle
    return ImportedSolid(file, unit, element, patches, angle, wrap=wrap)
