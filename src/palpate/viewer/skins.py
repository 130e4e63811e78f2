"""Which part of a body's surface a probe may touch, and that surface itself where a file holds only its distance."""

from __future__ import annotations

import numpy as np

from palpate.runtime.touchable import Touchable
from palpate.surrogates import FieldSurrogate

__all__ = ["relief", "touchable_triangles"]

ALONG = 48  # cells of a relief along either side
STEPS = 30  # of Newton's method down to the surface
TRUE = 1e-3  # of the probe's radius: how near the surface a point of it must lie
NEAR = 0.1  # of the probe's radius: a triangle as near as this to the touched surface is part of it


def touchable_triangles(body: Touchable, field: FieldSurrogate) -> np.ndarray:
    """Whether each triangle (t,) of a field's surface belongs to the touched surface."""
    corners = field.points[field.triangles]
    if field.dimple is not None:
        return np.asarray(field.touched[field.triangles].all(axis=1) & _near(body, corners))
    return _near(body, corners)


def _near(body: Touchable, corners: np.ndarray) -> np.ndarray:
    """Whether triangles (t, 3, 3) lie on the touched surface and look the way it does."""
    distance, slope, _ = body.energy.surface.at(corners.mean(axis=1))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.einsum("ti,ti->t", normal, slope) > 0.5 * np.linalg.norm(normal, axis=1)
    return np.asarray((np.abs(distance) < NEAR * body.radius) & along)


def relief(body: Touchable) -> tuple[np.ndarray, np.ndarray]:
    """The touched surface at rest where the body was trained, points (n, 3) in m and triangles (t, 3).

    A grid across the normal in the middle is lowered on the zero of the surface's distance; where it does not
    arrive, there is a hole.
    """
    across = _across(body.normal)
    feet = (body.trained_inputs[:, :3] - body.home) @ across.T
    low, high = feet.min(axis=0), feet.max(axis=0)
    u, v = (np.linspace(low[k], high[k], ALONG + 1) for k in (0, 1))
    flat = np.stack(np.meshgrid(u, v, indexing="ij"), axis=2).reshape(-1, 2)
    points, arrived = _lowered(body, body.home + flat @ across)
    k = (np.arange(ALONG)[:, None] * (ALONG + 1) + np.arange(ALONG)).ravel()
    lower = np.stack([k, k + ALONG + 1, k + ALONG + 2], axis=1)
    upper = np.stack([k, k + ALONG + 2, k + 1], axis=1)
    triangles = np.vstack([lower, upper])
    return points, triangles[arrived[triangles].all(axis=1)]


def _across(normal: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) across a normal, which make a right-handed frame with it."""
    helper = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = helper - (helper @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def _lowered(body: Touchable, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) moved along the middle's normal to distance zero, and which of them got there."""
    normal, most = body.normal, body.radius
    for _ in range(STEPS):
        distance, slope, _ = body.energy.surface.at(points)
        along = np.maximum(slope @ normal, 0.2)
        points = points - np.clip(distance / along, -most, most)[:, None] * normal
    left = np.abs(body.energy.surface.at(points)[0])
    return points, left < TRUE * body.radius
