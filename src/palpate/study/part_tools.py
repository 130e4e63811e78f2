"""The tool that presses a part: a ball, or one in sizes that suit it, and the tables of its study under either."""

from __future__ import annotations

from typing import Any

from palpate.study.part_rim import RIM
from palpate.study.tool_kind import tool_tables
from palpate.tools import PosedTool, Tool

__all__ = ["COARSE", "rough_element", "tool_depth", "under_ball", "under_tool"]

COARSE = 0.5  # element over the radius: coarser ones do not feel the ball
EDGE_ELEMENT = 2.0  # element over the least radius of curvature of a tool, at most
DEEP = 0.75  # depth over a tool's size, at most, unless somebody chooses it


def rough_element(shape: Tool) -> float:
    """Return the size in m of the largest elements that see a tool and its edge."""
    return float(min(shape.size, EDGE_ELEMENT * shape.least_radius))


def tool_depth(shape: Tool, depth: float) -> float:
    """Return a largest depth in m that suits a tool, at most that of the ball which suits the part."""
    return float(f"{min(depth, DEEP * shape.size):.2g}")


def under_ball(content: dict[str, Any], radius: float) -> dict[str, Any]:
    """Return the tables of a study of a part under a ball of a radius in m, of one under a ball or a tool."""
    acting, sweep = content["interaction"], dict(content["sweep"])
    if acting["kind"] != "probe":
        acting = {"kind": "probe", "touches": acting["touches"], "depth": acting["depth"]}
    if sweep.get("element") is not None:  # coarser ones would not feel a smaller ball
        sweep["element"] = min(sweep["element"], COARSE * radius)
    return content | {"interaction": acting | {"radius": radius}, "sweep": sweep}


def under_tool(content: dict[str, Any], name: str, tool: PosedTool) -> dict[str, Any]:
    """Return the tables of a study of a part under a tool, of one under a ball or a tool.

    Elements become no coarser than its edge asks, and never finer by themselves than a `SurfaceTool`'s.
    """
    acting, sweep = content["interaction"], dict(content["sweep"])
    known = {key: acting[key] for key in ("touches", "depth")}
    known |= {key: acting[key] for key in ("pad", "over", "turns", "tilt") if acting["kind"] == "tool"}
    sweep.pop("symmetric", None)
    if sweep.get("element") is not None:
        finest = max(
            COARSE / 4 * tool.shape.size,
            min(COARSE * tool.shape.size, EDGE_ELEMENT * tool.shape.least_radius),
        )
        sweep["element"] = float(f"{min(sweep['element'], finest):.4g}")
    body = content["body"]
    surfaces = tuple(surface for surface in body["surfaces"] if surface["name"] != RIM)
    return content | {
        "body": body | {"surfaces": surfaces},
        "interaction": known | tool_tables(name, tool),
        "sweep": sweep,
    }
