"""Surfaces to draw: split along their sharp edges, marked where a hand may touch, made where a file holds none."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.runtime.touchable import Touchable
from palpate.surrogates import FieldSurrogate
from palpate.viewer.messages import Surface

__all__ = ["Split", "relief", "split", "touchable_triangles"]

CREASE = math.cos(math.radians(40.0))

ALONG = 48  # cells of a relief along either side
STEPS = 30  # steps of Newton's method down to the surface
TRUE = 1e-3  # distance over the probe's radius, within which a drawn point lies on the surface
NEAR = 0.1  # distance over the probe's radius, within which a triangle belongs to the touched surface


@dataclass(frozen=True, eq=False)
class Split:
    """A surface whose points belong to one smooth patch each."""

    nodes: np.ndarray  # (p,) int, the body's node that each point stands for
    triangles: np.ndarray  # (t, 3) int, points
    creases: np.ndarray  # (s, 2) int, points at the ends of each sharp edge
    fixed: np.ndarray  # (s, 2) int, points at the ends of each edge around the fixed triangles

    def surface(self, rest: np.ndarray) -> Surface:
        """Return the surface as a message that marks nothing; `rest` (node, 3) are the body's nodes, m."""
        none = np.zeros(0)
        return Surface(
            rest=np.asarray(rest)[self.nodes].ravel(),
            triangles=self.triangles.ravel(),
            creases=self.creases.ravel(),
            fixed=self.fixed.ravel(),
            touchable=none,
            yielding=none,
            normals=none,
        )


def split(rest: np.ndarray, triangles: np.ndarray, fixed: np.ndarray) -> Split:
    """Split a surface along edges sharper than 40°; the border of the triangles `fixed` (t,) bool is found, too.

    `rest` (node, 3) is in m; `triangles` (t, 3) are nodes, counter-clockwise as seen from outside.
    """
    first, second = _pairs(triangles)  # corners at which a shared edge starts and ends, on both sides
    a, b, c = np.moveaxis(rest[triangles], 1, 0)
    n = np.cross(b - a, c - a)
    n = n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)
    one, two = first[:, 0] // 3, second[:, 0] // 3
    smooth = np.einsum("si,si->s", n[one], n[two]) >= CREASE
    same = np.concatenate([np.stack([first[smooth, k], second[smooth, k]], axis=1) for k in (0, 1)])
    patch = _components(3 * len(triangles), same)
    corners, point = np.unique(patch, return_inverse=True)
    nodes, faces = triangles.ravel()[corners], point.reshape(-1, 3)
    sharp, around = ~smooth, fixed[one] != fixed[two]
    flat = faces.ravel()
    return Split(nodes, faces, flat[first[sharp]], flat[first[around]])


def _pairs(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each edge that two triangles share: its two corners (s, 2) in either, in the same order of nodes."""
    corner = np.arange(triangles.size).reshape(-1, 3)
    ends = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]])
    nodes = triangles.ravel()[ends]
    turned = nodes[:, 0] > nodes[:, 1]
    ends[turned], nodes[turned] = ends[turned][:, ::-1], nodes[turned][:, ::-1]
    order = np.lexsort((nodes[:, 1], nodes[:, 0]))
    ends, nodes = ends[order], nodes[order]
    twin = np.flatnonzero(np.all(nodes[1:] == nodes[:-1], axis=1))
    return ends[twin], ends[twin + 1]


def _components(count: int, pairs: np.ndarray) -> np.ndarray:
    """Smallest member of each one's group (count,), where `pairs` (s, 2) belong together."""
    label = np.arange(count)
    while True:
        least = np.minimum(label[pairs[:, 0]], label[pairs[:, 1]])
        after = label.copy()
        np.minimum.at(after, pairs[:, 0], least)
        np.minimum.at(after, pairs[:, 1], least)
        after = after[after]
        if np.array_equal(after, label):
            return label
        label = after


def touchable_triangles(body: Touchable, field: FieldSurrogate, *, detail: bool = False) -> np.ndarray:
    """Return for each triangle (t,) of a field's surface whether it belongs to the touched surface.

    With `detail` the triangles are those that pictures show. These may lie beside the touched surface, which is that
    of the elements: there the triangles count to which they are bound. Two jaws are held by themselves, and no
    triangle counts.
    """
    if body.gripper is not None:
        return np.zeros(len(field.pictured[1] if detail else field.triangles), bool)
    corners = field.points[field.triangles]
    distance, along = _beside(body, corners)
    mark = (np.abs(distance) < NEAR * body.radius) & along
    if field.local_mode is not None:
        mark &= field.touched[field.triangles].all(axis=1)
    if detail and field.drawn is not None:
        points, triangles = field.pictured
        mark = field.drawn.spread_mark(mark) & _beside(body, points[triangles])[1]
    return np.asarray(mark)


def _beside(body: Touchable, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances (t,) of triangles (t, 3, 3) to the touched surface, m, and whether they look its way."""
    assert body.surface is not None
    distance, slope, _ = body.surface.at(corners.mean(axis=1) - body.shift)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return distance, np.einsum("ti,ti->t", normal, slope) > 0.5 * np.linalg.norm(normal, axis=1)


def relief(body: Touchable) -> tuple[np.ndarray, np.ndarray]:
    """Return the touched surface at rest where the body was trained, points (n, 3) in m and triangles (t, 3).

    A grid across the normal in the middle is lowered on the zero of the surface's distance; where it does not
    arrive, there is a hole. Where no surface is known the grid is flat. A body between two jaws has none.
    """
    if body.gripper is not None:
        raise UsageError(
            f"{body.name} between two jaws has no shape to draw.",
            why="It was learnt without a field, and its surface is known near the jaws alone.",
            fix="Learn it with its shape, or ask it in Python or by `palpate ask`.",
        )
    across, X = _across(body.normal), body.trained_inputs
    places = np.array([body.held_place(x) for x in X[:, 3:]]) if body.holds else X[:, :3]
    middle = places.mean(axis=0) if body.holds else body.home
    feet = (places - middle) @ across.T
    margin = 2.0 * body.radius if body.holds else 0.0  # around the patch
    low, high = feet.min(axis=0) - margin, feet.max(axis=0) + margin
    u, v = (np.linspace(low[k], high[k], ALONG + 1) for k in (0, 1))
    flat = middle + np.stack(np.meshgrid(u, v, indexing="ij"), axis=2).reshape(-1, 2) @ across
    if body.surface is None:
        points, arrived = flat, np.ones(len(flat), bool)
    else:
        points, arrived = _lowered(body, flat)
        points = points + body.shift
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
    assert body.surface is not None
    normal, most = body.normal, body.radius
    for _ in range(STEPS):
        distance, slope, _ = body.surface.at(points)
        along = np.maximum(slope @ normal, 0.2)
        points = points - np.clip(distance / along, -most, most)[:, None] * normal
    left = np.abs(body.surface.at(points)[0])
    return points, left < TRUE * body.radius
