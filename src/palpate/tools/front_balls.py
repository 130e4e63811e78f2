"""A tool's front as balls: from how deep each is in a body follows how the tool lies in it, whatever its shape.

Rays along the tool's axis meet its front in rings, from its middle to the rim at which it is `REACH` of its least
radius of curvature r above its foremost point. A ball of radius r touches the front from inside at each of these
points. Balls of one centre are one: a sphere is a ball, a capsule a row of them, a punch has them all over a disc. Each
has the share of the front, seen along the axis, that it stands for.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.tools.tool_shape import Tool

__all__ = ["front_balls"]

RINGS, AROUND = 2, 12
REACH = (
    0.5  # height of the rim over the least radius of curvature: the front's normal is 60° off the axis there
)
SAME = 1e-3  # distance over the tool's size within which two balls are one
MARCH, HALVE = 60, 30  # steps along a ray, each by the distance left, and halvings of the way to the rim


def front_balls(shape: Tool) -> np.ndarray:
    """Return centres in the tool's frame and radius in m, and shares that add up to 1, of its balls (b, 5)."""
    radius = shape.least_radius
    top = -shape.front + REACH * radius
    half = 1.5 * np.array(shape.half_widths(REACH * radius))  # beyond the corners of a box
    phase = 2 * math.pi * np.arange(AROUND) / AROUND
    rays = np.stack([np.cos(phase), np.sin(phase)], axis=1) * half
    inner, outer = np.zeros(AROUND), np.ones(AROUND)
    for _ in range(HALVE):
        middle = (inner + outer) / 2
        inside = _heights(shape, rays * middle[:, None]) <= top
        inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
    rings = np.arange(1, RINGS + 1) / RINGS
    across = np.vstack([np.zeros((1, 2)), *(rays * (share * inner)[:, None] for share in rings)])
    places = np.column_stack([across, _heights(shape, across)])
    gradient = shape.gradient(places)
    centres = places - radius * gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    bounds = (
        np.append(0.0, (np.arange(RINGS) + 0.5) / RINGS),
        np.append((np.arange(RINGS) + 0.5) / RINGS, 1.0),
    )
    areas = bounds[1] ** 2 - bounds[0] ** 2
    shares = np.append(areas[0], np.repeat(areas[1:] / AROUND, AROUND))
    return _merged(centres, shares, SAME * shape.size, radius)


def _heights(shape: Tool, across: np.ndarray) -> np.ndarray:
    """Return the heights (N,) in m at which rays along the axis meet the front from below; that of the rest is high."""
    points = np.column_stack([across, np.full(len(across), -shape.front)])
    for _ in range(MARCH):
        points[:, 2] += shape.distance(points)
    return points[:, 2]


def _merged(centres: np.ndarray, shares: np.ndarray, near: float, radius: float) -> np.ndarray:
    """Return balls (b, 5), those of one centre made one."""
    left, balls = np.ones(len(centres), dtype=bool), []
    for i in range(len(centres)):
        if not left[i]:
            continue
        same = left & (np.linalg.norm(centres - centres[i], axis=1) <= near)
        left &= ~same
        balls.append([*centres[same].mean(axis=0), radius, shares[same].sum()])
    return np.array(balls)
