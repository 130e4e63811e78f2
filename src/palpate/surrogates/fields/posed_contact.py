"""Where and how deep a tool in any pose touches a surface, for the fields that go with it.

A tool is the balls of its front (`palpate.tools.front_balls`). As in `PosedBaseline` its depth is their mean of order
m, s = (Σ w_i s_i^m)^(1/m). The place and the normal of the touch are the means of theirs with the weights
w_i s_i^(m−1), which move steadily as the tool tilts.
"""

from __future__ import annotations

import json

import numpy as np

from palpate.surrogates.surface import TouchedSurface
from palpate.tools import Gripper, PosedTool

__all__ = ["PosedContact"]

LEAST_NORMAL = 0.5  # length of the mean normal below which the normals of two jaws cancel
ORDER = 4.0  # m of the mean, half that of `PosedBaseline`: learnt shapes of files go by it


class PosedContact:
    """The touch of a tool on a surface at rest; `tool` is its description as JSON."""

    def __init__(self, tool: str, surface: TouchedSurface) -> None:
        record = json.loads(tool)
        self._tool: Gripper | PosedTool = Gripper.of(record) if "jaw" in record else PosedTool.of(record)
        self._surface = surface

    def at(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return depth (N,) in m, touched place (N, 3) in m and normal (N, 3) at inputs X (N, 3 + k).

        Without contact the depth is the least gap with the other sign, and the place that under the nearest ball.
        """
        centres, radii, shares = self._tool.front(X)
        distance, slope, _ = self._surface.at(centres.reshape(-1, 3))
        distance, slope = distance.reshape(centres.shape[:2]), slope.reshape(centres.shape)
        depths = radii - distance
        size = self._tool.shape.size
        weights = shares * np.maximum(depths / size, 0.0) ** (ORDER - 1.0)
        total = (weights * np.maximum(depths / size, 0.0)).sum(axis=1)
        touches = total > 0.0
        nearest = np.eye(len(shares))[depths.argmax(axis=1)]
        weights = np.where(touches[:, None], weights, nearest)
        weights /= weights.sum(axis=1, keepdims=True)
        feet = np.einsum("nb,nbi->ni", weights, centres - distance[..., None] * slope)
        normal = np.einsum("nb,nbi->ni", weights, slope)
        if isinstance(self._tool, Gripper):  # where the normals of both jaws cancel, the deepest ball's own
            faces = np.linalg.norm(normal, axis=1, keepdims=True) > LEAST_NORMAL
            normal = np.where(faces, normal, slope[np.arange(len(X)), depths.argmax(axis=1)])
        # far outside the distance has no slope
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
        return np.where(touches, size * total ** (1.0 / ORDER), depths.max(axis=1)), feet, normal
