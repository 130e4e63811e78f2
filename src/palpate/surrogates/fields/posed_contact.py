"""Where and how deep a tool in any pose touches a surface, for the fields that go with it.

A tool is the balls of its front (`palpate.tools.front_balls`). As in `PosedBaseline` its depth is their mean of order
m, s = (Σ w_i s_i^m)^(1/m). The place and the normal of the touch are the means of theirs with the weights
w_i s_i^(m−1), which move steadily as the tool tilts.
"""

from __future__ import annotations

import json

import numpy as np

from palpate.surrogates.surface import TouchedSurface
from palpate.tools import PosedTool, front_balls

__all__ = ["PosedContact"]

ORDER = 4.0  # m, that of `PosedBaseline`


class PosedContact:
    """The touch of a tool on a surface at rest; `tool` is its description as JSON."""

    def __init__(self, tool: str, surface: TouchedSurface) -> None:
        self._tool, self._surface = PosedTool.of(json.loads(tool)), surface
        balls = front_balls(self._tool.shape)
        self._centres = balls[:, :3] + np.array([0.0, 0.0, self._tool.shape.front])
        self._radius, self._shares = float(balls[0, 3]), balls[:, 4]

    def at(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return depth (N,) in m, touched place (N, 3) in m and normal (N, 3) at inputs X (N, 3 + k).

        Without contact the depth is the least gap with the other sign, and the place that under the nearest ball.
        """
        place, turn = self._tool.pose(X)
        centres = place[:, None] + np.einsum("nij,bj->nbi", turn, self._centres)
        distance, slope, _ = self._surface.at(centres.reshape(-1, 3))
        distance, slope = distance.reshape(centres.shape[:2]), slope.reshape(centres.shape)
        depths = self._radius - distance
        size = self._tool.shape.size
        weights = self._shares * np.maximum(depths / size, 0.0) ** (ORDER - 1.0)
        total = (weights * np.maximum(depths / size, 0.0)).sum(axis=1)
        touches = total > 0.0
        nearest = np.eye(len(self._shares))[depths.argmax(axis=1)]
        weights = np.where(touches[:, None], weights, nearest)
        weights /= weights.sum(axis=1, keepdims=True)
        feet = np.einsum("nb,nbi->ni", weights, centres - distance[..., None] * slope)
        normal = np.einsum("nb,nbi->ni", weights, slope)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return np.where(touches, size * total ** (1.0 / ORDER), depths.max(axis=1)), feet, normal
