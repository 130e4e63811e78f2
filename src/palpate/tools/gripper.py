"""Two jaws that close along an axis, as one tool: its place is the middle between them, its opening an input.

The inputs are the centre c = (grip_x, grip_y, grip_z) and the opening w, all in m. The foremost point of the jaw on the
positive side of the axis e lies at c + w/2 e, that of the other at c − w/2 e, and each jaw points at the other. With
the forces A and B on the two jaws,

    −∂U/∂c = A + B        −∂U/∂w = ½ (A − B)·e

so the forces along the axis follow exactly, A·e = ½ F·e + G and B·e = ½ F·e − G of the force F on the gripper and the
effort G = −∂U/∂w with which the body pushes the jaws apart. Across the axis only the sum is known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.tools.posed_tool import PosedTool, shape_of
from palpate.tools.rotations import rotation_vector
from palpate.tools.tool_shape import Tool

__all__ = ["GRIP", "OPENING", "Gripper"]

GRIP = ("grip_x", "grip_y", "grip_z")
OPENING = "grip_opening"
"""Name of the input that is the distance of the jaws' foremost points, m."""
ROUNDING = 1e-9  # share of an end of the trained openings by which rounding may carry one beyond it
# columns: the jaw's own axes x and z in the body's frame, of the jaw on the positive side; its x lies level
AXES = {
    "x": ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),
    "y": ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "z": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
}


@dataclass(frozen=True)
class Gripper:
    """Two jaws that face each other along an axis of the body.

    Attributes
    ----------
    jaw : Tool
        The jaw on the positive side, one of `palpate.tools`.
    other : Tool, optional
        The jaw on the negative side; by default the mirror image of the first.
    axis : {"x", "y", "z"}
        Axis of the body along which the jaws close.
    roll : float
        Angle in rad by which both jaws are turned about that axis. At 0 the jaws' own x axis lies level.
    trained : tuple of two floats, optional
        Least and largest opening in m of the solves that a body was learnt from; None before that.

    Raises
    ------
    UsageError
        For a jaw that is no tool, or an axis of another name.
    """

    jaw: Tool
    other: Tool | None = None
    axis: Literal["x", "y", "z"] = "x"
    roll: float = 0.0
    trained: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for jaw in (self.jaw, self.far_jaw):
            if not isinstance(jaw, Tool):
                raise UsageError(
                    f"A jaw is {jaw!r}.",
                    why="It is one of palpate.tools, such as a Capsule, a Box or a Fingertip.",
                    fix="For example Pinch(pp.tools.Capsule(radius=0.005, length=0.02)).",
                )
        if self.axis not in AXES:
            raise UsageError(
                f"The jaws close along {self.axis!r}.",
                why="It is an axis of the body: x, y or z.",
                fix='Pass axis="x".',
            )
        checks.finite("The roll of a gripper", self.roll)

    def __str__(self) -> str:
        alike = self.far_jaw == self.jaw
        jaws = f"two jaws, each a {self.jaw}" if alike else f"a {self.jaw} and a {self.far_jaw}"
        turned = f", rolled by {math.degrees(self.roll):.3g}°" if self.roll else ""
        return f"gripper along {self.axis} of {jaws}{turned}"

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> Gripper:
        """Return the gripper that `describe` wrote."""
        other, trained = record.get("other"), record.get("trained")
        return cls(
            shape_of(record["jaw"]),
            None if other is None else shape_of(other),
            record.get("axis", "x"),
            float(record.get("roll", 0.0)),
            None if trained is None else (float(trained[0]), float(trained[1])),
        )

    def describe(self) -> dict[str, Any]:
        """Return the gripper as plain data for a JSON file."""
        plain = {
            "jaw": self.jaw.describe(),
            "other": None if self.other is None else self.other.describe(),
            "axis": self.axis,
            "roll": self.roll,
        }
        return plain if self.trained is None else {**plain, "trained": list(self.trained)}

    @property
    def far_jaw(self) -> Tool:
        """The jaw on the negative side."""
        return self.jaw if self.other is None else self.other

    @property
    def shape(self) -> Tool:
        """The jaw on the positive side, by whose size lengths are measured."""
        return self.jaw

    @property
    def along(self) -> np.ndarray:
        """Unit vector (3,) e of the axis, towards the first jaw."""
        return np.array(AXES[self.axis][1])

    @cached_property
    def jaws(self) -> tuple[PosedTool, PosedTool]:
        """The jaws in their orientations, that on the positive side first."""
        x, z = (np.array(v) for v in AXES[self.axis])
        y = np.cross(z, x)
        x, y = (
            math.cos(self.roll) * x + math.sin(self.roll) * y,
            math.cos(self.roll) * y - math.sin(self.roll) * x,
        )
        # half a turn about the first jaw's x makes the second one its mirror image
        turns = (np.stack([x, y, z], axis=1), np.stack([x, -y, -z], axis=1))
        return (
            PosedTool(self.jaw, _vector_of(turns[0])),
            PosedTool(self.far_jaw, _vector_of(turns[1])),
        )

    def places(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the places (..., 3) in m of both jaws at inputs (..., 4)."""
        x = np.asarray(x, dtype=float)
        half = x[..., 3:4] / 2 * self.along
        return x[..., :3] + half, x[..., :3] - half

    def solids(self, x: np.ndarray) -> list[tuple[PosedTool, np.ndarray]]:
        """Return each jaw and its own inputs (3,) in m at inputs (4,)."""
        return list(zip(self.jaws, self.places(x), strict=True))

    @cached_property
    def balls(self) -> tuple[np.ndarray, np.ndarray]:
        """The balls of each jaw's front (b, 5) from its place in the body's axes; see `front_balls`."""
        first, last = (np.hstack([jaw.balls[:, :3] @ _turn(jaw).T, jaw.balls[:, 3:]]) for jaw in self.jaws)
        return first, last

    def front(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return centres (N, b, 3) and radii (b,) in m, and shares (b,), of the balls of both jaws at inputs (N, 4)."""
        centres = [p[:, None] + b[:, :3] for p, b in zip(self.places(X), self.balls, strict=True)]
        balls = np.concatenate(self.balls)
        return np.concatenate(centres, axis=1), balls[:, 3], balls[:, 4] / 2

    def axial_forces(self, force: np.ndarray, effort: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the forces (N,) in N along the axis on both jaws, of forces (N, 3) on the gripper and efforts (N,)."""
        along = np.asarray(force, dtype=float) @ self.along / 2
        return along + effort, along - effort

    def keeps(self, matrix: np.ndarray) -> bool:
        """Return whether an isometry M (3, 3) of a body takes the gripper to itself at another centre."""
        e, first, last = self.along, *self.jaws
        if not np.isclose(abs(e @ matrix @ e), 1.0):
            return False
        images = (first, last) if e @ matrix @ e > 0 else (last, first)
        pairs = zip((first, last), images, strict=True)
        return all(
            own.shape == image.shape and own.shape.keeps(_turn(image).T @ matrix @ _turn(own))
            for own, image in pairs
        )

    def require_trained(self, X: np.ndarray) -> None:
        """Refuse inputs (N, 4) whose opening is below zero, or outside of what was trained.

        Raises
        ------
        UsageError
            With the openings that would do.
        """
        opening = np.asarray(X, dtype=float)[:, 3]
        low, high = self.trained or (0.0, math.inf)
        off = (opening < low * (1 - ROUNDING)) | (opening > high * (1 + ROUNDING))
        if not off.any():
            return
        row = int(np.argmax(off))
        value = float(opening[row])
        why = (
            "The jaws' foremost points can't pass each other."
            if value < 0
            else f"The solves were made with {millimetres(low)} to {millimetres(high)}: beyond, nothing is known."
        )
        raise UsageError(
            f"The jaws are to be {millimetres(value)} apart in row {row}.",
            why=why,
            fix=f"Ask for an opening of {low:.4g} to {high:.4g} (m), or sweep with other depths and learn again.",
        )


def _turn(tool: PosedTool) -> np.ndarray:
    return np.eye(3) if tool.turn is None else tool.turn


def _vector_of(R: np.ndarray) -> tuple[float, float, float]:
    """Return the rotation vector in rad of a rotation (3, 3), half turns included."""
    if np.trace(R) > -1 + 1e-9:
        a, b, c = rotation_vector(R)
        return a, b, c
    own = (R + np.eye(3)) / 2  # n nᵀ of half a turn about n
    n = own[int(np.argmax(np.diag(own)))]
    a, b, c = (math.pi * n / np.linalg.norm(n)).tolist()
    return a, b, c
