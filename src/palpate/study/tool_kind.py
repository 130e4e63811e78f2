"""A rigid tool of any shape that presses a surface: its tables in a study file."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field, field_validator, model_validator

from palpate.errors import UsageError
from palpate.physics import SurfaceTool, read_tool
from palpate.records import Metres, PadStiffness, Pair, Radians, Record, Triple
from palpate.study.interaction_records import OnSurface, require_corners, require_depth, stiffness_or_rigid
from palpate.study.probe_kind import ProbeLearningRecord, ProbeTestRecord
from palpate.study.stage_records import SECTIONS, PressSweepRecord, TouchTargetRecord
from palpate.tools import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Fingertip,
    PosedTool,
    Punch,
    ScannedTool,
    Sphere,
    Tool,
)
from palpate.tools.tool_sizes import TURNS, USUAL, sizes_of

__all__ = [
    "SHAPES",
    "BoxShape",
    "CapsuleShape",
    "ConeShape",
    "CylinderShape",
    "FileShape",
    "FingertipShape",
    "PunchShape",
    "ShapeRecord",
    "SphereShape",
    "ToolRecord",
    "ToolShape",
    "ToolSweepRecord",
    "tool_tables",
]


def _size(name: str, size: str, text: str) -> Any:
    """Return the key of a size of a shape, with its usual length or angle."""
    return Field(sizes_of(PosedTool(USUAL[name]))[size], gt=0, description=text)


class ShapeRecord(Record):
    """Base of the shapes of tools: keys are the sizes."""

    tool: ClassVar[type[Tool]]

    @model_validator(mode="after")
    def _is_a_shape(self) -> ShapeRecord:
        try:
            self.build()
        except UsageError as error:
            raise ValueError(" ".join(str(error).split("\n"))) from error
        return self

    def build(self) -> Tool:
        """Return the shape."""
        return self.tool(**self.model_dump(exclude={"kind"}))


class SphereShape(ShapeRecord):
    """A ball; its place is its foremost point, not its centre."""

    tool = Sphere
    kind: Literal["sphere"] = "sphere"
    radius: Metres = _size("sphere", "radius", "of the ball")


class CapsuleShape(ShapeRecord):
    """A bar along x with round ends, as a finger that lies flat."""

    tool = Capsule
    kind: Literal["capsule"] = "capsule"
    radius: Metres = _size("capsule", "radius", "of the bar and its ends")
    length: Metres = _size("capsule", "length", "from end to end")


class CylinderShape(ShapeRecord):
    """A cylinder that lies along x and presses with its side."""

    tool = Cylinder
    kind: Literal["cylinder"] = "cylinder"
    radius: Metres = _size("cylinder", "radius", "of the cylinder")
    length: Metres = _size("cylinder", "length", "from end to end")
    edge: Metres = _size("cylinder", "edge", "radius of the rounded edges of its ends")


class PunchShape(ShapeRecord):
    """A long round bar along z that presses with its flat end."""

    tool = Punch
    kind: Literal["punch"] = "punch"
    radius: Metres = _size("punch", "radius", "of the bar")
    edge: Metres = _size("punch", "edge", "radius of the rounded edge of its end")


class ConeShape(ShapeRecord):
    """A long cone with a rounded tip that points down."""

    tool = Cone
    kind: Literal["cone"] = "cone"
    half_angle: Radians = _size("cone", "half_angle", "between its axis and its side")
    tip: Metres = _size("cone", "tip", "radius of the rounded tip")


class BoxShape(ShapeRecord):
    """A box that presses with its lower face."""

    tool = Box
    kind: Literal["box"] = "box"
    size_x: Metres = _size("box", "size_x", "length along x")
    size_y: Metres = _size("box", "size_y", "length along y")
    size_z: Metres = _size("box", "size_z", "length along z")
    edge: Metres = _size("box", "edge", "radius of its rounded edges")


class FingertipShape(ShapeRecord):
    """An ellipsoid, as the pad of a finger."""

    tool = Fingertip
    kind: Literal["fingertip"] = "fingertip"
    size_x: Metres = _size("fingertip", "size_x", "length along x")
    size_y: Metres = _size("fingertip", "size_y", "length along y")
    size_z: Metres = _size("fingertip", "size_z", "length along z, in which it presses")


class FileShape(ShapeRecord):
    """A tool of any shape, from the file of its closed surface."""

    tool = ScannedTool
    kind: Literal["file"] = "file"
    file: str = Field(
        min_length=1, description="STL, OBJ, PLY, OFF, GLB or VTP, beside the study", examples=["finger.stl"]
    )
    unit: Literal["m", "dm", "cm", "mm", "um", "in"] = Field(
        description="of the file's coordinates", examples=["mm"]
    )
    presses: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = Field(
        "-z", description="direction of the file in which it presses"
    )
    spacing: Metres | None = Field(
        None,
        gt=0,
        description="distance of the places at which the shape is kept; left out: a sixth of the radius of its end",
        examples=["0.5 mm"],
    )

    def build(self) -> Tool:
        """Return the tool; the file is read once, until it changes."""
        return _scanned_tool(self, Path(self.file).stat().st_mtime_ns if Path(self.file).is_file() else 0)


@lru_cache(maxsize=4)
def _scanned_tool(record: FileShape, changed: int) -> ScannedTool:
    """Return the tool of a file that was changed at a time, ns."""
    del changed
    return read_tool(record.file, unit=record.unit, presses=record.presses, spacing=record.spacing)


ToolShape: TypeAlias = (
    SphereShape
    | CapsuleShape
    | CylinderShape
    | PunchShape
    | ConeShape
    | BoxShape
    | FingertipShape
    | FileShape
)
SHAPES: dict[str, type[ShapeRecord]] = {
    record.model_fields["kind"].default: record
    for record in (
        SphereShape,
        CapsuleShape,
        CylinderShape,
        PunchShape,
        ConeShape,
        BoxShape,
        FingertipShape,
    )
}
"""Records of the shapes by their names in study files, on the page and in commands."""


class ToolRecord(OnSurface):
    """A rigid tool with a soft pad as its skin; the position of its foremost point is the input."""

    kind: Literal["tool"] = "tool"
    shape: Annotated[ToolShape, Field(discriminator="kind")] = CapsuleShape()
    rotation: tuple[Radians, Radians, Radians] = Field(
        (0.0, 0.0, 0.0),
        description="rotation vector by which it is turned about that point: its direction is the axis, its length the "
        'angle, such as ["0 deg", "5 deg", "0 deg"]',
    )
    turns: Literal["fixed", "axis", "full"] = Field(
        "fixed",
        description="what of the orientation is an input: nothing, the tilt of its axis about x and y, or all of it",
    )
    tilt: Radians = Field(
        math.radians(20), gt=0, lt=math.pi / 2, description="largest angle of an orientation that is an input"
    )
    pad: PadStiffness | Literal["rigid"] = Field(
        1e7, description='stiffness of the pad; "rigid" for a tool without one that is felt'
    )
    depth: Pair = Field((2e-4, 0.005), description="least and largest depth of the tool's deepest point, m")
    over: tuple[Pair, Pair] | tuple[Triple, Triple] | None = Field(
        None,
        description="lower and upper corner of the touched part, x and y or x, y and z, m; left out: the surface less "
        "a margin in which the tool does not reach its rim",
        examples=[((0.03, 0.03), (0.07, 0.07))],
    )

    _stiffness = field_validator("pad", mode="before")(stiffness_or_rigid)

    @model_validator(mode="after")
    def _in_order(self) -> ToolRecord:
        require_depth(self.depth)
        require_corners(self.over)
        return self

    def build_tool(self) -> PosedTool:
        """Return the tool in its orientation."""
        return PosedTool(self.shape.build(), self.rotation, self.turns, self.tilt)

    def build(self, body: Any, *, whole: bool = True, element: float | None = None) -> SurfaceTool:
        """Return the tool, over all of its places, with elements of a size in m beneath it."""
        return SurfaceTool(
            self.shape.build(),
            touches=self.touches,
            pad=self.pad,
            depth=self.depth,
            over=self.over,
            rotation=self.rotation,
            turns=self.turns,
            tilt=self.tilt,
            element=element,
        )


def tool_tables(name: str, tool: PosedTool) -> dict[str, Any]:
    """Return what a study says of a tool by its name: the kind, the shape with its sizes, the rotation."""
    sizes = {key: value for key, value in sizes_of(tool).items() if key not in TURNS}
    return {"kind": "tool", "shape": {"kind": name, **sizes}, "rotation": tool.rotation}


class ToolSweepRecord(PressSweepRecord):
    """Touches that are solved: depth series, each from shallow to deep."""

    symmetric: ClassVar[bool] = False


SECTIONS["tool"] = {
    "sweep": ToolSweepRecord,
    "test": ProbeTestRecord,
    "learning": ProbeLearningRecord,
    "target": TouchTargetRecord,
}
