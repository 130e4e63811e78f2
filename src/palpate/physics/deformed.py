"""A solved body as it is shown: its deformed nodes and cells, the fields that colour it, its probe, lines and sections.

Pictures, files for ParaView and the page of solved bodies take what they show from here. A solution is anything with a
`mesh` and a `displacement`; all else is used where it is there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError

__all__ = [
    "COLOURS",
    "Ball",
    "FineBody",
    "NodalField",
    "ball_of",
    "circles",
    "colour_limits",
    "corner_normals",
    "cut_lines",
    "fine_body",
    "fixed_of",
    "hatching",
    "heights_above",
    "nodal_field",
    "nodal_strain",
    "outline",
    "require_state",
    "rim",
    "section",
]

Ball = tuple[np.ndarray, float]
"""A sphere: centre (3,) and radius, m."""

CREASE = math.cos(math.radians(40.0))  # edges sharper than this stay edges
COLOURS = ("displacement", "von_mises", "largest_strain")
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])  # of a tetrahedron
SIDES = np.array([[0, 1], [1, 2], [2, 0]])  # of a triangle
# for each corner of a tetrahedron the three others
OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])  # of a triangle; 3, 4, 5 halve `SIDES`
# of a tetrahedron; 4 … 9 halve `EDGES`, and the octahedron in the middle is split along 5-8
EIGHTHS = np.array(
    [
        *([0, 4, 5, 6], [4, 1, 7, 8], [5, 7, 2, 9], [6, 8, 9, 3]),
        *([5, 8, 4, 7], [5, 8, 7, 9], [5, 8, 9, 6], [5, 8, 6, 4]),
    ]
)


def require_state(solution: Any) -> None:
    """Refuse a solution without a deformed state, with its own reason."""
    if not np.all(np.isfinite(solution.displacement)):
        raise UsageError(
            "This solution has no deformed state.",
            why=str(getattr(solution, "message", "")) or "Its displacements are not finite numbers.",
            fix="Look at `message`, and press less far.",
        )


def ball_of(solution: Any, probe: Any) -> Ball | None:
    """Return the sphere to draw, None for none.

    `probe` is True for the solution's own probe, if it has one, a probe to stand at the solution's centre, or a sphere
    ((x, y, z), radius) in m.
    """
    if probe is False or probe is None:
        return None
    own: Any = getattr(solution, "probe", None) if probe is True else probe
    try:
        if isinstance(own, tuple | list):
            centre, radius = own
            return np.asarray(centre, dtype=float).reshape(3), float(radius)
        radius = getattr(own, "radius", None) if probe is True else own.radius
    except (AttributeError, TypeError, ValueError) as error:
        raise UsageError(
            f"{probe!r} is no probe to draw.",
            fix="Give True, False, a SphereProbe or ((x, y, z), radius) in m.",
        ) from error
    centre = getattr(solution, "centre", None)
    if radius is None or centre is None or np.shape(centre) != (3,):
        return None
    return np.asarray(centre, dtype=float), float(radius)


def fixed_of(solution: Any) -> tuple[str, ...]:
    """Names of the fixed surfaces, as far as the solution knows them."""
    fixed = getattr(solution, "fixed", ())
    names = (fixed,) if isinstance(fixed, str) else tuple(fixed)
    return tuple(name for name in names if name in solution.mesh.surfaces)


@dataclass(frozen=True, eq=False)
class FineBody:
    """Nodes and cells to draw; the first nodes are the mesh's own.

    An element of second order bends between its vertices, and drawn by these alone a dent a few elements wide looks
    faceted. So elements are drawn in eight and triangles in four, where the mid-side nodes are known.
    """

    points: np.ndarray  # (node, 3) positions at rest, m
    displacement: np.ndarray  # (node, 3) in m
    triangles: np.ndarray  # (t, 3) nodes of the outer surface
    surface_of: np.ndarray  # (t,) index into `surfaces` for each triangle
    tetrahedra: np.ndarray  # (e, 4) nodes of the elements' parts
    wires: np.ndarray  # (s, 2) nodes of the edges of the mesh's own triangles, in pieces
    edges: np.ndarray  # (m, 2) vertices that the further nodes lie between
    surfaces: tuple[str, ...]

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Values (node,) at all nodes, from those at the mesh's own."""
        return np.concatenate([values, values[self.edges].mean(axis=1)])


def fine_body(solution: Any) -> FineBody:
    """Return the nodes and cells to draw of a solution."""
    mesh = solution.mesh
    displacement = np.asarray(solution.displacement, dtype=float)
    between = getattr(solution, "mid_sides", None)
    sides = mesh.triangles[:, SIDES].reshape(-1, 2)
    if between is None:
        wires, none = np.unique(np.sort(sides, axis=1), axis=0), np.empty((0, 2), dtype=np.int64)
        cells = (mesh.triangles, mesh.surface_of, mesh.tetrahedra)
        return FineBody(mesh.points, displacement, *cells, wires, none, mesh.surfaces)
    first = len(mesh.points)
    triangle_middles = first + _middles(between.edges, mesh.triangles[:, SIDES])
    tetrahedron_middles = first + _middles(between.edges, mesh.tetrahedra[:, EDGES])
    six = np.concatenate([mesh.triangles, triangle_middles], axis=1)
    ten = np.concatenate([mesh.tetrahedra, tetrahedron_middles], axis=1)
    middle = triangle_middles.ravel()
    halves = np.concatenate([np.stack([sides[:, end], middle], axis=1) for end in (0, 1)])
    return FineBody(
        np.concatenate([mesh.points, between.points]),
        np.concatenate([displacement, between.displacement]),
        six[:, QUARTERS].reshape(-1, 3),
        np.repeat(mesh.surface_of, 4),
        ten[:, EIGHTHS].reshape(-1, 4),
        np.unique(halves, axis=0),
        between.edges,
        mesh.surfaces,
    )


def _middles(edges: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Index of the edge, among (m, 2) in ascending order, with the given ends (..., 2)."""
    span = int(edges.max()) + 1
    pairs = np.sort(ends, axis=-1)
    keys = edges[:, 0] * span + edges[:, 1]
    return np.asarray(np.searchsorted(keys, pairs[..., 0] * span + pairs[..., 1]))


@dataclass(frozen=True, eq=False)
class NodalField:
    """A scalar at the nodes of the mesh."""

    title: str  # words above the colour bar
    values: np.ndarray | None  # (node,) in `unit`; None for the displacement's length, which finer nodes know
    unit: str  # SI; empty for a pure number, which is shown in per cent

    def over(self, body: FineBody) -> np.ndarray:
        """Values at all nodes of the body as it is drawn."""
        if self.values is None:
            return np.asarray(np.linalg.norm(body.displacement, axis=1))
        return body.spread(self.values)


def nodal_field(solution: Any, name: str) -> NodalField:
    """Return a field of a solution by its name, one of `COLOURS`."""
    checks.one_of("The colour of a picture", name, COLOURS)
    if name == "displacement":
        return NodalField("displacement", None, "m")
    if name == "largest_strain":
        return NodalField("largest strain\n|λ − 1|", nodal_strain(solution), "")
    stress = getattr(solution, "von_mises", None)
    if stress is None:
        raise UsageError(
            "This solution has no stresses at its nodes.",
            why="They cost time, so a solver computes them only when asked.",
            fix="Solve with fields=True, or colour by 'displacement' or 'largest_strain'.",
        )
    return NodalField("von Mises stress", np.asarray(stress, dtype=float), "Pa")


def colour_limits(values: np.ndarray) -> tuple[float, float]:
    """Ends of the colour scale: from zero, where the values allow; smoothed stresses dip a little below."""
    low, high = float(values.min()), float(values.max())
    return (low if low < -0.05 * abs(high) else 0.0), high or 1.0


def nodal_strain(solution: Any) -> np.ndarray:
    """Largest |λ − 1| of the principal stretches λ at each node, shape (node,).

    The deformation gradient is taken at the corners of each element, of second order where the solution has mid-side
    nodes; a node takes the mean of the elements around it, weighted by volume. `SolidSolution.largest_strain` is the
    same at a quadrature point, so the two maxima differ by some percent.
    """
    mesh, between = solution.mesh, getattr(solution, "mid_sides", None)
    points, displacement = mesh.points, np.asarray(solution.displacement, dtype=float)
    before, after = points[mesh.tetrahedra], (points + displacement)[mesh.tetrahedra]
    middles_before, middles_after = ((p[:, :, None] + p[:, None]) / 2 for p in (before, after))
    if between is not None:
        i, j = EDGES.T
        middle = _middles(between.edges, mesh.tetrahedra[:, EDGES])
        for ends, places in (
            (middles_before, between.points),
            (middles_after, between.points + between.displacement),
        ):
            ends[:, i, j] = ends[:, j, i] = places[middle]
    gradients = _tangents(after, middles_after) @ np.linalg.inv(_tangents(before, middles_before))
    strain = np.abs(np.linalg.svd(gradients, compute_uv=False) - 1).max(axis=2)
    volume = np.repeat(np.abs(np.linalg.det(before[:, 1:] - before[:, :1])), 4)
    corners, count = mesh.tetrahedra.ravel(), len(points)
    sums = np.bincount(corners, strain.ravel() * volume, minlength=count)
    weights = np.bincount(corners, volume, minlength=count)
    return np.asarray(sums / np.where(weights > 0, weights, 1.0))


def _tangents(corners: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Derivatives (e, 4, 3, 3) at the corners of elements of second order, along their three edges as columns.

    `corners` are (e, 4, 3), `middles` (e, 4, 4, 3) lie between each two of them.
    """
    along = 4 * middles - corners[:, None] - 3 * corners[:, :, None]
    return np.moveaxis(along[:, np.arange(4)[:, None], OTHERS], 2, 3)


def corner_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals at the corners of a surface's triangles, shape (t, 3, 3), smooth except across creases."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    vectors = np.cross(b - a, c - a)
    size = np.linalg.norm(vectors, axis=1)
    # pairs of a corner and each triangle at its node
    flat = triangles.ravel()
    order, count = np.argsort(flat, kind="stable"), np.bincount(flat, minlength=len(points))
    corner = np.repeat(np.arange(len(flat)), count[flat])
    place = np.arange(len(corner)) - np.repeat(np.cumsum(count[flat]) - count[flat], count[flat])
    other = order[np.repeat((np.cumsum(count) - count)[flat], count[flat]) + place] // 3
    cosine = np.einsum("pi,pi->p", vectors[corner // 3], vectors[other])
    level = cosine >= CREASE * size[corner // 3] * size[other]
    normals = np.stack(
        [np.bincount(corner[level], vectors[other[level], i], len(flat)) for i in range(3)], axis=1
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray((normals / np.where(length > 0, length, 1.0)).reshape(-1, 3, 3))


def heights_above(points: np.ndarray, cut: Any) -> np.ndarray:
    """Height of each point at rest above a cutting plane in m, shape (node,); -1 where there is no plane.

    `cut` is "x", "y" or "z" for a plane through the body's middle, or (point, normal).
    """
    if cut is None:
        return np.full(len(points), -1.0)
    if isinstance(cut, str):
        if cut not in {"x", "y", "z"}:
            raise UsageError(f"There is no plane {cut!r}.", fix="Choose 'x', 'y', 'z' or (point, normal).")
        # what stands between the usual camera and the plane goes
        normal = np.eye(3)["xyz".index(cut)] * (-1.0 if cut == "y" else 1.0)
        point = (points.min(axis=0) + points.max(axis=0)) / 2
    else:
        point, normal = (np.asarray(v, dtype=float).reshape(3) for v in cut)
    if not np.linalg.norm(normal) > 0.0:
        raise UsageError("The cutting plane's normal is zero.", fix="Give (point, normal) with a direction.")
    return np.asarray((points - point) @ normal / np.linalg.norm(normal))


def section(simplices: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Return what a plane cuts out of simplices: triangles of tetrahedra, segments of triangles, (m, d - 1, k).

    The attributes of the corners (n, d, k) of tetrahedra (d = 4) or triangles (d = 3) are interpolated; `heights` (n,
    d) are those of the corners above the plane.
    """
    d = simplices.shape[1]

    def crossings(chosen: np.ndarray, order: np.ndarray, *pairs: tuple[int, int]) -> np.ndarray:
        """Attributes where the edges between pairs of corners, after ordering, meet the plane."""
        corners = np.take_along_axis(simplices[chosen], order[:, :, None], axis=1)
        h = np.take_along_axis(heights[chosen], order, axis=1)
        first, second = np.array(pairs).T
        share = (h[:, first] / (h[:, first] - h[:, second]))[..., None]
        return np.asarray(corners[:, first] + share * (corners[:, second] - corners[:, first]))

    above = heights > 0
    parts = []
    for count in (1, d - 1):  # one corner is on another side than all others
        chosen = above.sum(axis=1) == count
        order = np.argsort(above[chosen] != (count == 1), axis=1, kind="stable")
        parts.append(crossings(chosen, order, *((0, i) for i in range(1, d))))
    if d == 4:
        chosen = above.sum(axis=1) == 2
        ring = crossings(
            chosen, np.argsort(~above[chosen], axis=1, kind="stable"), (0, 2), (0, 3), (1, 3), (1, 2)
        )
        parts += [ring[:, [0, 1, 2]], ring[:, [0, 2, 3]]]
    return np.concatenate(parts)


def cut_lines(points: np.ndarray, heights: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Segments (s, 2, 3) between pairs of points, without what lies above a plane.

    `points` (node, 3) are in m, `heights` (node,) above the plane; `ends` (n, 2) are the points that segments join.
    """
    h = heights[ends]
    ends, h = ends[(h <= 0).any(axis=1)], h[(h <= 0).any(axis=1)]
    segments = points[ends]
    for high, low in ((0, 1), (1, 0)):
        crossing = h[:, high] > 0
        share = h[crossing, high] / (h[crossing, high] - h[crossing, low])
        start, end = points[ends[crossing, high]], points[ends[crossing, low]]
        segments[crossing, high] = start + share[:, None] * (end - start)
    return np.asarray(segments)


def _edges(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (s, 2) that two triangles share, and those two triangles (s, 2); free edges name one twice."""
    ends = np.sort(triangles[:, SIDES].reshape(-1, 2), axis=1)
    edges, first, inverse = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    last = np.zeros(len(edges), dtype=np.int64)
    np.maximum.at(last, inverse.ravel(), np.arange(len(ends)))
    return edges, np.stack([first, last], axis=1) // 3


def outline(points: np.ndarray, triangles: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Edges (s, 2) that draw a surface: creases, and the silhouette seen from direction `towards` (3,)."""
    edges, sides = _edges(triangles)
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    left, right = normals[sides[:, 0]], normals[sides[:, 1]]
    crease = np.einsum("si,si->s", left, right) < CREASE
    rim = (left @ towards > 0) != (right @ towards > 0)
    return np.asarray(edges[crease | rim | (sides[:, 0] == sides[:, 1])])


def rim(body: FineBody, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Edges (s, 2) around the surfaces of these names, and the mean direction (3,) in which they face at rest."""
    chosen = np.isin(body.surface_of, [body.surfaces.index(name) for name in names])
    edges, sides = _edges(body.triangles)
    a, b, c = np.moveaxis(body.points[body.triangles[chosen]], 1, 0)
    outward = np.cross(b - a, c - a).sum(axis=0)
    around = edges[chosen[sides[:, 0]] != chosen[sides[:, 1]]]
    return around, outward / max(float(np.linalg.norm(outward)), 1e-300)


def circles(centre: np.ndarray, radius: float, towards: np.ndarray) -> np.ndarray:
    """Segments (s, 2, 3) that draw a sphere seen from direction `towards` (3,): its outline and its equator."""
    angle = np.linspace(0, 2 * np.pi, 73)[:, None]
    rings = []
    for pole in (towards, np.array([0.0, 0.0, 1.0])):
        first = np.cross(pole, np.eye(3)[np.argmin(np.abs(pole))])
        first /= np.linalg.norm(first)
        ring = centre + radius * (np.cos(angle) * first + np.sin(angle) * np.cross(pole, first))
        rings.append(np.stack([ring[:-1], ring[1:]], axis=1))
    return np.concatenate(rings)


def hatching(segments: np.ndarray, spacing: float, offset: np.ndarray) -> np.ndarray:
    """Short strokes (n, 2, 3) by `offset` off segments (s, 2, 3), about `spacing` m apart along each."""
    strokes = [np.empty((0, 2, 3))]
    for start, end in segments:
        count = max(round(float(np.linalg.norm(end - start)) / spacing), 1)
        along = start + (end - start) * ((np.arange(count) + 0.5) / count)[:, None]
        strokes.append(np.stack([along, along + offset], axis=1))
    return np.concatenate(strokes)
