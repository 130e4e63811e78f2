"""Checks that a surface bounds one body: closed, a manifold, facing outwards, and nowhere in its own way.

require_closed   refuses what bounds no body, with the place of the fault
shells_of        the closed shells of a surface, and which of them are cavities
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.format import bound
from palpate.physics.shapes.surface_repair import place
from palpate.physics.shapes.surface_wrap import COARSEST

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = [
    "Shells",
    "closest_points",
    "require_closed",
    "shells_of",
    "surface_gap",
    "touching_shells",
    "winding_number",
]

FLUSH = 1e-6  # of the body's length, below which two faces lie on each other
CLOSE = 64  # triangles whose distance to a point is measured
# A body's length over the size of the wrap that is proposed: half that size takes four times the triangles, which are
# then simplified for more than a minute
WRAPPED = 40.0
PAIRS = 500_000  # pairs of triangles that are compared at a time


def require_closed(surface: Trimesh, source: str) -> None:
    """Refuse a surface that bounds no body: empty, open, not a manifold, facing inwards or cutting itself."""
    if not len(surface.faces):
        raise UsageError(
            f"{source} holds no triangles.",
            why="The file is empty.",
            fix="Export the surface of the body again.",
        )
    edges, count = surface.edges_unique, np.bincount(surface.edges_unique_inverse)
    open_edges, crowded = edges[count == 1], edges[count > 2]
    if len(open_edges):
        raise _mended_by_wrap(
            surface,
            f"The surface of {source} is open: {len(open_edges)} edges belong to one triangle only.",
            why=f"There {_where('hole', surface, open_edges)}, and a body needs a closed surface.",
            fix="Close the hole in the program that made the file, with its repair or fill-holes function, or have it "
            "wrapped",
        )
    if len(crowded):
        raise UsageError(
            f"The surface of {source} is not a manifold: {len(crowded)} edges belong to more than two triangles.",
            why=f"There {_where('seam', surface, crowded)} where sheets meet, so that inside and outside are not "
            "defined.",
            fix="Remove inner walls and doubled sheets, or unite touching bodies, before the export.",
        )
    if not surface.is_winding_consistent:
        twice = len(surface.edges) - len(np.unique(surface.edges, axis=0))
        raise _mended_by_wrap(
            surface,
            f"The triangles of {source} disagree on which side is outside, along {twice} edges.",
            why="Some of them are inverted: their corners run the other way than their neighbours'.",
            fix="Recalculate the normals, and export again, or have it wrapped",
        )
    if len(pinched := _pinch_points(surface)):
        raise UsageError(
            f"The surface of {source} is not a manifold: at {len(pinched)} nodes sheets meet in a point only.",
            why=f"The first is at {place(surface.vertices[pinched[0]])}, where the body would hang by a point.",
            fix="Let the parts overlap and unite them (Boolean union), or move them apart, before the export.",
        )
    if (crossing := _crossing(surface)) is not None:
        raise _mended_by_wrap(
            surface,
            f"The surface of {source} cuts itself: triangles {crossing[0]} and {crossing[1]} cross.",
            why=f"They do so near {place(surface.triangles_center[crossing[0]])}; a body's surface has an inside and "
            "an outside everywhere.",
            fix="Have it wrapped, which moves the surface a little",
        )
    _require_apart(surface, source)
    _require_outside(surface, shells_of(surface), source)


def _require_apart(surface: Trimesh, source: str) -> None:
    """Refuse closed shells whose faces lie on each other."""
    if (contact := touching_shells(surface)) is not None:
        first, second, centre = contact
        raise UsageError(
            f"Closed shells {first} and {second} of the surface of {source} touch around {place(centre)}.",
            why="Faces of them lie on each other and share no nodes, so that the body is neither one nor two.",
            fix="Unite the parts (Boolean union) in the program that made the file, or move them apart.",
        )


def _mended_by_wrap(surface: Trimesh, what: str, why: str, fix: str) -> UsageError:
    """Return the refusal of a surface that may be wrapped: by a fortieth of its length, an eighth of its thickness."""
    extents = 1e3 * surface.extents[surface.extents > 0]  # mm
    size = min(float(f"{extents.max() / WRAPPED:.1g}"), bound(extents.min() / COARSEST))
    ways = (
        f"`palpate touch` with --wrap {size:g}mm, wrap = '{size:g} mm' in a study's [body], or "
        f"ImportedSolid(…, wrap={1e-3 * size:g})"
    )
    error = UsageError(what, why=why, fix=f"{fix}: {ways}.")
    error.wrap = 1e-3 * size
    return error


def _where(word: str, surface: Trimesh, edges: np.ndarray) -> str:
    """Tell how many chains edges (n, 2) make, and where the longest is: "is a hole around (0, 0, 1) m"."""
    from trimesh.graph import connected_component_labels

    chain = connected_component_labels(edges, node_count=len(surface.vertices))[edges[:, 0]]
    longest, count = np.unique(chain, return_counts=True)
    middle = surface.vertices[edges[chain == longest[count.argmax()]]].mean(axis=(0, 1))
    if len(longest) == 1:
        return f"is a {word} around {place(middle)}"
    return f"are {len(longest)} {word}s, the largest around {place(middle)}"


def _crossing(surface: Trimesh) -> tuple[int, int] | None:
    """Two triangles that cross without sharing a node; None where there are none."""
    corners, nodes = np.asarray(surface.triangles), np.asarray(surface.faces)
    for first, second in _neighbours(corners, 0.0):
        apart = ~(nodes[second][:, :, None] == nodes[first][:, None, :]).any(axis=(1, 2))
        a, b = first[apart], second[apart]
        hit = _pierces(corners[a], corners[b]) | _pierces(corners[b], corners[a])
        if hit.any():
            low, high = sorted((int(a[hit.argmax()]), int(b[hit.argmax()])))
            return low, high
    return None


def _neighbours(corners: np.ndarray, slack: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield pairs of triangles of (t, 3, 3) whose boxes come within `slack` m of each other, many at a time."""
    low, high = corners.min(axis=1) - slack, corners.max(axis=1)
    order = np.argsort(low[:, 0], kind="stable")
    stop = np.searchsorted(low[order, 0], high[order, 0], side="right")
    count = np.maximum(stop - np.arange(len(order)) - 1, 0)
    total = np.cumsum(count)
    begin = 0
    while begin < len(order):
        before = int(total[begin - 1]) if begin else 0
        end = max(int(np.searchsorted(total, before + PAIRS, side="right")), begin + 1)
        here = count[begin:end]
        rank = np.repeat(np.arange(begin, end), here)
        step = np.arange(len(rank)) - np.repeat(np.cumsum(here) - here, here)
        first, second = order[rank], order[rank + 1 + step]
        near = np.ones(len(first), dtype=bool)
        for axis in (1, 2):
            near &= (low[second, axis] <= high[first, axis]) & (high[second, axis] >= low[first, axis])
        yield first[near], second[near]
        begin = end


@dataclass(frozen=True, eq=False)
class Shells:
    """The closed shells of a surface."""

    shell_of: np.ndarray  # (t,) number of each triangle's shell, from 0
    volumes: np.ndarray  # (s,) m³; negative where triangles face inwards, as those of a cavity do
    inside: tuple[tuple[int, ...], ...]  # for each shell those that contain it


def shells_of(surface: Trimesh) -> Shells:
    """Return the shells of a closed surface, none of which touch or cut each other."""
    from trimesh.graph import connected_component_labels

    shell = connected_component_labels(surface.face_adjacency, node_count=len(surface.faces))
    corners = np.asarray(surface.triangles)
    cone = np.einsum("ti,ti->t", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) / 6
    count = int(shell.max(initial=-1)) + 1
    volumes = np.bincount(shell, cone, minlength=count)
    parts = [corners[shell == i] for i in range(count)] if count > 1 else [corners]
    low = np.array([part.min(axis=(0, 1)) for part in parts])
    high = np.array([part.max(axis=(0, 1)) for part in parts])
    inside = tuple(
        tuple(
            j
            for j in range(count)
            if j != i
            and bool((low[j] <= low[i]).all() and (high[j] >= high[i]).all())
            and abs(winding_number(parts[j], parts[i][0, 0])) > 0.5
        )
        for i in range(count)
    )
    return Shells(np.asarray(shell), volumes, inside)


def winding_number(corners: np.ndarray, place: np.ndarray) -> float:
    """Return the number of times a closed surface winds around a place (3,) in m: 1 inside, 0 outside.

    The triangles (t, 3, 3) in m are counter-clockwise as seen from outside. The number is the sum of their solid angles
    over 4π (Van Oosterom & Strackee 1983, IEEE Trans. Biomed. Eng. 30, 125-126).
    """
    a, b, c = np.moveaxis(corners - place, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    above = np.einsum("ti,ti->t", np.cross(a, b), c)
    ab, bc, ca = (np.einsum("ti,ti->t", u, v) for u, v in ((a, b), (b, c), (c, a)))
    below = la * lb * lc + ab * lc + bc * la + ca * lb
    return float(2 * np.arctan2(above, below).sum() / (4 * np.pi))


def closest_points(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the point (n, 3) of each triangle (n, 3, 3) that is nearest to a point (n, 3)."""
    from trimesh.triangles import closest_point

    # trimesh compares fourth powers of lengths with fixed bounds, so that triangles of millimetres in m are nothing
    origin = triangles[:, :1]
    size = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)[:, None]
    nearest = closest_point((triangles - origin) / size[:, :, None], (points - origin[:, 0]) / size)
    return np.asarray(nearest * size + origin[:, 0])


def surface_gap(corners: np.ndarray, others: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the least distance in m from triangles (t, 3, 3) to others (u, 3, 3), and the place (3,) on the former.

    Distances are those of corners to triangles, of the `CLOSE` triangles whose centres are nearest.
    """
    from scipy.spatial import cKDTree

    least, where = np.inf, corners[0, 0]
    for points, triangles, turned in ((corners, others, False), (others, corners, True)):
        nodes = np.unique(points.reshape(-1, 3), axis=0)
        count = min(CLOSE, len(triangles))
        near = cKDTree(triangles.mean(axis=1)).query(nodes, k=count)[1].reshape(len(nodes), count)
        start = np.repeat(nodes, count, axis=0)
        end = closest_points(triangles[near.ravel()], start)
        distance = np.linalg.norm(end - start, axis=1)
        best = int(distance.argmin())
        if distance[best] < least:
            least, where = float(distance[best]), (end if turned else start)[best]
    return least, where


def _require_outside(surface: Trimesh, shells: Shells, source: str) -> None:
    """Refuse shells that face the wrong way: outwards inside a body, inwards outside of it."""
    for number, (volume, around) in enumerate(zip(shells.volumes, shells.inside, strict=True)):
        cavity = len(around) % 2 == 1
        if (volume < 0) == cavity:
            continue
        alone = len(shells.volumes) == 1
        where = place(np.asarray(surface.triangles_center)[shells.shell_of == number].mean(axis=0))
        if cavity:
            raise UsageError(
                f"Closed shell {number + 1} of the surface of {source} lies inside shell {around[0] + 1}, "
                f"around {where}.",
                why="It faces outwards, so that it would be a body inside a body; a cavity faces inwards.",
                fix="Flip its normals if it is a cavity, remove it if it is a doubled wall; a core of another "
                "material needs a STEP file or a volume mesh.",
            )
        raise UsageError(
            f"The surface of {source} is inside out."
            if alone
            else f"Closed shell {number + 1} of the surface of {source}, around {where}, is inside out.",
            why="Its triangles face inwards, so that the body would be everything around it.",
            fix="Flip the normals and export again.",
        )


def _pinch_points(surface: Trimesh) -> np.ndarray:
    """Nodes at which sheets meet in a point only: their triangles are more than one fan."""
    from trimesh.graph import connected_component_labels

    nodes = np.asarray(surface.faces)
    # a corner of a triangle is joined to the corner of its neighbour at the same node of their edge
    corners = np.arange(nodes.size).reshape(nodes.shape)
    rows = np.asarray(surface.face_adjacency)
    ends = np.asarray(surface.face_adjacency_edges)
    pairs = [
        np.column_stack(
            [
                corners[rows[:, side], (nodes[rows[:, side]] == ends[:, end, None]).argmax(axis=1)]
                for side in (0, 1)
            ]
        )
        for end in (0, 1)
    ]
    fan = connected_component_labels(np.concatenate(pairs), node_count=nodes.size)
    fans = np.unique(np.column_stack([nodes.ravel(), fan]), axis=0)
    number, count = np.unique(fans[:, 0], return_counts=True)
    return np.asarray(number[count > 1])


def touching_shells(surface: Trimesh) -> tuple[int, int, np.ndarray] | None:
    """Two closed shells, counted from 1, with faces in one plane that overlap, and where in m; None without such."""
    from trimesh.graph import connected_component_labels

    shell = connected_component_labels(surface.face_adjacency, node_count=len(surface.faces))
    if not shell.any():
        return None
    corners, normals = np.asarray(surface.triangles), np.asarray(surface.face_normals)
    tolerance = FLUSH * float(surface.extents.max())
    for first, second in _neighbours(corners, tolerance):
        aligned = np.abs(np.einsum("ni,ni->n", normals[first], normals[second])) > 1 - FLUSH
        chosen = (shell[first] != shell[second]) & aligned
        a, b = first[chosen], second[chosen]
        height = np.einsum("nki,ni->nk", corners[b] - corners[a][:, :1], normals[a])
        level = np.abs(height).max(axis=1, initial=0.0) < tolerance
        a, b = a[level], b[level]
        touching = _overlap(corners[a], corners[b], normals[a], tolerance)
        if touching.any():
            low, high = sorted((int(shell[a[touching][0]]) + 1, int(shell[b[touching][0]]) + 1))
            return low, high, corners[b[touching]].mean(axis=(0, 1))
    return None


def _overlap(corners: np.ndarray, others: np.ndarray, normals: np.ndarray, tolerance: float) -> np.ndarray:
    """Mask (n,) of pairs of triangles (n, 3, 3) in one plane that share an area: no edge separates them."""
    together = np.ones(len(others), dtype=bool)
    for triangles in (corners, others):
        edges = np.roll(triangles, -1, axis=1) - triangles
        across = np.cross(edges, normals[:, None, :])
        across /= np.linalg.norm(across, axis=2, keepdims=True)
        mine = np.einsum("nek,nck->nec", across, corners)
        theirs = np.einsum("nek,nck->nec", across, others)
        depth = np.minimum(mine.max(axis=2), theirs.max(axis=2)) - np.maximum(
            mine.min(axis=2), theirs.min(axis=2)
        )
        together &= (depth > tolerance).all(axis=1)
    return together


def _pierces(edges_of: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Mask (n,) of pairs (n, 3, 3) in which an edge of the first triangle passes through the inside of the second.

    Segment against triangle by Möller & Trumbore 1997 (J. Graph. Tools 2, 21-28).
    """
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    hit = np.zeros(len(triangles), dtype=bool)
    for k in range(3):
        start = edges_of[:, k]
        along = edges_of[:, (k + 1) % 3] - start
        across = np.cross(along, v)
        determinant = np.einsum("ni,ni->n", u, across)
        slanted = np.abs(determinant) > 1e-12 * np.linalg.norm(u, axis=1) * np.linalg.norm(across, axis=1)
        scale = 1 / np.where(slanted, determinant, 1.0)
        reach = start - a
        turned = np.cross(reach, u)
        p = scale * np.einsum("ni,ni->n", reach, across)
        q = scale * np.einsum("ni,ni->n", along, turned)
        t = scale * np.einsum("ni,ni->n", v, turned)
        edge = 1e-9
        hit |= slanted & (p > edge) & (q > edge) & (p + q < 1 - edge) & (t > edge) & (t < 1 - edge)
    return hit
