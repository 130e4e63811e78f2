"""Signed distance to a curved surface, measured point by point: what a smooth field is made of.

**On a smooth piece** the contact point on the nearest small triangle is lifted to the curved surface, by the height of
the paraboloid with the corners' normals, ½ Σ λ_i λ_j (n_j − n_i)·(x_j − x_i) over the edges; d is the distance along
the normal there.

**Beyond a crease or the border**, d is the distance to that line.

**With a shoulder** of radius ρ the surface is thought to roll off beyond its border. At height z over the tangent plane
and a beyond the border

    d = √(b² + (z + ρ)²) − ρ,   b = √(a² + (ρ/2)²) − ρ/2,   for z ≥ −ρ,
    d = b − ρ + (z + ρ) (1 − σ(b/R))                        below,

σ the quintic smooth step and R the probe's radius, so that d and three derivatives are those of the plane right up to
the border: a probe that leaves the surface sideways feels it for some ρ longer, and from there on nothing, however low
it goes.

**Below the border**, without a shoulder. At height z = −ζ under the surface's tangent plane and a beyond its border,
r² = a² + ζ², the nearest thing is still the border, r away: that is the distance of a probe that passes beside the
body. Under the surface d is −ζ. The jump between them is bridged by

    d = −ζ + G (r + ζ),   G = a²/r² + (ζ²/r²) w(r)   beyond the border,   G = w(ζ) (1 − σ(e/R))   e within it,

σ the quintic smooth step, R the probe's radius, w a smooth step from 0 at r = R/2 to 1 at 0.85 R: farther out d is r,
so that a probe feels nothing before it meets the border; nearer, the depth falls steadily from the full one to that
of the border. Deeper than R/2, within R of its border, the inner side is not one any more.

**Behind.** A surface does not tell how thick its body is. Inside, from a distance r = `behind` to its nearest point
on, d turns back, and 2R later nothing is felt: a probe that comes from below meets no force in the air, and one that
was pushed through the body is let go. There d is

    d (1 − τ) + (behind + 2R) τ,   τ = σ((r − behind)/2R)

Over a plane all of this depends on two numbers only, the distance a from its outline and the height z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.kernels import kernel, part
from palpate.surrogates.surface.curved_patches import SHARP, SMOOTH, Patches, patches_of
from palpate.surrogates.surface.nearest_triangle import DEEP, disc_tree, nearest_into
from palpate.surrogates.surface.oriented_mesh import OrientedMesh

__all__ = ["BEHIND", "BRIDGED", "PLAIN", "ROLLED", "ROUNDED", "MeasuredDistance"]

# the contact point lies on a smooth piece, on a line, or on a border with a shoulder; below the border; behind the body
PLAIN, ROUNDED, ROLLED, BRIDGED, BEHIND = 0, 1, 2, 3, 4
TURN = 2.0  # distance over the radius, in which d turns back behind the surface
START, FINISH = 0.5, 0.85  # distances over the radius, where the bridge below the border begins and ends
# cosine between distance and normal, below which small triangles are too coarse for the normal
RESOLVED = 0.98


@dataclass(frozen=True, eq=False)
class MeasuredDistance:
    """The distance to a surface, measured on its patches."""

    patches: Patches  # small triangles in the order of `discs`
    discs: np.ndarray  # (n, 8), tree of the patches
    radius: float  # R of the smallest probe, m
    shoulder: float = 0.0  # ρ at the border, m; 0 for none
    behind: float = np.inf  # distance inside from which d turns back, m; infinite where it falls on

    @classmethod
    def of(
        cls, mesh: OrientedMesh, radius: float, shoulder: float = 0.0, behind: float = np.inf
    ) -> MeasuredDistance:
        """The curved surface behind a mesh, for probes from a radius in m on."""
        p = patches_of(mesh)
        order, discs = disc_tree(p.corners)
        corners = np.ascontiguousarray(p.corners[order])
        patches = Patches(corners, p.normals[order], p.places[order], p.kinds, p.outward, p.border)
        return cls(patches, discs, radius, shoulder, behind)

    def at(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Signed distances in m and their kinds (PLAIN to BEHIND) at places (N, 3), each of shape (N,).

        Fast where each place is near the one before.
        """
        places = np.ascontiguousarray(places, dtype=np.float64)
        distances, kinds = np.empty(len(places)), np.empty(len(places), dtype=np.int8)
        p = self.patches
        _measure_into(
            places, distances, kinds, self.discs, p.corners, p.normals, p.places, p.kinds, p.outward,
            p.border, self.radius, self.shoulder, self.behind,
        )  # fmt: skip
        return distances, kinds

    @cached_property
    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,) in m of a box around the surface."""
        corners = self.patches.corners
        return corners.min(axis=(0, 1)), corners.max(axis=(0, 1))

    @cached_property
    def extent_behind(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,) in m of a box around the places behind it where nothing is felt any more."""
        places = self.patches.corners - (self.behind + TURN * self.radius) * self.patches.normals
        return places.min(axis=(0, 1)), places.max(axis=(0, 1))

    def outline(self, places: np.ndarray) -> np.ndarray:
        """Return distances (N,) in m from a flat surface's outline at places (N, 3) of its plane, negative within."""
        inside, p = np.empty(len(places), dtype=np.bool_), self.patches
        distances = np.empty(len(places))
        _outline_into(places, distances, inside, self.discs, p.corners, p.places, p.kinds, p.border)
        return np.where(inside, -distances, distances)

    def profile(self, a: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return distances in m and their kinds over a flat surface, a from its outline and z above it, all (N,)."""
        distances, kinds = np.empty(len(a)), np.empty(len(a), dtype=np.int8)
        _profile_into(a, z, distances, kinds, self.radius, self.shoulder, self.behind)
        return distances, kinds


@part
def _step(t: float) -> float:
    """σ: from 0 at 0 to 1 at 1, with two vanishing derivatives at both."""
    t = min(max(t, 0.0), 1.0)
    return t * t * t * (10.0 + t * (6.0 * t - 15.0))


@part
def _bridge(r: float) -> float:
    """w, of a distance in radii."""
    return _step((r - START) / (FINISH - START))  # type: ignore[no-any-return]


@part
def _lifted_into(corners: np.ndarray, normals: np.ndarray, weights: np.ndarray, v: np.ndarray) -> float:
    """Put the normal at the contact point into v (3,); the height of the curved surface above it."""
    height = 0.0
    for i in range(3):
        j = (i + 1) % 3
        turn = 0.0
        for x in range(3):
            turn += (normals[j, x] - normals[i, x]) * (corners[j, x] - corners[i, x])
        height += 0.5 * weights[i] * weights[j] * turn
    length = 0.0
    for x in range(3):
        v[x] = weights[0] * normals[0, x] + weights[1] * normals[1, x] + weights[2] * normals[2, x]
        length += v[x] * v[x]
    length = np.sqrt(length)
    for x in range(3):
        v[x] /= length
    return height


@part
def _to_border(c: np.ndarray, border: np.ndarray) -> float:
    """Square of the distance of a point to straight parts of the border."""
    best = np.inf
    for b in range(border.shape[0]):
        along = square = 0.0
        for x in range(3):
            u = border[b, 1, x] - border[b, 0, x]
            along += u * (c[x] - border[b, 0, x])
            square += u * u
        t = min(max(along / square, 0.0), 1.0)
        d = 0.0
        for x in range(3):
            e = c[x] - border[b, 0, x] - t * (border[b, 1, x] - border[b, 0, x])
            d += e * e
        best = min(best, d)
    return best


@part
def _beyond(height: float, r: float, radius: float) -> tuple[float, int]:
    """Distance where the nearest point is on the border, at a height over its tangent plane."""
    if height >= 0 or r == 0.0:
        return r, ROUNDED
    below = (height / r) ** 2
    G = 1.0 - below + below * _bridge(r / radius)
    return height + G * (r - height), BRIDGED if G < 1 else ROUNDED


@part
def _rolled(height: float, r: float, shoulder: float, radius: float) -> tuple[float, int]:
    """Distance to the shoulder where the nearest point is on the border."""
    start = shoulder / 2.0
    b = np.sqrt(max(r * r - height * height, 0.0) + start * start) - start
    if height < -shoulder:
        return b - shoulder + (height + shoulder) * (1.0 - _step(b / radius)), BRIDGED
    return np.sqrt(b * b + (height + shoulder) ** 2) - shoulder, ROLLED


@part
def _within(d: float, square: float, radius: float) -> tuple[float, int]:
    """Distance where the nearest point is inside the surface, d away; the border is √square away from that point."""
    if d > -START * radius or square >= radius * radius:
        return d, PLAIN
    G = _bridge(-d / radius) * (1.0 - _step(np.sqrt(max(square, 0.0)) / radius))
    return d - 2.0 * d * G, BRIDGED


@part
def _over(
    c: np.ndarray, weights: np.ndarray, corners: np.ndarray, outward: np.ndarray, height: float
) -> float:
    """Height of c over the tangent plane of the line of its contact point; `height` where that has no direction."""
    facing = outward[0] ** 2 + outward[1] ** 2 + outward[2] ** 2
    if facing == 0.0:
        return height
    product = 0.0
    for x in range(3):
        at = weights[0] * corners[0, x] + weights[1] * corners[1, x] + weights[2] * corners[2, x]
        product += (c[x] - at) * outward[x]
    return float(product / np.sqrt(facing))


@part
def _turned(d: float, r: float, behind: float, end: float) -> float:
    """Distance where the nearest point is farther away than `behind`, on the inner side."""
    return d + (end - d) * _step((r - behind) / (end - behind))  # type: ignore[no-any-return]


@kernel(allocates=True)
def _measure_into(
    places: np.ndarray,
    distances: np.ndarray,
    kinds: np.ndarray,
    discs: np.ndarray,
    corners: np.ndarray,
    normals: np.ndarray,
    rows: np.ndarray,
    feature_kinds: np.ndarray,
    outward: np.ndarray,
    border: np.ndarray,
    radius: float,
    shoulder: float,
    behind: float,
) -> None:
    """Fill distances (N,) and kinds (N,) at places (N, 3)."""
    end = behind + TURN * radius
    waiting, weights, trial, n = np.empty(DEEP, np.int64), np.empty(3), np.empty(3), np.empty(3)
    t = 0
    for k in range(places.shape[0]):
        c = places[k]
        _, t, where = nearest_into(c[0], c[1], c[2], t, discs, corners, waiting, weights, trial)
        row = rows[t, where]
        lift = _lifted_into(corners[t], normals[t], weights, n)
        if feature_kinds[row] != SMOOTH:
            lift = 0.0
        height, r = 0.0, 0.0
        for x in range(3):
            at = weights[0] * corners[t, 0, x] + weights[1] * corners[t, 1, x] + weights[2] * corners[t, 2, x]
            v = c[x] - at - lift * n[x]
            height += v * n[x]
            r += v * v
        r = np.sqrt(r)
        kind = feature_kinds[row]
        if kind == SMOOTH:
            if abs(height) < RESOLVED * r:
                height = np.copysign(RESOLVED * r, height)
        else:
            height = _over(c, weights, corners[t], outward[row], height)
        if kind == SHARP:
            distances[k], kinds[k] = np.copysign(r, height), ROUNDED
        else:
            square = np.inf
            if kind == SMOOTH and shoulder == 0.0 and height <= -START * radius:
                square = _to_border(c, border) - height * height
            distances[k], kinds[k] = _about_border(kind == SMOOTH, height, r, square, radius, shoulder)
        if height < 0.0 and r > behind:
            distances[k], kinds[k] = _turned(distances[k], r, behind, end), BEHIND


@part
def _about_border(
    inside: bool, height: float, r: float, square: float, radius: float, shoulder: float
) -> tuple[float, int]:
    """Distance where the nearest point, r away, is inside the surface or on its border; `square` as in `_within`."""
    if inside:
        return _within(height, square, radius) if shoulder == 0.0 else (height, PLAIN)
    if shoulder > 0.0:
        return _rolled(height, r, shoulder, radius)  # type: ignore[no-any-return]
    return _beyond(height, r, radius)  # type: ignore[no-any-return]


@kernel(allocates=True)
def _outline_into(
    places: np.ndarray,
    distances: np.ndarray,
    inside: np.ndarray,
    discs: np.ndarray,
    corners: np.ndarray,
    rows: np.ndarray,
    feature_kinds: np.ndarray,
    border: np.ndarray,
) -> None:
    waiting, weights, trial = np.empty(DEEP, np.int64), np.empty(3), np.empty(3)
    t = 0
    for k in range(places.shape[0]):
        c = places[k]
        _, t, where = nearest_into(c[0], c[1], c[2], t, discs, corners, waiting, weights, trial)
        inside[k] = feature_kinds[rows[t, where]] == SMOOTH
        distances[k] = np.sqrt(_to_border(c, border))


@kernel(allocates=True)
def _profile_into(
    a: np.ndarray,
    z: np.ndarray,
    distances: np.ndarray,
    kinds: np.ndarray,
    radius: float,
    shoulder: float,
    behind: float,
) -> None:
    end = behind + TURN * radius
    for k in range(a.size):
        r = np.hypot(max(a[k], 0.0), z[k])
        distance_and_kind = _about_border(a[k] <= 0.0, z[k], r, a[k] * a[k], radius, shoulder)
        distances[k], kinds[k] = distance_and_kind
        if z[k] < 0.0 and r > behind:
            distances[k], kinds[k] = _turned(distances[k], r, behind, end), BEHIND
