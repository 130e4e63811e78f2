"""The surfaces between the labels of a labelmap, as triangles that fit together where three tissues meet.

Labels are smoothed and sampled on a lattice of the elements' size. Each cube of the lattice that holds two labels has a
vertex, and each pair of neighbours with different labels four triangles' corners around it (surface nets, Gibson 1998,
Constrained elastic surface nets, MERL TR99-24). A vertex is then moved to where the smoothed indicators of the cube's
labels are equal, within its cube. The terraces of the voxels are smoothed away within half a voxel, and each label gets
the volume of its voxels again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.physics.shapes.scan_file import LabelImage

__all__ = ["LabelSurface", "label_surface"]

# standard deviation of the smoothing, in voxels against steps, and in the lattice's spacings against gaps of sampling
SMOOTH_VOXEL, SMOOTH_LATTICE = 0.85, 0.35
EVEN, EXACT = 8, 4  # rounds that spread the vertices and step back to the surface, and of these steps alone
WITHIN = 0.45  # of the lattice's spacing: a vertex stays in its cube, so that surfaces don't cut each other
FAIR = 3.0  # voxels: waves of 2π times this length are halved where terraces are removed
STEEP = 3.0  # largest cotangent of a triangle's angle: slivers would else hold their corners
HELD = 1e6  # lattice squares: what a move of a place that is held weighs
LEAST_SHARE = 0.05  # of a lattice square: least area around a vertex, against slivers
# rounds in which volumes are kept, and how far surfaces move in each, in lattice spacings
SHIFTS, MOST_SHIFT = 6, 0.1
FAIR_ROUNDS = 3  # of this, each within half a voxel
TERRACE = 0.5  # of a voxel: how far a place moves by it
STEP = 0.05  # of the lattice's spacing, in the difference quotient of an indicator
FLAT = 1e-3  # change of an indicator along one spacing below which it has no direction
CORNERS = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class LabelSurface:
    """The surfaces between labels, whose numbers are 0 for no body and k for the k-th name of the image."""

    points: np.ndarray  # (n, 3) corners of the triangles, m
    triangles: np.ndarray  # (t, 3), counter-clockwise as seen from the side of `outside`
    inside: np.ndarray  # (t,) number of the label on the one side
    outside: np.ndarray  # (t,) number of the label on the other

    @property
    def area_vectors(self) -> np.ndarray:
        """Normal towards `outside` times area of each triangle in m², shape (t, 3)."""
        a, b, c = np.moveaxis(self.points[self.triangles], 1, 0)
        return np.cross(b - a, c - a) / 2


def label_surface(image: LabelImage, spacing: float) -> LabelSurface:
    """Return the surfaces between the labels of an image, with triangles of about `spacing` in m."""
    lattice = _Lattice(image, spacing)
    cells = lattice.cells()
    cube = np.full(np.array(cells.shape) - 1, -1)
    corner = np.stack(
        [cells[tuple(slice(c, c + n) for c, n in zip(k, cube.shape, strict=True))] for k in CORNERS], -1
    )
    mixed = np.argwhere((corner != corner[..., :1]).any(axis=-1))
    cube[tuple(mixed.T)] = np.arange(len(mixed))
    corner = corner[tuple(mixed.T)]
    quads, sides = _quads(cells, cube)
    places = _settle(lattice, mixed + 0.5, corner, quads, sides)
    triangles = _halve(places, quads)
    first, second = np.repeat(sides[:, 0], 2), np.repeat(sides[:, 1], 2)
    swap = first == 0  # the body lies inside
    triangles[swap] = triangles[swap][:, ::-1]
    inside, outside = np.where(swap, second, first), np.where(swap, first, second)
    if np.linalg.det(image.axes) < 0:
        triangles = triangles[:, ::-1]
    return LabelSurface(lattice.to_metres(places), triangles, inside, outside)


class _Lattice:
    """Smoothed indicators of the labels on a lattice along the voxels' axes."""

    def __init__(self, image: LabelImage, spacing: float) -> None:
        self.image, self.spacing = image, spacing
        used = image.labels > 0
        ends = [np.flatnonzero(used.any(axis=across))[[0, -1]] for across in ((1, 2), (0, 2), (0, 1))]
        low, last = np.transpose(ends)
        high = last + 1
        # two more points around the body, in all directions, where nothing is
        counts = np.ceil((high - low) * image.spacing / spacing).astype(int) + 6
        middle = ((low + high) / 2 - 0.5) * image.spacing  # m along the axes from the first voxel's centre
        self.first = middle - (counts - 1) / 2 * spacing
        part = image.labels[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
        weights = [
            _weights(
                self.first[d] + spacing * np.arange(counts[d]),
                (low[d] + np.arange(part.shape[d])) * image.spacing[d],
                math.hypot(SMOOTH_VOXEL * image.spacing[d], SMOOTH_LATTICE * spacing),
                image.spacing[d],
            )
            for d in range(3)
        ]
        shares = [
            np.einsum("ai,bj,ck,ijk->abc", *weights, (part == number).astype(np.float32), optimize=True)
            for number in image.names.values()
        ]
        self.shares = np.stack([1.0 - np.sum(shares, axis=0), *shares]).astype(float)
        from scipy.ndimage import spline_filter

        self.volumes = [volume / spacing**3 for volume in image.volumes.values()]
        self.splines = [spline_filter(share, order=3) for share in self.shares]

    def cells(self) -> np.ndarray:
        """Return the label with the largest share at each point, (a, b, c) int."""
        return _thicken(np.asarray(self.shares.argmax(axis=0)))

    def at(self, label: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return the share of a label (n,) at places (n, 3) in steps of the lattice."""
        from scipy.ndimage import map_coordinates

        value = np.empty(len(places))
        for number, spline in enumerate(self.splines):
            mine = label == number
            if mine.any():
                value[mine] = map_coordinates(
                    spline, places[mine].T, order=3, prefilter=False, mode="nearest"
                )
        return value

    def is_at_end(self, places: np.ndarray) -> np.ndarray:
        """Return which places (n, 3) in steps of the lattice lie within a step of the end of the image."""
        along = (self.first + self.spacing * places) / self.image.spacing + 0.5  # voxels from its corner
        near = self.spacing / self.image.spacing
        return np.asarray(((along < near) | (along > self.image.labels.shape - near)).any(axis=1))

    def to_metres(self, places: np.ndarray) -> np.ndarray:
        """Return where places (n, 3) in steps of the lattice are, in m."""
        return np.asarray(self.image.origin + (self.first + self.spacing * places) @ self.image.axes.T)


def _weights(points: np.ndarray, voxels: np.ndarray, deviation: float, voxel: float) -> np.ndarray:
    """Return the weight of each voxel at each point of a lattice, (points, voxels).

    Twice a Gaussian less a wider one: its second moment is zero, so that smoothing does not shrink what is round.
    """
    from scipy.special import ndtr

    away = points[:, None] - voxels
    parts = [
        ndtr((away + voxel / 2) / s) - ndtr((away - voxel / 2) / s)
        for s in (deviation, np.sqrt(2.0) * deviation)
    ]
    return np.asarray(2 * parts[0] - parts[1], dtype=np.float32)


def _thicken(cells: np.ndarray) -> np.ndarray:
    """Return the labels without edges at which the body touches itself: a point between is given to it."""
    cells = cells.copy()
    for _ in range(20):
        changed = False
        for a, b in ((0, 1), (0, 2), (1, 2)):
            one = np.moveaxis(cells, (a, b), (0, 1))  # a view: changes reach the labels
            p, q, r, s = one[:-1, :-1], one[1:, :-1], one[:-1, 1:], one[1:, 1:]
            first = (p > 0) & (s > 0) & (q == 0) & (r == 0)
            second = (p == 0) & (s == 0) & (q > 0) & (r > 0)
            if first.any() or second.any():
                changed = True
                q[first] = p[first]
                p[second] = q[second]
        if not changed:
            break
    return cells


def _quads(cells: np.ndarray, cube: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return corners (q, 4) of a quadrilateral between each two neighbours that differ, and their labels (q, 2).

    It is counter-clockwise as seen from the second.
    """
    quads, sides = [], []
    for d in range(3):
        ahead = [slice(None)] * 3
        behind = [slice(None)] * 3
        ahead[d], behind[d] = slice(1, None), slice(None, -1)
        one, other = cells[tuple(behind)], cells[tuple(ahead)]
        place = np.argwhere(one != other)
        at = tuple(place.T)
        u, v = np.eye(3, dtype=int)[[(d + 1) % 3, (d + 2) % 3]]
        ring = [cube[tuple((place - a * u - b * v).T)] for a, b in ((1, 1), (0, 1), (0, 0), (1, 0))]
        quads.append(np.column_stack(ring))
        sides.append(np.column_stack([one[at], other[at]]))
    return np.concatenate(quads), np.concatenate(sides)


def _settle(
    lattice: _Lattice, centres: np.ndarray, corner: np.ndarray, quads: np.ndarray, sides: np.ndarray
) -> np.ndarray:
    """Return the places of vertices: evenly spread, and where the shares of their labels are equal."""
    present = np.sort(corner, axis=1)
    fresh = np.column_stack([np.ones(len(corner), bool), present[:, 1:] != present[:, :-1]])
    count = fresh.sum(axis=1)
    mean, is_joined = _neighbour_mean(quads, count)
    places = centres.copy()
    for k in range(EVEN + EXACT):
        if 0 < k < EVEN:
            places = np.where(is_joined[:, None], (places + mean @ places) / 2, places)
        for _ in range(2):
            places = places + _newton(lattice, places, present, fresh, count)
            places = np.clip(places, centres - WITHIN, centres + WITHIN)
    voxel = float(np.prod(lattice.image.spacing)) ** (1 / 3) / lattice.spacing
    reach = np.where(lattice.is_at_end(places), 0.0, TERRACE * voxel)  # a cut is flat up to its rim

    def keep_volumes(moved: np.ndarray) -> np.ndarray:
        return _with_volumes(moved, quads, sides, lattice.volumes)

    swap = sides[:, 0] < sides[:, 1]  # all of a sheet between two labels is seen from one side
    rings = np.where(swap[:, None], quads[:, ::-1], quads)
    line = _line_bending(mean, is_joined & (count > 2))
    return keep_volumes(_without_terraces(places, rings, line, FAIR * voxel, reach, keep_volumes))


def _line_bending(mean: Any, is_seam: np.ndarray) -> Any:
    """Return the matrix of second differences along lines where three tissues meet, with no rows but theirs."""
    from scipy.sparse import diags_array, eye_array

    return diags_array(2.0 * is_seam) @ (eye_array(len(is_seam)) - mean)


def _without_terraces(
    places: np.ndarray,
    rings: np.ndarray,
    line: Any,
    length: float,
    reach: np.ndarray,
    keep_volumes: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """Return places (n, 3) on a surface without the steps of the voxels, smooth over a `length` of the lattice.

    The surface is one of even curvature that stays near the places, each within its `reach` (n,), which is half a
    voxel: a label says no more of where a surface is. A ball has even curvature, and stays as it is. Lines where three
    tissues meet are smoothed first, and hold the sheets between them.
    """
    from scipy.sparse import eye_array
    from scipy.sparse.linalg import splu

    is_seam = line.diagonal() > 0
    along = splu((eye_array(len(places)) + length**4 * line.T @ line).tocsc()).solve
    smooth = places
    for _ in range(FAIR_ROUNDS):
        moved = np.where(is_seam[:, None], along(smooth), smooth)
        moved = moved + _even_moves(moved, rings, is_seam | (reach == 0), length)
        away = keep_volumes(moved) - places
        far = np.linalg.norm(away, axis=1, keepdims=True)
        smooth = places + away * np.minimum(1.0, reach[:, None] / np.maximum(far, 1e-12))
    return smooth


def _even_moves(places: np.ndarray, rings: np.ndarray, is_held: np.ndarray, length: float) -> np.ndarray:
    """Return moves (n, 3) along normals after which the mean curvature varies least, beside the squares of the moves.

    Curvature has the cotangents of the triangles (Pinkall and Polthier 1993): a mean over neighbours would see the
    cubes of the lattice, too, and flatten what is round where it faces an axis. Its variation, not its square, is
    small: a terrace wider than a few voxels is seen beside the round surface around it.
    """
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    normals = _normals(places, rings)
    weights, share = _cotangents(places, _halve(places, rings))
    free = diags_array(1.0 * ~is_held)
    bend = free @ diags_array(1 / share) @ _laplacian(weights)
    # a surface that moves by u along its normal changes its curvature by -Δu less the squares of the principal ones
    normal_bend = bend - diags_array(np.einsum("ni,ni->n", normals, bend @ normals))
    uneven = length**6 * normal_bend.T @ _laplacian(free @ weights @ free)
    curvature = np.einsum("ni,ni->n", normals, bend @ places)
    system = diags_array(share + HELD * is_held) + uneven @ normal_bend
    return np.asarray(-splu(system.tocsc()).solve(uneven @ curvature)[:, None] * normals)


def _normals(places: np.ndarray, rings: np.ndarray) -> np.ndarray:
    """Return unit normals (n, 3) at places, from the quadrilaterals (q, 4) around them."""
    a, b, c, d = (places[k] for k in rings.T)
    area, total = np.cross(c - a, d - b) / 2, np.zeros_like(places)
    for corner in rings.T:
        np.add.at(total, corner, area)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))


def _cotangents(places: np.ndarray, triangles: np.ndarray) -> tuple[Any, np.ndarray]:
    """Return the matrix of half the cotangents opposite each edge, and the area (n,) around each place."""
    from scipy.sparse import coo_matrix

    count = len(places)
    weights: Any = 0.0
    for k in range(3):
        i, j, opposite = (triangles[:, (k + turn) % 3] for turn in range(3))
        u, v = places[i] - places[opposite], places[j] - places[opposite]
        area = np.linalg.norm(np.cross(u, v), axis=1)  # twice the triangle's
        cotangent = np.clip(np.einsum("ij,ij->i", u, v) / np.maximum(area, 1e-9), 0.0, STEEP)
        half = coo_matrix((cotangent / 2, (i, j)), shape=(count, count)).tocsr()
        weights = weights + half + half.T
    share = np.bincount(triangles.ravel(), weights=np.repeat(area / 6, 3), minlength=count)
    return weights, np.maximum(share, LEAST_SHARE)


def _laplacian(weights: Any) -> Any:
    """Return the matrix of sums of weighted differences from neighbours."""
    from scipy.sparse import diags_array

    return diags_array(np.asarray(weights.sum(axis=1)).ravel()) - weights


def _with_volumes(
    places: np.ndarray, quads: np.ndarray, sides: np.ndarray, volumes: Sequence[float]
) -> np.ndarray:
    """Return places (n, 3) moved along the surfaces' normals, so that each label has the volume of its voxels.

    The quadrilaterals (q, 4) have the labels (q, 2) on their sides; volumes are in cubes of the lattice.
    """
    count = len(volumes) + 1
    for _ in range(SHIFTS):
        a, b, c, d = (places[k] for k in quads.T)
        area = np.cross(c - a, d - b) / 2  # towards the second side
        u, v, w = np.moveaxis(places[_halve(places, quads)], 1, 0)
        flow = np.einsum("ti,ti->t", np.cross(u, v), w).reshape(-1, 2).sum(axis=1) / 6  # divergence theorem
        size = np.linalg.norm(area, axis=1)
        gained = np.bincount(sides[:, 0], flow, count) - np.bincount(sides[:, 1], flow, count)
        contact = np.zeros((count, count))
        np.add.at(contact, tuple(sides.T), size)
        contact += contact.T
        # a label grows by its areas times its shift, less those of its neighbours
        growth = (np.diag(contact.sum(axis=1)) - contact)[1:, 1:]
        shift: np.ndarray = np.append(
            0.0, np.linalg.lstsq(growth, np.asarray(volumes) - gained[1:], rcond=1e-9)[0]
        )
        move, weight = np.zeros_like(places), np.zeros(len(places))
        push = area * np.clip(shift[sides[:, 0]] - shift[sides[:, 1]], -MOST_SHIFT, MOST_SHIFT)[:, None]
        for corner in quads.T:
            np.add.at(move, corner, push)
            np.add.at(weight, corner, size)
        places = places + move / np.maximum(weight, 1e-12)[:, None]
    return places


def _neighbour_mean(quads: np.ndarray, count: np.ndarray) -> tuple[Any, np.ndarray]:
    """Return the matrix of the mean over each vertex's neighbours, and which vertices have any.

    Where three tissues meet (`count`), vertices are spread along that line alone.
    """
    from scipy.sparse import coo_matrix, diags_array

    edges = np.unique(np.sort(np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1), axis=0)
    pairs = np.concatenate([edges, edges[:, ::-1]])
    pairs = pairs[count[pairs[:, 1]] >= count[pairs[:, 0]]]
    joined = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(count),) * 2).tocsr()
    degree = np.asarray(joined.sum(axis=1)).ravel()
    return diags_array(1 / np.maximum(degree, 1)) @ joined, degree > 0


def _newton(
    lattice: _Lattice, places: np.ndarray, present: np.ndarray, fresh: np.ndarray, count: np.ndarray
) -> np.ndarray:
    """Return the step (n, 3) to where the shares of each place's labels are equal, to first order."""
    step = np.zeros_like(places)
    for number in range(2, min(int(count.max()), 4) + 1):
        rows = np.flatnonzero(count == number if number < 4 else count >= 4)
        if not len(rows):
            continue
        labels = (
            present[rows][fresh[rows]].reshape(len(rows), -1)
            if number < 4
            else np.array([row[new][:4] for row, new in zip(present[rows], fresh[rows], strict=True)])
        )
        here = places[rows]
        share = np.column_stack([lattice.at(label, here) for label in labels.T])
        slope = np.stack(
            [
                np.column_stack(
                    [
                        (lattice.at(label, here + STEP * e) - lattice.at(label, here - STEP * e)) / (2 * STEP)
                        for e in np.eye(3)
                    ]
                )
                for label in labels.T
            ],
            axis=1,
        )
        misfit, jacobian = share[:, 1:] - share[:, :1], slope[:, 1:] - slope[:, :1]
        inverse = np.linalg.pinv(jacobian, rcond=0.1)
        move = -np.einsum("nij,nj->ni", inverse, misfit)
        weak = np.linalg.norm(jacobian, axis=(1, 2)) < FLAT
        move[weak] = 0.0
        step[rows] = move
    return np.asarray(np.clip(step, -0.5, 0.5))


def _halve(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Return each quadrilateral as two triangles along its shorter diagonal, (2q, 3)."""
    a, b, c, d = quads.T
    short = np.linalg.norm(points[a] - points[c], axis=1) <= np.linalg.norm(points[b] - points[d], axis=1)
    first = np.where(short[:, None], np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    second = np.where(short[:, None], np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    return np.stack([first, second], axis=1).reshape(-1, 3)
