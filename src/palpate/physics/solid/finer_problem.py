"""A problem with elements half as large around a few places: what tells the mesh's own error there.

With the size h of the elements under a ball the force errs as C hᵖ. Its difference to the force with elements of h/2
is C hᵖ (1 − 2⁻ᵖ), so the whole error is that difference over 1 − 2⁻ᵖ (Richardson 1911; Roache 1994). Quadratic
elements have p = 4 for a smooth solution; the edge of the contact, which lies within elements, leaves 2 to 3.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.physics.interactions.pinch import Pinch
from palpate.physics.interactions.pressing import PressingTool
from palpate.physics.interactions.sphere import SphereProbe
from palpate.physics.shapes.meshing import FineMesh

__all__ = ["FINER", "finer_problem"]

FINER = 0.5  # size of the elements over the ordinary one
# half the side of the box of small elements around the place, over the ball's radius or the tool's reach
REACH = 1.3
# the same: sides of a box that are so near to another edge coincide with it, or slivers would lie between
NEAR = 0.25


def finer_problem(problem: Any, places: np.ndarray) -> Any:
    """Return a problem of a body, or of a family, whose mesh is twice as fine around what presses at places (N, n ≥ 3).

    Elsewhere the mesh is as fine as that of `problem`, on which one ball, tool or pair of jaws acts.
    """
    base = getattr(problem, "base", problem)
    pressing = next(part for part in base.interactions if isinstance(part, PressingTool | Pinch))
    X = np.asarray(places, dtype=float)
    probe: PressingTool
    if isinstance(pressing, Pinch):  # both jaws press
        probe, sites = max(pressing.tools, key=_reach), np.concatenate(pressing.gripper.places(X))
    else:
        probe, sites = pressing, X[:, :3]
    wide = base.refinements
    size = FINER * min(part.element for part in wide if part.surface in {probe.meets, probe.touches})
    half = REACH * _reach(probe)
    corners = [np.array([place - half, place + half]) for place in sites]
    near = min(size, NEAR * probe.shape.size)
    levels = [np.array([*base.body.geometry.rest().corners])]
    levels += [np.array([part.lower, part.upper]) for part in wide if part.lower is not None]
    boxes = [
        FineMesh(probe.meets, size, *map(tuple, _snap(box, np.concatenate(levels), near).tolist()))
        for box in _join(corners)
    ]
    finer = replace(base, fine=(*wide, *boxes))
    return finer if base is problem else replace(problem, base=finer)


def _reach(probe: PressingTool) -> float:
    """Return how far from its place a ball or a tool is in contact, in m, at most."""
    if isinstance(probe, SphereProbe):
        return probe.radius
    return max(*probe.shape.half_widths(max(probe.depth)), probe.shape.size)


def _join(boxes: list[np.ndarray]) -> list[np.ndarray]:
    """Return boxes (2, 3) in m with those that overlap in one: cuts close together would make slivers."""
    apart: list[np.ndarray] = []
    for box in boxes:
        joined, rest = box, []
        for other in apart:
            if (joined[0] <= other[1]).all() and (other[0] <= joined[1]).all():
                joined = np.array([np.minimum(joined[0], other[0]), np.maximum(joined[1], other[1])])
            else:
                rest.append(other)
        apart = [*rest, joined]
    return apart if len(apart) == len(boxes) else _join(apart)


def _snap(box: np.ndarray, levels: np.ndarray, near: float) -> np.ndarray:
    """Return a box (2, 3) in m whose sides coincide with levels (k, 3) that are nearer than this, in m."""
    gaps = np.abs(levels[:, None] - box)
    nearest = np.take_along_axis(
        np.broadcast_to(levels[:, None], gaps.shape), gaps.argmin(axis=0)[None], axis=0
    )
    return np.where(gaps.min(axis=0) < near, nearest[0], box)
