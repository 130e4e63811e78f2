"""Outlines of a body, and which part of a line the body hides."""

from __future__ import annotations

import numpy as np

from palpate.physics.pictures.camera import Camera
from palpate.physics.pictures.skin import CREASE

__all__ = ["ball_lines", "border", "cut_off", "hatching", "outline", "split_hidden"]

ROUND = 72  # pieces of a circle
PIECES = 12  # of an edge, each of which is hidden or not


def _edges(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (s, 2) that two triangles share, and those two triangles (s, 2); free edges name one twice."""
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    edges, inverse = np.unique(ends, axis=0, return_inverse=True)
    inverse = inverse.ravel()
    order = np.argsort(inverse, kind="stable")
    starts = np.searchsorted(inverse[order], np.arange(len(edges)))
    last = np.append(starts[1:], len(order)) - 1
    return edges, np.stack([owner[order][starts], owner[order][last]], axis=1)


def outline(points: np.ndarray, triangles: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Edges (s, 2) that draw a surface: creases, and the silhouette seen from direction `towards` (3,)."""
    edges, sides = _edges(triangles)
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    one, two = normals[sides[:, 0]], normals[sides[:, 1]]
    crease = np.einsum("si,si->s", one, two) < CREASE
    facing = (normals @ towards) > 0
    rim = facing[sides[:, 0]] != facing[sides[:, 1]]
    return np.asarray(edges[crease | rim | (sides[:, 0] == sides[:, 1])])


def ball_lines(centre: np.ndarray, radius: float, towards: np.ndarray) -> np.ndarray:
    """Segments (s, 2, 3) that draw a sphere seen from direction `towards` (3,): its outline and its equator."""
    angle = np.linspace(0, 2 * np.pi, ROUND + 1)
    circles = []
    for pole in (towards, np.array([0.0, 0.0, 1.0])):
        first = np.cross(pole, np.eye(3)[np.argmin(np.abs(pole))])
        first /= np.linalg.norm(first)
        second = np.cross(pole, first)
        around = centre + radius * (np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second))
        circles.append(np.stack([around[:-1], around[1:]], axis=1))
    return np.concatenate(circles)


def border(triangles: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Edges (s, 2) around the `chosen` (t,) triangles of a surface."""
    edges, sides = _edges(triangles)
    return np.asarray(edges[chosen[sides[:, 0]] != chosen[sides[:, 1]]])


def cut_off(segments: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """The parts of segments (s, 2, 3) below a plane; `heights` (s, 2) of their ends above it."""
    above = heights > 0
    cut = segments.copy()
    for one, other in ((0, 1), (1, 0)):
        crossing = above[:, one] & ~above[:, other]
        share = heights[crossing, one] / (heights[crossing, one] - heights[crossing, other])
        start, end = segments[crossing, one], segments[crossing, other]
        cut[crossing, one] = start + share[:, None] * (end - start)
    return np.asarray(cut[~above.all(axis=1)])


def hatching(segments: np.ndarray, spacing: float, offset: np.ndarray) -> np.ndarray:
    """Short strokes (n, 2, 3) off segments (s, 2, 3) at even distances: the draughtsman's mark of a fixed surface."""
    strokes = [np.empty((0, 2, 3))]
    for start, end in segments:
        count = max(round(float(np.linalg.norm(end - start)) / spacing), 1)
        along = start + (end - start) * ((np.arange(count) + 0.5) / count)[:, None]
        strokes.append(np.stack([along, along + offset], axis=1))
    return np.concatenate(strokes)


def split_hidden(
    segments: np.ndarray, camera: Camera, depth: np.ndarray, slack: float
) -> tuple[np.ndarray, np.ndarray]:
    """Pieces (n, 2, 2) of segments (s, 2, 3) in pixels: those in front of the depth buffer, and those behind.

    `slack` in m is how far a line may lie behind what covers it and still be seen: its own surface must not hide it.
    """
    if not len(segments):
        return np.empty((0, 2, 2)), np.empty((0, 2, 2))
    share = np.linspace(0, 1, PIECES + 1)[None, :, None]
    ends = camera.project(segments)
    knots = ends[:, :1] + share * (ends[:, 1:] - ends[:, :1])
    middle = (knots[:, 1:] + knots[:, :-1]) / 2
    height, width = depth.shape
    column = np.clip(middle[..., 0].astype(int), 0, width - 1)
    row = np.clip(middle[..., 1].astype(int), 0, height - 1)
    seen = (middle[..., 2] >= depth[row, column] - slack).ravel()
    pieces = np.stack([knots[:, :-1, :2], knots[:, 1:, :2]], axis=2).reshape(-1, 2, 2)
    return pieces[seen], pieces[~seen]
