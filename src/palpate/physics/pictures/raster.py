"""Triangles to pixels, with a depth buffer.

For each pixel the nearest triangle's attributes are kept, interpolated linearly on the screen, which is exact for a
parallel projection.
"""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["draw_triangles"]

_jit = njit(cache=True, nogil=True, error_model="numpy")


@_jit
def draw_triangles(screen: np.ndarray, attributes: np.ndarray, depth: np.ndarray, image: np.ndarray) -> None:
    """Draw triangles into a depth buffer and an image of attributes.

    Parameters
    ----------
    screen : (t, 3, 3) array
        Column, row and depth of each corner; larger depths are nearer.
    attributes : (t, 3, k) array
    depth : (height, width) array
        Starts at −inf; changed in place.
    image : (height, width, k) array
        Changed in place.
    """
    height, width = depth.shape
    for t in range(len(screen)):
        x0, y0, x1, y1 = screen[t, 0, 0], screen[t, 0, 1], screen[t, 1, 0], screen[t, 1, 1]
        x2, y2 = screen[t, 2, 0], screen[t, 2, 1]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area == 0.0:
            continue
        left = max(int(np.floor(min(x0, x1, x2))), 0)
        right = min(int(np.ceil(max(x0, x1, x2))) + 1, width)
        top = max(int(np.floor(min(y0, y1, y2))), 0)
        bottom = min(int(np.ceil(max(y0, y1, y2))) + 1, height)
        for row in range(top, bottom):
            for column in range(left, right):
                px, py = column + 0.5, row + 0.5
                w1 = ((px - x0) * (y2 - y0) - (x2 - x0) * (py - y0)) / area
                w2 = ((x1 - x0) * (py - y0) - (px - x0) * (y1 - y0)) / area
                w0 = 1.0 - w1 - w2
                if w0 < -1e-9 or w1 < -1e-9 or w2 < -1e-9:
                    continue
                z = w0 * screen[t, 0, 2] + w1 * screen[t, 1, 2] + w2 * screen[t, 2, 2]
                if z <= depth[row, column]:
                    continue
                depth[row, column] = z
                for k in range(attributes.shape[2]):
                    image[row, column, k] = (
                        w0 * attributes[t, 0, k] + w1 * attributes[t, 1, k] + w2 * attributes[t, 2, k]
                    )
