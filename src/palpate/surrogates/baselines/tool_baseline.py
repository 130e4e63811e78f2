"""A rigid tool that presses a plane surface: the contact law of its deepest point, U₀ = U₀(s).

Over a plane the deepest point of a tool that does not turn is always the same one. So s is that of a ball around a
fixed point of the tool, which touches the plane when the tool does: s = R − d(p + m), with the tool's place p, the way
m from there to the ball's centre, and the body's signed distance d. The surface that is kept is the body's moved by −m,
so that it takes places, and everything else is a sphere's. What a tool feels beside its deepest point, such as a rim
under its end, is learnt.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates.baselines.baseline import Baseline, register_baseline
from palpate.surrogates.baselines.contact_baseline import ContactBaseline
from palpate.tools import PosedTool

__all__ = ["ToolBaseline", "deepest_ball", "require_ball"]


def deepest_ball(tool: PosedTool, normal: np.ndarray) -> tuple[float, np.ndarray]:
    """Return radius in m of a ball that touches a plane of a unit normal (3,) when a tool does, and the way to it.

    The way (3,) in m leads from the tool's place to the ball's centre, above the shape's own.
    """
    reach = float(tool.reach(normal[None])[0])
    # a ball of an edge's radius would ask for a distance far finer than the contact
    radius = max(reach, tool.shape.size)
    return radius, tool.to_centre + (radius - reach) * normal


@register_baseline
@dataclass(frozen=True, eq=False)
class ToolBaseline(ContactBaseline):
    """The contact law of a rigid tool of fixed orientation on a plane surface.

    Attributes
    ----------
    law : ContactLaw
        U₀ by the depth s.
    touched : TouchedSurface
        The surface at rest, moved by −m.
    probe_radius : float
        Radius R in m of the ball that touches the plane when the tool does.
    radius_at : int, optional
        None: no size of a tool is an input.
    resolved : float, optional
        Depth (m) below which solves count less, as for a sphere.
    tool : str
        The tool's description as JSON, from which `PosedTool.of` makes it.
    """

    name: ClassVar[str] = "tool"

    tool: str = ""

    def __post_init__(self) -> None:
        try:
            _ = self.posed_tool
        except (ValueError, KeyError, TypeError) as error:
            raise UsageError(
                "The baseline of a tool tells of no tool.",
                why=str(error),
                fix="Let `palpate.learn` make it, or copy the file again.",
            ) from error

    def __str__(self) -> str:
        return f"{self.posed_tool}; {self.law}"

    @property
    def posed_tool(self) -> PosedTool:
        """The tool in its orientation."""
        return PosedTool.of(json.loads(self.tool))

    def surface_shift(self, normal: np.ndarray) -> np.ndarray:
        """Return the way (3,) in m from the tool's place to the ball that touches a plane of this normal (3,)."""
        return deepest_ball(self.posed_tool, normal)[1]

    @property
    def probe_words(self) -> str:
        """The tool in a few words."""
        return f"a {self.posed_tool}"

    @property
    def c_name(self) -> str:
        """That of a ball: the surface that is kept makes the rest of it."""
        return ContactBaseline.name


def require_ball(baseline: Baseline, what: str) -> None:
    """Refuse a tool where a ball's centre is taken for the place; `what` a body under it can't do, in words.

    Raises
    ------
    UsageError
        For a tool.
    """
    if isinstance(baseline, ToolBaseline):
        raise _needs_ball(baseline, what)


def _needs_ball(baseline: ToolBaseline, what: str) -> UsageError:
    return UsageError(
        f"A body under {baseline.probe_words} can't {what} yet.",
        why="The place would be taken for the centre of a ball, and it is another point of the tool.",
        fix="Ask it in Python, feel it by `palpate run`, or learn the body under a SphereProbe.",
    )
