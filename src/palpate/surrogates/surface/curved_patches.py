"""Coarse triangles bulged into the surface that they stand for, then divided finely.

A triangle with normals at its corners is a cubic patch (curved PN triangle: Vlachos, Peters, Boyd & Mitchell 2001,
"Curved PN triangles"). Along borders and creases the patch follows the curve through its neighbouring edges
instead, the same one seen from both sides, so that no gap opens.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.surrogates.surface.oriented_mesh import CREASE, Corners, OrientedMesh, corners_of

__all__ = ["SMOOTH", "Patches", "patches_of"]

TURN = np.radians(6.0)  # rad, largest angle between the normals of a small triangle's corners
PARTS = 8  # parts of an edge, at most
MOST = 60_000  # small triangles, at most
SMOOTH, SHARP, END = 0, 1, 2  # kinds of a place: inside a smooth piece, on a crease, on the border


@dataclass(frozen=True, eq=False)
class Patches:
    """Small triangles of a curved surface.

    On creases inner and outer side are told apart by the mean normal `outward` of the triangles that meet there
    (Bærentzen & Aanæs 2005, "Signed distance computation using the angle weighted pseudonormal").
    """

    corners: np.ndarray  # (T, 3, 3), m
    normals: np.ndarray  # (T, 3, 3), outward unit normals of the surface at the corners
    places: np.ndarray  # (T, 7) int, rows of `kinds` and `outward` for inside, edges 0 to 2, corners 0 to 2
    kinds: np.ndarray  # (f,) int, SMOOTH, SHARP or END; row 0 is SMOOTH
    outward: np.ndarray  # (f, 3), mean normal; zero where the surface's own is to be taken
    border: np.ndarray  # (b, 2, 3), straight parts of the border, m


def patches_of(mesh: OrientedMesh) -> Patches:
    """The curved surface behind a mesh, in as many parts as its curvature asks."""
    corners = corners_of(mesh)
    parts = _parts(corners.normals, len(mesh.triangles))
    weights, pattern = _pattern(parts)
    shape = _bulged(mesh, corners, weights)
    normals = _turned(mesh.corners, corners.normals, weights)
    kinds, outward, of_edges, of_vertices = _features(mesh, corners)
    places = _places(parts, of_edges, of_vertices, pattern, weights)
    ends = np.argwhere(mesh.border)
    border = mesh.points[np.stack([mesh.triangles[ends[:, 0], (ends[:, 1] + k) % 3] for k in (0, 1)], axis=1)]
    return Patches(
        np.ascontiguousarray(shape[:, pattern].reshape(-1, 3, 3)),
        np.ascontiguousarray(normals[:, pattern].reshape(-1, 3, 3)),
        places,
        kinds,
        outward,
        np.ascontiguousarray(border),
    )


def _parts(normals: np.ndarray, count: int) -> int:
    """Return the number of parts that an edge needs for its normals to turn by no more than `TURN`."""
    cosines = np.einsum("tki,tki->tk", normals, np.roll(normals, -1, axis=1))
    turn = float(np.arccos(np.clip(cosines.min(), -1.0, 1.0)))
    allowed = int(np.sqrt(MOST / count))
    return max(1, min(int(np.ceil(turn / TURN - 1e-6)), PARTS, allowed))


def _pattern(parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric weights (N, 3) of points in a triangle, and the small triangles between them (parts², 3)."""
    number: dict[tuple[int, int], int] = {}
    for j in range(parts + 1):
        for i in range(parts + 1 - j):
            number[i, j] = len(number)
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in number if i + j < parts]
    down = [[(i + 1, j + 1), (i, j + 1), (i + 1, j)] for i, j in number if i + j < parts - 1]
    places = np.array(list(number)) / parts
    weights = np.column_stack([1.0 - places.sum(axis=1), places])
    return weights, np.array([[number[p] for p in one] for one in up + down])


def _bulged(mesh: OrientedMesh, corners: Corners, weights: np.ndarray) -> np.ndarray:
    """Points (t, N, 3) of the cubic patches."""
    handles = _handles(mesh, corners)
    P, (a, b, c) = mesh.corners, weights.T
    E = handles.reshape(-1, 6, 3).mean(axis=1)
    centre = E + (E - P.mean(axis=1)) / 2
    parts = [(a**3, P[:, 0]), (b**3, P[:, 1]), (c**3, P[:, 2]), (6 * a * b * c, centre)]
    w = (a, b, c)
    for k in range(3):
        here, there = w[k], w[(k + 1) % 3]
        parts.append((3 * here**2 * there, handles[:, k, 0]))
        parts.append((3 * here * there**2, handles[:, k, 1]))
    flat = np.einsum("nk,tki->tni", weights, P)
    # a sum of deviations from the flat triangle: what is plane stays plane to the last digit
    return np.asarray(flat + sum(f[:, None] * (q[:, None] - flat) for f, q in parts))


def _handles(mesh: OrientedMesh, corners: Corners) -> np.ndarray:
    """Inner control points (t, 3, 2, 3) of each edge: near its first and near its second corner."""
    P, N = mesh.corners, corners.normals
    ends = mesh.border | mesh.creases
    chord = np.roll(P, -1, axis=1) - P
    tangents = _curves(mesh, ends)
    handles = np.empty((*P.shape[:2], 2, 3))
    for side, (base, normal) in enumerate(((P, N), (np.roll(P, -1, axis=1), np.roll(N, -1, axis=1)))):
        step = chord if side == 0 else -chord
        bent = step - np.einsum("tki,tki->tk", step, normal)[..., None] * normal
        along = tangents[:, :, side]
        curve = np.einsum("tki,tki->tk", step, along)[..., None] * along
        handles[:, :, side] = base + np.where(ends[..., None], curve, bent) / 3
    return handles


def _curves(mesh: OrientedMesh, ends: np.ndarray) -> np.ndarray:
    """Unit tangents (t, 3, 2, 3) at both ends of the edges of borders and creases; a corner keeps its edge's."""
    chord = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    length = np.linalg.norm(chord, axis=2)
    tangents = np.repeat((chord / length[..., None])[:, :, None], 2, axis=2)
    at: dict[int, list[tuple[int, int, int]]] = {}
    for t, k in np.argwhere(ends).tolist():
        partner = int(mesh.neighbours[t, k])
        if partner > 3 * t + k or partner < 0:
            at.setdefault(int(mesh.triangles[t, k]), []).append((t, k, 0))
            at.setdefault(int(mesh.triangles[t, (k + 1) % 3]), []).append((t, k, 1))
    chosen = tangents.copy()
    for meeting in (m for m in at.values() if len(m) == 2):
        (t, k, i), (s, m, j) = meeting
        one, other = tangents[t, k, i], tangents[s, m, j]
        sign = 1.0 if i != j else -1.0
        if sign * (one @ other) > CREASE:
            # the circle through three points: each chord's direction by the other one's length
            mean = one * length[s, m] + sign * other * length[t, k]
            mean /= np.linalg.norm(mean)
            chosen[t, k, i], chosen[s, m, j] = mean, sign * mean
    for t, k in np.argwhere(ends & ~mesh.border).tolist():
        s, m = divmod(int(mesh.neighbours[t, k]), 3)
        if 3 * s + m < 3 * t + k:
            chosen[t, k] = -chosen[s, m, ::-1]
    return chosen


def _turned(P: np.ndarray, N: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Unit normals (t, n, 3) that vary quadratically over each triangle, the same ones along a shared edge.

    A normal in an edge's middle is the one of the cubic through the edge: slopes that lean the same way at both
    ends lean against it between them, so that they sum to nothing over the chord.
    """
    mean = np.einsum("nk,tki->tni", weights**2, N)
    for k in range(3):
        chord, both = P[:, (k + 1) % 3] - P[:, k], N[:, k] + N[:, (k + 1) % 3]
        share = np.einsum("ti,ti->t", chord, both) / np.einsum("ti,ti->t", chord, chord)
        middle = both - 3 * share[:, None] * chord
        mean += (weights[:, k] * weights[:, (k + 1) % 3])[:, None] * middle[:, None]
    return np.asarray(mean / np.linalg.norm(mean, axis=2, keepdims=True))


def _features(mesh: OrientedMesh, corners: Corners) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(kinds (f,), outward (f, 3), rows of the edges (t, 3), rows of the vertices (t, 3))."""
    t = len(mesh.triangles)
    edge_kind = np.where(mesh.border, END, np.where(mesh.creases, SHARP, SMOOTH))
    across = mesh.facets[:, None] + mesh.facets[mesh.neighbours // 3]
    edge_out = np.where(mesh.creases[..., None], across, 0.0)
    vertex_kind, vertex_out = _vertices(mesh, corners, edge_kind)
    kinds = np.concatenate([[SMOOTH], edge_kind.ravel(), vertex_kind])
    outward = np.concatenate([np.zeros((1, 3)), edge_out.reshape(-1, 3), vertex_out])
    of_edges = np.where(edge_kind != SMOOTH, 1 + np.arange(3 * t).reshape(t, 3), 0)
    rows = 1 + 3 * t + mesh.triangles
    return kinds, outward, of_edges, np.where(vertex_kind[mesh.triangles] != SMOOTH, rows, 0)


def _vertices(mesh: OrientedMesh, corners: Corners, edge_kind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Kinds (P,) of the vertices and their angle-weighted normals (P, 3), zero with but one smooth piece."""
    kind = np.zeros(len(mesh.points), dtype=np.int64)
    ends = np.roll(mesh.triangles, -1, axis=1)
    np.maximum.at(kind, mesh.triangles, edge_kind)
    np.maximum.at(kind, ends, edge_kind)
    out = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    back = np.roll(mesh.corners, -2, axis=1) - mesh.corners
    angles = np.arctan2(np.linalg.norm(np.cross(out, back), axis=2), np.einsum("tki,tki->tk", out, back))
    outward = np.zeros_like(mesh.points)
    np.add.at(outward, mesh.triangles, angles[..., None] * mesh.facets[:, None])
    low, high = (np.full(len(mesh.points), v) for v in (corners.pieces.max() + 1, -1))
    np.minimum.at(low, mesh.triangles, corners.pieces)
    np.maximum.at(high, mesh.triangles, corners.pieces)
    outward[low == high] = 0.0
    return kind, outward


def _places(
    parts: int, of_edges: np.ndarray, of_vertices: np.ndarray, pattern: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """Rows (T, 7) of the features on which the small triangles' insides, edges and corners lie."""
    t, count = len(of_edges), len(pattern)
    on = np.zeros((t, len(weights)), dtype=np.int64)
    steps = np.round(weights * parts).astype(int)
    for k in range(3):
        opposite = steps[:, (k + 2) % 3] == 0
        on[:, opposite] = of_edges[:, k : k + 1]
    for k in range(3):
        on[:, np.flatnonzero(steps[:, k] == parts)] = of_vertices[:, k : k + 1]
    places = np.zeros((t, count, 7), dtype=np.int32)
    for k in range(3):
        opposite = steps[:, (k + 2) % 3] == 0
        along = opposite[pattern[:, k]] & opposite[pattern[:, (k + 1) % 3]]
        places[:, along, 1 + k] = of_edges[:, k : k + 1]
    places[:, :, 4:] = on[:, pattern]
    return np.ascontiguousarray(places.reshape(-1, 7))
