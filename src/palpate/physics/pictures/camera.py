"""From metres to pixels: a parallel projection, z up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["Camera"]


@dataclass(frozen=True, eq=False)
class Camera:
    """Looks at a body from far away.

    Attributes
    ----------
    axes : (3, 3) array
        Rows: to the right, up, and towards the camera.
    centre : (3,) array
        The point in the middle of the picture, m.
    scale : float
        Pixels per metre.
    size : (width, height)
        Pixels.
    """

    axes: np.ndarray
    centre: np.ndarray
    scale: float
    size: tuple[int, int]

    @classmethod
    def around(
        cls, points: np.ndarray, view: tuple[float, float], size: tuple[int, int], margin: float = 0.06
    ) -> Camera:
        """The camera that sees all `points` (n, 3) from azimuth and elevation `view` in degrees.

        The azimuth is that of the camera seen from the body: 0 on the x axis, 90 on the y axis.
        """
        azimuth, elevation = map(math.radians, view)
        towards = np.array(
            [
                math.cos(elevation) * math.cos(azimuth),
                math.cos(elevation) * math.sin(azimuth),
                math.sin(elevation),
            ]
        )
        right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
        axes = np.array([right, np.cross(towards, right), towards])
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        room = np.maximum(high - low, 1e-12)[:2] * (1 + 2 * margin)
        scale = float(min(size[0] / room[0], size[1] / room[1]))
        return cls(axes, (low + high) / 2 @ axes, scale, size)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Column and row in pixels from the upper left, and depth towards the camera in m, of (..., 3) points."""
        seen = (points - self.centre) @ self.axes.T
        width, height = self.size
        column = width / 2 + self.scale * seen[..., 0]
        row = height / 2 - self.scale * seen[..., 1]
        return np.stack([column, row, seen[..., 2]], axis=-1)
