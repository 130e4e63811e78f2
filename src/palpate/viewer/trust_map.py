"""The map of trust: how well a surrogate knows the force over the surface that it was trained on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.units import bounds
from palpate.viewer.part_messages import TrustMap

if TYPE_CHECKING:
    from palpate.viewer.surface_drawing import SurfaceDrawing

__all__ = ["NOT_TOUCHED", "NOT_TRAINED", "trust_map"]

NOT_TOUCHED, NOT_TRAINED = -1.0, -2.0  # values in place of a deviation
SHARE = 0.5  # depth of the ball at each point, over the deepest trained depth
TYPICAL = 95  # percentile of the deviations at which the colour scale ends


def trust_map(drawing: SurfaceDrawing) -> TrustMap:
    """Return the relative deviation of the force under a free ball at each point of a drawn surface.

    The ball is half as deep as the deepest trained press; further inputs are in the middle of their ranges. The map has
    `NOT_TOUCHED` where a hand may not touch, `NOT_TRAINED` outside the trained region. Without a posterior the trained
    region alone is known: the deviation is 0 there.
    """
    body = drawing.body
    points = np.asarray(drawing.surface.rest, dtype=float).reshape(-1, 3)
    triangles = np.asarray(drawing.surface.triangles, dtype=np.int64).reshape(-1, 3)
    values = np.full(len(points), NOT_TOUCHED)
    touched = np.unique(triangles[np.asarray(drawing.surface.touchable) > 0])
    depth = SHARE * body.deepest
    if body.holds or body.surface is None or not len(touched):
        return TrustMap(depth=depth, high=1.0, known=False, values=values)
    distance, slope, _ = body.surface.at(points[touched])
    normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    height = body.radius - distance if body.tool is None else body.tool.offset(normals)
    low, high = bounds(body.inputs)
    X = np.tile((low + high) / 2.0, (len(touched), 1))
    X[:, :3] = points[touched] + (height - depth)[:, None] * normals
    inside = body.energy.inside(X)
    try:
        deviation, known = np.asarray(body.energy.deviation(X)), True
    except UsageError:  # no posterior
        deviation, known = np.zeros(len(X)), False
    inside &= np.isfinite(deviation)
    values[touched] = np.where(inside, deviation, NOT_TRAINED)
    typical = float(np.percentile(deviation[inside], TYPICAL)) if inside.any() else 0.0
    return TrustMap(depth=depth, high=_round_up(typical), known=known, values=values)


def _round_up(value: float) -> float:
    """Return 1, 2 or 5 times a power of ten, no less than a value; 1 for none."""
    if not value > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return next((step * power for step in (1, 2, 5) if step * power >= value * (1 - 1e-9)), 10 * power)
