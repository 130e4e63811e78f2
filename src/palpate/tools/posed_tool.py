"""A tool in an orientation: its pose by its inputs, how far it reaches, and how it is written to files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.tools.edged_tools import Box, Cylinder, Punch
from palpate.tools.front_balls import front_balls
from palpate.tools.rotations import rotation_matrix
from palpate.tools.round_tools import Capsule, Cone, Fingertip, Sphere
from palpate.tools.scanned_tool import ScannedTool
from palpate.tools.tool_shape import Tool
from palpate.units import Range

__all__ = ["PosedTool", "Turns", "shape_of"]

Turns = Literal["fixed", "axis", "full"]
"""What of a tool's orientation is an input: nothing, its axis, or all of it."""

ANGLES: dict[str, tuple[str, ...]] = {
    "fixed": (),
    "axis": ("tip_rx", "tip_ry"),
    "full": ("tip_rx", "tip_ry", "tip_rz"),
}
ROUNDING = 1e-9  # share of the largest angle by which rounding may carry one beyond it
MOST_TILT = math.pi / 2  # rad; a tool that lies over farther does not press with its tip

SHAPES: dict[str, type[Tool]] = {
    shape.__name__: shape for shape in (Box, Capsule, Cone, Cylinder, Fingertip, Punch, ScannedTool, Sphere)
}


def shape_of(record: Mapping[str, Any]) -> Tool:
    """Return the shape that `Tool.describe` wrote; an unknown one is refused with those that there are."""
    own = dict(record)
    kind = str(own.pop("type", ""))
    if kind not in SHAPES:
        raise UsageError(
            f"There is no tool {kind!r}.", why=f"Known are {', '.join(SHAPES)}.", fix="Name one of them."
        )
    return SHAPES[kind](**own)


@dataclass(frozen=True)
class PosedTool:
    """A tool turned about its place, which is its foremost point along its own axis.

    Its inputs are the place (3,) in m and, of an orientation that is an input, components in rad of a rotation vector w
    in the frame of the body, which turns the tool after `rotation`: R = exp [w]× R₀.

    Attributes
    ----------
    shape : Tool
        The tool in its own frame.
    rotation : tuple of three floats
        Rotation vector in rad: its direction is the axis, its length the angle.
    turns : {"fixed", "axis", "full"}
        What of the orientation is an input: nothing, w_x and w_y, or all of w.
    tilt : float
        Largest angle in rad of (w_x, w_y), and of w_z to both sides; not used where nothing is an input.

    Raises
    ------
    UsageError
        For a shape that is no tool, a rotation that is not three numbers, or an angle from π/2 on.
    """

    shape: Tool
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turns: Turns = "fixed"
    tilt: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Tool):
            raise UsageError(
                f"The shape of a tool is {self.shape!r}.",
                why=f"It is one of palpate.tools: {', '.join(SHAPES)}.",
                fix="For example SurfaceTool(pp.tools.Capsule(radius=0.006, length=0.03)).",
            )
        object.__setattr__(self, "rotation", checks.triple("The rotation of a tool", self.rotation, "rad"))
        if self.turns not in ANGLES:
            raise UsageError(
                f"What turns of a tool is {self.turns!r}.",
                why=f"It is one of {', '.join(map(repr, get_args(Turns)))}.",
                fix='Pass turns="axis" for two further inputs, or leave it out for a tool that keeps its orientation.',
            )
        if self.turns == "fixed":
            object.__setattr__(self, "tilt", 0.0)
            return
        checks.positive("The tilt of a tool", self.tilt, "rad")
        if self.tilt >= MOST_TILT:
            raise UsageError(
                f"A tool is to tilt by up to {self.tilt:g} rad.",
                why=f"From {MOST_TILT:.4g} rad on it does not point at the body any more.",
                fix="Give the angle in rad, for example math.radians(20).",
            )

    def __str__(self) -> str:
        angle, most = math.degrees(float(np.linalg.norm(self.rotation))), math.degrees(self.tilt)
        turned = "" if angle == 0.0 else f", turned by {angle:.3g}°"
        return (
            f"{self.shape}{turned}"
            if self.turns == "fixed"
            else f"{self.shape}{turned}, tilting to {most:.3g}°"
        )

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> PosedTool:
        """Return the tool that `describe` wrote.

        Raises
        ------
        UsageError
            For a shape that is not known.
        """
        options = {name: record[name] for name in ("turns", "tilt") if name in record}
        return cls(shape_of(record["shape"]), tuple(record.get("rotation", (0.0, 0.0, 0.0))), **options)

    def describe(self) -> dict[str, Any]:
        """Return the tool as plain data for a JSON file; what turns only where something does."""
        fixed = {"shape": self.shape.describe(), "rotation": self.rotation}
        return fixed if self.turns == "fixed" else {**fixed, "turns": self.turns, "tilt": self.tilt}

    @property
    def angles(self) -> tuple[Range, ...]:
        """Names and ranges in rad of the inputs after the place."""
        return tuple(Range(name, -self.tilt, self.tilt, "rad") for name in ANGLES[self.turns])

    def pose(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return place (..., 3) in m and rotation (..., 3, 3) at inputs (..., 3 + k): the place, then the angles."""
        place = np.asarray(x, dtype=float)[..., :3]
        return place, self.rotations(np.asarray(x, dtype=float)[..., 3:])

    def solids(self, x: np.ndarray) -> list[tuple[PosedTool, np.ndarray]]:
        """Return the tool and its own inputs at inputs (3 + k,): a gripper has several."""
        return [(self, np.asarray(x, dtype=float))]

    def front(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return centres (N, b, 3), radii (b,), in m, and shares (b,) of its front's balls at inputs (N, 3 + k)."""
        place, turn = self.pose(X)
        centres = place[:, None] + np.einsum("nij,bj->nbi", turn, self.balls[:, :3])
        return centres, self.balls[:, 3], self.balls[:, 4]

    @cached_property
    def balls(self) -> np.ndarray:
        """Centres in the tool's frame from its place, radius, both in m, and share (b, 5) of each ball of its front."""
        balls = front_balls(self.shape)
        balls[:, 2] += self.shape.front
        return balls

    def rotations(self, angles: np.ndarray) -> np.ndarray:
        """Return the rotations (..., 3, 3) from the tool's frame to the body's at angles (..., k) in rad."""
        w = np.zeros((*angles.shape[:-1], 3))
        count = min(len(ANGLES[self.turns]), angles.shape[-1])
        w[..., :count] = angles[..., :count]
        own = np.eye(3) if self.turn is None else self.turn
        return np.asarray(rotation_matrix(w) @ own)

    def require_trained(self, X: np.ndarray) -> None:
        """Refuse inputs (N, 3 + k) that turn the tool farther than it was tilted in training.

        Raises
        ------
        UsageError
            With the angles that would do.
        """
        angles = np.asarray(X, dtype=float)[:, 3 : 3 + len(ANGLES[self.turns])]
        if not angles.size:
            return
        turns = np.maximum(
            np.linalg.norm(angles[:, :2], axis=1), np.abs(angles[:, 2:]).max(axis=1, initial=0.0)
        )
        row = int(np.argmax(turns))
        if turns[row] <= self.tilt * (1 + ROUNDING):
            return
        raise UsageError(
            f"The {self.shape} is to be turned by {turns[row]:.3g} rad ({math.degrees(turns[row]):.3g}°) in row {row}.",
            why=f"It was trained up to {self.tilt:.3g} rad ({math.degrees(self.tilt):.3g}°): what it meets beyond that "
            "is not known.",
            fix="Ask for a smaller turn, or sweep with a larger tilt and learn again.",
        )

    def spread_angles(self, unit: np.ndarray) -> np.ndarray:
        """Return angles (N, k) in rad, even over the disc of all tilts, from k coordinates (N, k) between 0 and 1."""
        angles = np.empty_like(unit)
        if not unit.shape[1]:
            return angles
        radius, phase = self.tilt * np.sqrt(unit[:, 0]), 2 * math.pi * unit[:, 1]
        angles[:, 0], angles[:, 1] = radius * np.cos(phase), radius * np.sin(phase)
        angles[:, 2:] = self.tilt * (2 * unit[:, 2:] - 1)
        return angles

    @cached_property
    def turn(self) -> np.ndarray | None:
        """Rotation R₀ (3, 3) from the tool's frame to the body's where no angle is added; None for none."""
        return rotation_matrix(np.array(self.rotation)) if any(self.rotation) else None

    @property
    def to_centre(self) -> np.ndarray:
        """Way (3,) in m from the tool's place to its shape's centre where no angle is added."""
        own = np.array([0.0, 0.0, self.shape.front])
        return own if self.turn is None else self.turn @ own

    def keeps(self, matrix: np.ndarray) -> bool:
        """Return whether an isometry M (3, 3) of a body takes the tool to itself in another pose of its inputs.

        Its image at the place M p is turned by M R M'⁻¹ with M' = R₀⁻¹ M R₀, which must be an isometry of the tool's
        own shape that leaves its foremost point.
        """
        own = matrix if self.turn is None else self.turn.T @ matrix @ self.turn
        if self.turns == "axis" and not np.isclose(abs(matrix[2, 2]), 1.0):
            return False  # the image would turn about z
        return bool(np.isclose(own[2, 2], 1.0)) and self.shape.keeps(own)

    def reach(self, normals: np.ndarray, angles: np.ndarray | None = None) -> np.ndarray:
        """Return the height (N,) in m of the centre above a plane of unit normals (N, 3) that the tool just touches.

        `angles` (N, k) are the orientations, by default all zero.

        Raises
        ------
        UsageError
            Where the tool's side, not its end, would lie on the plane.
        """
        turns = self.rotations(np.zeros((1, 0)) if angles is None else angles)
        reach = self.shape.support(
            -np.einsum("ni,nij->nj", normals, np.broadcast_to(turns, (len(normals), 3, 3)))
        )
        if np.isfinite(reach).all():
            return reach
        raise UsageError(
            f"The side of the {self.shape} would lie on the surface.",
            why="Its foremost point does not touch first: the tool is turned too far from the surface's normal.",
            fix="Turn it less, or give another rotation or tilt, both in rad.",
        )

    def offset(self, normals: np.ndarray, angles: np.ndarray | None = None) -> np.ndarray:
        """Return how high (N,) in m the place is above a plane of unit normals (N, 3) that the tool just touches."""
        axes = self.rotations(np.zeros((1, 0)) if angles is None else angles)[..., 2]
        rise = np.einsum("ni,ni->n", normals, np.broadcast_to(axes, normals.shape))
        return np.asarray(self.reach(normals, angles) - self.shape.front * rise)
