"""A tool in an orientation: where its centre is from its place, how far it reaches, and how it is written to files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.tools.edged_tools import Box, Cylinder, Punch
from palpate.tools.round_tools import Capsule, Cone, Fingertip, Sphere
from palpate.tools.scanned_tool import ScannedTool
from palpate.tools.tool_shape import Tool

__all__ = ["PosedTool"]

SHAPES: dict[str, type[Tool]] = {
    shape.__name__: shape for shape in (Box, Capsule, Cone, Cylinder, Fingertip, Punch, ScannedTool, Sphere)
}


@dataclass(frozen=True)
class PosedTool:
    """A tool turned about its place, which is its foremost point along its own axis.

    Attributes
    ----------
    shape : Tool
        The tool in its own frame.
    rotation : tuple of three floats
        Rotation vector in rad: its direction is the axis, its length the angle.

    Raises
    ------
    UsageError
        For a shape that is no tool, or a rotation that is not three numbers.
    """

    shape: Tool
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Tool):
            raise UsageError(
                f"The shape of a tool is {self.shape!r}.",
                why=f"It is one of palpate.tools: {', '.join(SHAPES)}.",
                fix="For example SurfaceTool(pp.tools.Capsule(radius=0.006, length=0.03)).",
            )
        object.__setattr__(self, "rotation", checks.triple("The rotation of a tool", self.rotation, "rad"))

    def __str__(self) -> str:
        angle = math.degrees(float(np.linalg.norm(self.rotation)))
        return str(self.shape) if angle == 0.0 else f"{self.shape}, turned by {angle:.3g}°"

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> PosedTool:
        """Return the tool that `describe` wrote.

        Raises
        ------
        UsageError
            For a shape that is not known.
        """
        own = dict(record["shape"])
        kind = str(own.pop("type", ""))
        if kind not in SHAPES:
            raise UsageError(
                f"There is no tool {kind!r}.", why=f"Known are {', '.join(SHAPES)}.", fix="Name one of them."
            )
        return cls(SHAPES[kind](**own), tuple(record.get("rotation", (0.0, 0.0, 0.0))))

    def describe(self) -> dict[str, Any]:
        """Return the tool as plain data for a JSON file."""
        return {"shape": self.shape.describe(), "rotation": self.rotation}

    @cached_property
    def turn(self) -> np.ndarray | None:
        """Rotation (3, 3) from the tool's frame to the body's, by Rodrigues' formula; None for none."""
        angle = float(np.linalg.norm(self.rotation))
        if angle == 0.0:
            return None
        a, b, c = np.array(self.rotation) / angle
        K = np.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]])
        return np.asarray(np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K)

    @property
    def to_centre(self) -> np.ndarray:
        """Way (3,) in m from the tool's place to its shape's centre."""
        own = np.array([0.0, 0.0, self.shape.front])
        return own if self.turn is None else self.turn @ own

    def reach(self, normals: np.ndarray) -> np.ndarray:
        """Return the height (N,) in m of the centre above a plane of unit normals (N, 3) that the tool just touches.

        Raises
        ------
        UsageError
            Where the tool's side, not its end, would lie on the plane.
        """
        reach = self.shape.support(-normals if self.turn is None else -normals @ self.turn)
        if np.isfinite(reach).all():
            return reach
        raise UsageError(
            f"The side of the {self.shape} would lie on the surface.",
            why="Its foremost point does not touch first: the tool is turned too far from the surface's normal.",
            fix="Turn it less, or give another rotation: it is a rotation vector in rad.",
        )
