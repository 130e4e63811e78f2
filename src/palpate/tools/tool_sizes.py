"""Tools by name, with sizes by name: as a person chooses them on a page or in a command.

The sizes are those of the shape, and the components of the rotation vector by which the tool is turned about its place.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, replace

from palpate.checks import did_you_mean
from palpate.errors import UsageError
from palpate.tools.edged_tools import Box, Cylinder, Punch
from palpate.tools.posed_tool import PosedTool
from palpate.tools.round_tools import Capsule, Cone, Fingertip, Sphere
from palpate.tools.scanned_tool import ScannedTool
from palpate.tools.tool_shape import Tool
from palpate.units import parse_quantity

__all__ = [
    "BALL",
    "TURNS",
    "USUAL",
    "about",
    "read_tool",
    "size_unit",
    "sizes_of",
    "suitable_tool",
    "tool_by_name",
]

BALL = "ball"
"""What presses where no tool is named: a `SphereProbe`, whose place is its centre."""

USUAL: dict[str, Tool] = {
    "sphere": Sphere(0.010),
    "capsule": Capsule(0.006, 0.024),
    "cylinder": Cylinder(0.006, 0.024, 0.002),
    "punch": Punch(0.008, 0.002),
    "cone": Cone(math.radians(60), 0.004),
    "box": Box(0.020, 0.016, 0.010, 0.002),
    "fingertip": Fingertip(0.018, 0.016, 0.014),
}
"""Shapes by name, in the sizes that go with a ball of 10 mm."""

_BALL_RADIUS = 0.010  # m, of the ball that these sizes go with
TURNS = ("turn_x", "turn_y", "turn_z")
"""Names of the components of the rotation vector."""

_ABOUT = {
    "sphere": "a ball whose place is its foremost point",
    "capsule": "a bar with round ends that lies along x",
    "cylinder": "a cylinder that lies along x",
    "punch": "a round bar that presses with its flat end",
    "cone": "a cone with a rounded tip",
    "box": "a box that presses with its lower face",
    "fingertip": "an ellipsoid, as the pad of a finger",
}


def about(name: str) -> str:
    """Return what a tool is in a few words."""
    return _ABOUT.get(name, "a tool from a file, in the sizes that it has there")


def size_unit(size: str) -> str:
    """Return the SI unit of a size: that of an angle or of a length."""
    return "rad" if size == "half_angle" or size in TURNS else "m"


def sizes_of(tool: PosedTool) -> dict[str, float]:
    """Return the sizes of a tool by their names, in m and rad; those of a tool from a file are its turns alone."""
    sized = () if isinstance(tool.shape, ScannedTool) else fields(tool.shape)  # type: ignore[arg-type]
    own = {field.name: float(getattr(tool.shape, field.name)) for field in sized}
    return own | dict(zip(TURNS, tool.rotation, strict=True))


def suitable_tool(name: str, radius: float) -> PosedTool:
    """Return a tool by name in sizes that go with a ball of a radius in m."""
    usual = _usual(name)
    scale = radius / _BALL_RADIUS
    own = {key: value for key, value in sizes_of(PosedTool(usual)).items() if key not in TURNS}
    return PosedTool(
        replace(  # type: ignore[type-var]  # a tool is a dataclass
            usual,
            **{k: v if size_unit(k) == "rad" else float(f"{scale * v:.3g}") for k, v in own.items()},
        )
    )


def tool_by_name(name: str, sizes: Mapping[str, float]) -> PosedTool:
    """Return a tool by its name and all of its sizes in m and rad; others than those of this tool are a UsageError."""
    usual = _usual(name)
    own = {key: value for key, value in sizes.items() if key not in TURNS}
    wanted = [key for key in sizes_of(PosedTool(usual)) if key not in TURNS]
    if set(own) != set(wanted):
        raise UsageError(
            f"The sizes of a {name} are {', '.join(wanted)}.", why=f"Given are {', '.join(own) or 'none'}."
        )
    a, b, c = (sizes.get(key, 0.0) for key in TURNS)
    return PosedTool(replace(usual, **own), (a, b, c))  # type: ignore[type-var]


def read_tool(text: str, radius: float, known: PosedTool | None = None) -> tuple[str, PosedTool | None]:
    """Return name and tool of a text such as ``capsule, radius 6 mm, length 24 mm``; no tool for a ball.

    Sizes that are left out go with a ball of a radius in m, or are those of a `known` tool of this shape.
    A name or a size that is not known, or a text that is no quantity, is a UsageError.
    """
    name, *parts = (part.strip() for part in text.replace(":", ",").replace(";", ",").split(","))
    name = name.lower()
    if name == BALL:
        if any(parts):
            raise UsageError(
                "A ball's radius is not said with its name.",
                fix='Give it with --radius, or take a "sphere, radius 6 mm", whose place is its foremost point.',
            )
        return name, None
    tool = suitable_tool(name, radius)
    if known is not None and type(known.shape) is type(tool.shape):
        tool = known
    sizes = sizes_of(tool)
    for part in filter(None, parts):
        key, _, value = part.replace("=", " ").partition(" ")
        if key not in sizes:
            raise UsageError(
                f"A {name} has no size {key!r}.",
                why=f"It has {', '.join(sizes)}.",
                fix=did_you_mean(key, tuple(sizes), shown=repr)
                or f'For example "{name}, {next(iter(sizes))} 6 mm".',
            )
        sizes[key] = parse_quantity(value, size_unit(key), f"The size {key} of the {name}", bare=False)
    return name, tool_by_name(name, sizes)


def _usual(name: str) -> Tool:
    if name not in USUAL:
        known = (BALL, *USUAL)
        raise UsageError(
            f"There is no tool {name!r}.",
            why=f"Known are {', '.join(known)}.",
            fix=did_you_mean(name, known, shown=repr) or "Name one of them.",
        )
    return USUAL[name]
