"""Two jaws that pinch a body: their tables in a study file."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from palpate.physics import Pinch
from palpate.records import PadStiffness, Pair, Radians, Triple
from palpate.study.interaction_records import OnSurface, require_corners, require_depth
from palpate.study.stage_records import SECTIONS
from palpate.study.tool_kind import CapsuleShape, ToolShape

__all__ = ["PinchRecord"]


class PinchRecord(OnSurface):
    """Two rigid jaws with a soft skin that close on a body; their middle and their opening are the inputs."""

    kind: Literal["pinch"] = "pinch"
    touches: str = Field(
        "side",
        description='surface that both jaws meet, with two sides along the axis, such as "x_min + x_max"',
    )
    jaw: Annotated[
        ToolShape, Field(discriminator="kind", description="jaw on the positive side of the axis")
    ] = CapsuleShape()
    other: Annotated[ToolShape, Field(discriminator="kind")] | None = Field(
        None, description="jaw on the negative side; left out: the mirror image of the first"
    )
    axis: Literal["x", "y", "z"] = Field("x", description="of the body, along which the jaws close")
    roll: Radians = Field(0.0, description="angle by which both jaws are turned about the axis")
    pad: PadStiffness = Field(2e6, gt=0, description="stiffness of the skin of each jaw")
    depth: Pair = Field(
        (0.0, 0.004), description="least and largest depth of the jaw that presses deeper, along the axis, m"
    )
    over: tuple[Pair, Pair] | tuple[Triple, Triple] | None = Field(
        None,
        description="lower and upper corner of the box of lines along which the body is pinched, two coordinates "
        "across the axis or x, y and z, m; left out: the surface less a margin in which the jaws do not reach its ends",
        examples=[((0.03, 0.01), (0.07, 0.03))],
    )

    @model_validator(mode="after")
    def _in_order(self) -> PinchRecord:
        require_depth(self.depth)
        require_corners(self.over)
        return self

    def build(self, body: Any, *, whole: bool = True, element: float | None = None) -> Pinch:
        """Return the pinch, over all of its lines, with elements of a size in m under both jaws."""
        other = None if self.other is None else self.other.build()
        return Pinch(
            self.jaw.build(),
            other,
            axis=self.axis,
            roll=self.roll,
            touches=self.touches,
            pad=self.pad,
            depth=self.depth,
            over=self.over,
            element=element,
        )


SECTIONS["pinch"] = SECTIONS["tool"]
