"""Repair of surfaces that bound a body but for small faults of the export.

unite_points     corners that coincide become one node
drop_flat        triangles without area go, and neighbours are split at the nodes that they joined
unite_shells     equal triangles on both sides of an inner wall go, doubled ones are kept once
repair_surface   all of it, with a sentence about each repair
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from palpate.format import number

__all__ = [
    "Surface",
    "is_manifold",
    "open_edges",
    "place",
    "repair_surface",
    "unite_points",
    "without_spare_nodes",
]

SAME = 1e-6  # of the body's length, below which two points are one, and a triangle is flat
FURTHEST = 1e-4  # of the body's length: corners further apart are no noise of an export
PASSES = 20  # of splitting at nodes on edges; each meets nodes that the one before it made


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles in space."""

    points: np.ndarray  # (n, 3) positions in m
    triangles: np.ndarray  # (t, 3) nodes, counter-clockwise as seen from outside
    label_of: np.ndarray  # (t,) index into `labels`
    labels: tuple[str, ...] = ("",)  # names that the file gives to parts of the surface
    notes: tuple[str, ...] = field(default=())  # a sentence about each thing that was repaired

    @property
    def length(self) -> float:
        """Longest side of the box around the nodes, m; 1 where there is nothing."""
        if not len(self.points):
            return 1.0
        return float(np.ptp(self.points, axis=0).max()) or 1.0

    def keep(self, chosen: np.ndarray) -> Surface:
        """Return the triangles that a mask or an index chooses, with all nodes."""
        return replace(self, triangles=self.triangles[chosen], label_of=self.label_of[chosen])

    def with_note(self, note: str) -> Surface:
        """Return the surface with one more note."""
        return replace(self, notes=(*self.notes, note))


def _edges(triangles: np.ndarray) -> np.ndarray:
    """Nodes (3 t, 2) of the edges in the order of the triangles, each as its triangle runs along it."""
    return triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def open_edges(triangles: np.ndarray) -> np.ndarray:
    """Index into the edges (3 t) of those that belong to one triangle only."""
    from trimesh.grouping import group_rows

    return np.sort(group_rows(np.sort(_edges(triangles), axis=1), require_count=1))


def is_manifold(triangles: np.ndarray) -> bool:
    """Tell whether each edge belongs to two triangles, which run along it in opposite ways."""
    edges = _edges(triangles)
    ahead, back = np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0)
    return len(ahead) == len(edges) and np.array_equal(ahead, back)


def unite_points(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return for each point the number of the node that stands for it: one for each chain of close points.

    `points` are (n, 3) in m; up to `tolerance`, in m, two points are one. Returns the index (n,) of the first point
    of the chain.
    """
    from scipy.spatial import cKDTree
    from trimesh.graph import connected_component_labels

    # equal ones first: each corner of an STL file comes about six times
    _, first, of = np.unique(points, axis=0, return_index=True, return_inverse=True)
    of = of.ravel()
    pairs = cKDTree(points[first]).query_pairs(tolerance, output_type="ndarray")
    chain = connected_component_labels(pairs, node_count=len(first))[of] if len(pairs) else of
    # np.unique gives the first occurrence, so that nodes keep the order of the file
    _, lead, group = np.unique(chain, return_index=True, return_inverse=True)
    return np.asarray(lead[group.ravel()], dtype=np.int64)


def _unite(surface: Surface, node: np.ndarray) -> Surface:
    """Return the surface on other nodes, without the triangles that have become edges or points."""
    triangles = node[surface.triangles]
    a, b, c = triangles.T
    return replace(surface, triangles=triangles).keep((a != b) & (b != c) & (c != a))


def without_spare_nodes(surface: Surface) -> Surface:
    """Return the surface with those nodes only that its triangles have."""
    used, renumbered = np.unique(surface.triangles, return_inverse=True)
    return replace(
        surface,
        points=surface.points[used],
        triangles=renumbered.reshape(surface.triangles.shape).astype(np.int64),
    )


def _close_gaps(surface: Surface) -> Surface:
    """Unite corners on open edges that miss each other by little, with the least distance that closes the surface."""
    loose = np.unique(_edges(surface.triangles)[open_edges(surface.triangles)])
    if not len(loose):
        return surface
    least = len(open_edges(surface.triangles))
    for tolerance in np.geomspace(SAME, FURTHEST, 9)[1:] * surface.length:
        node = np.arange(len(surface.points))
        node[loose] = loose[unite_points(surface.points[loose], float(tolerance))]
        closed = _unite(surface, node)
        left = len(open_edges(_drop_flat(closed).triangles))
        if left:
            continue
        moved = float(np.linalg.norm(surface.points - surface.points[node], axis=1).max())
        corners = int((node != np.arange(len(node))).sum())
        return closed.with_note(
            f"{corners} corners of triangles missed their neighbours by up to {number(1e3 * moved, 2)} mm and were "
            f"united: {least} edges were open."
        )
    return surface


def _drop_flat(surface: Surface) -> Surface:
    """Return the surface without triangles of no height; neighbours are split at the nodes on their edges."""
    corners = surface.points[surface.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    twice = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    flat = twice <= SAME * surface.length * sides.max(axis=1, initial=0.0)
    kept = surface.keep(~flat) if flat.any() else surface
    split, count = _split_at_nodes(kept)
    if not flat.any() and not count:
        return surface
    if len(open_edges(split.triangles)) > len(open_edges(surface.triangles)):
        return surface
    parts = []
    if flat.any():
        dropped = int(flat.sum())
        parts.append(f"{dropped} flat {'triangle was' if dropped == 1 else 'triangles were'} dropped")
    if count:
        parts.append("1 edge was split at a node" if count == 1 else f"{count} edges were split at nodes")
    return split.with_note(" and ".join(parts) + (" on it." if count == 1 else " on them." if count else "."))


def _split_at_nodes(surface: Surface) -> tuple[Surface, int]:
    """Split triangles where nodes of the open boundary lie on their open edges; and how many edges that were."""
    from scipy.spatial import cKDTree

    count = 0
    for _ in range(PASSES):
        rows = open_edges(surface.triangles)
        if not len(rows):
            break
        ends = _edges(surface.triangles)[rows]
        loose = np.unique(ends)
        start, end = surface.points[ends[:, 0]], surface.points[ends[:, 1]]
        length = np.linalg.norm(end - start, axis=1)
        near = cKDTree(surface.points[loose]).query_ball_point((start + end) / 2, length / 2)
        triangles, labels, gone = [], [], set()
        for row, edge, candidates in zip(rows, ends, near, strict=True):
            triangle = int(row) // 3
            on = loose[candidates]
            on = on[~np.isin(on, edge)]
            along = surface.points[edge[1]] - surface.points[edge[0]]
            reach = surface.points[on] - surface.points[edge[0]]
            share = reach @ along / (along @ along)
            off = np.linalg.norm(reach - share[:, None] * along, axis=1)
            keep = (off <= 2 * SAME * surface.length) & (share > 0) & (share < 1)
            if not keep.any() or triangle in gone:
                continue
            opposite = surface.triangles[triangle, (int(row) % 3 + 2) % 3]
            chain = [edge[0], *on[keep][np.argsort(share[keep])], edge[1]]
            if opposite in chain:
                continue
            gone.add(triangle)
            triangles += [(a, b, opposite) for a, b in pairwise(chain)]
            labels += [surface.label_of[triangle]] * (len(chain) - 1)
        if not gone:
            break
        count += len(gone)
        stay = np.ones(len(surface.triangles), dtype=bool)
        stay[list(gone)] = False
        rest = surface.keep(stay)
        surface = replace(
            rest,
            triangles=np.concatenate([rest.triangles, np.array(triangles, dtype=np.int64)]),
            label_of=np.concatenate([rest.label_of, np.array(labels, dtype=np.int64)]),
        )
    return surface, count


def _unite_shells(surface: Surface) -> Surface:
    """Remove pairs of equal triangles that face each other, and all but one of those that face the same way."""
    triangles = surface.triangles
    key, inverse, count = np.unique(
        np.sort(triangles, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    if (count == 1).all():
        return surface
    inverse = inverse.ravel()
    # an even permutation of the sorted nodes runs one way, an odd one the other
    first = np.argmin(triangles, axis=1)
    rows = np.arange(len(triangles))
    forward = triangles[rows, (first + 1) % 3] < triangles[rows, (first + 2) % 3]
    ahead = np.bincount(inverse, forward, minlength=len(key)).astype(int)
    back = count - ahead
    pairs = np.minimum(ahead, back)
    keep = np.zeros(len(triangles), dtype=bool)
    for way, here, there in ((True, ahead, back), (False, back, ahead)):
        mine = np.flatnonzero(forward == way)
        _, lead = np.unique(inverse[mine], return_index=True)
        lead = mine[lead]
        keep[lead[here[inverse[lead]] > there[inverse[lead]]]] = True
    united = surface.keep(keep)
    doubled = len(triangles) - int(keep.sum()) - 2 * int(pairs.sum())
    if pairs.any():
        middle = surface.points[key[pairs > 0]].mean(axis=(0, 1))
        united = united.with_note(
            f"{int(pairs.sum())} pairs of equal triangles that face each other were removed around "
            f"{place(middle)}: shells that touch there have become one."
        )
    if doubled:
        united = united.with_note(f"{doubled} triangles were there more than once, and are kept once.")
    return united


def place(point: np.ndarray) -> str:
    """Return a place in words, in m."""
    return "(" + ", ".join(f"{v:.4g}" for v in point) + ") m"


def repair_surface(surface: Surface) -> Surface:
    """Return the surface with united corners, without flat and doubled triangles, and a note about each repair.

    What is open or ambiguous after that is left as it is: `require_closed` says where.
    """
    united = _unite(surface, unite_points(surface.points, SAME * surface.length))
    united = without_spare_nodes(united)
    united = _drop_flat(united)
    united = _drop_flat(_close_gaps(united))
    return without_spare_nodes(_unite_shells(united))
