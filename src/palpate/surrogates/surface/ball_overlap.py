"""The overlap of a ball with a touched surface: all that it meets of it, and the depth on a plane that is worth it.

The closest point says how deep a ball is on a smooth surface. Over a groove, or between bumps, it meets more surface
than that, or less. An elastic foundation (Johnson 1985, section 4.3; as hydroelastic contact uses it, Elandt et al.
2019) sums the overlap over all of the surface inside the ball,

    V(c) = ∫ p^{3/2} w dA,   p = R − |x − c|

p is how deep the point x of the surface is in the tool, −(signed distance of x to the posed tool): another tool has
another p and the same integral. w is 1 where the surface faces the tool, and falls to 0 where it turns away, so that
the far side of a thin wall does not count.

V is a scalar potential of c. On a plane it grows as s^{5/2} with the depth s, as Hertz's energy does; V vanishes with
four fifths of a vanishing root at first contact, where no spline could follow it. So what is kept is the depth on a
plane that has the same V, the **equivalent depth** s_V = V_plane⁻¹(V(c)). It begins at the same place as s = R − d,
grows linearly there, and is s over every plane. With k = s_V/s,

    s_m = s k^m,   e = R − s_m

m = 1 is the whole overlap, m = 0 the closest point. Between them, m = ½ is Hertz's own rule on smooth curved
surfaces: there V ∝ R' s^{5/2} and U ∝ √R' s^{5/2}, R' the effective radius. e is a field like the distance d, on the
same lattice with the same kind of spline, and stands where d stands in a contact law.

k is measured between a depth `LEAST` and a depth `MOST`; outside these it is that of the place on the normal at the
nearer of the two.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from palpate.kernels import kernel, part
from palpate.network.packing import pack, unpack
from palpate.surrogates.surface.curved_patches import Patches, patches_of
from palpate.surrogates.surface.distance_table import CLEAR, through_nodes
from palpate.surrogates.surface.oriented_mesh import OrientedMesh
from palpate.surrogates.surface.touched_surface import TouchedSurface

__all__ = ["Overlap", "plane_overlaps"]

LEAST, MOST = 0.04, 0.7  # depths over the radius, between which k is measured
# cosines between the surface's normal and the way to the ball's centre, where w is 0 and 1
TURNED, FACING = 0.0, 0.3
NARROWEST, WIDEST = 0.4, 3.0  # bounds of k: beyond them a place is not like a press on a plane any more
FINE = 20  # parts of the radius, of which one is the longest edge of a piece of the surface
MOST_PIECES = 3_000_000  # pieces of the surface, at most: 170 MB
DEEPEST = -0.5  # distance over the radius, inside from which k is 1
# e − d is rounded to 2⁻¹² to 2⁻¹¹ of the spacing: finer digits are those of the sum over pieces
GRAIN = 12
QUANTUM = 2.0**-12  # of ln k, in files


@dataclass(frozen=True, eq=False)
class Overlap:
    """The ratio k of equivalent depth and depth of a ball, on the lattice of a touched surface.

    Attributes
    ----------
    surface : TouchedSurface
        Curved, with the distance d.
    log_ratio : (i, j, k) array
        ln k at the lattice's nodes, zero where nothing is felt.
    """

    surface: TouchedSurface
    log_ratio: np.ndarray

    @classmethod
    def of(cls, surface: TouchedSurface, points: np.ndarray, triangles: np.ndarray) -> Overlap | None:
        """Return the overlap of the ball of radius `surface.radius`; None over a flat surface, where k is 1.

        Parameters
        ----------
        surface : TouchedSurface
            Made of the same triangles.
        points : (P, 3) array
            In m.
        triangles : (t, 3) int array
            Counter-clockwise as seen from outside.
        """
        if surface.profile.size:
            return None
        d = _node_values(surface.coefficients)
        R, outermost = surface.radius, surface.reach + CLEAR * surface.spacing
        near = np.argwhere((d > DEEPEST * R) & (d < outermost))
        places = surface.frame[:3] + surface.spacing * near
        ratio = _ratios(surface, places, _Pieces.of(patches_of(OrientedMesh.of(points, triangles)), R))
        # k goes over into 1 where nothing is felt any more, outside and deep inside
        here = d[tuple(near.T)]
        share = _smooth_step((outermost - here) / (CLEAR * surface.spacing)) * _smooth_step(
            (here / R - DEEPEST) / -DEEPEST
        )
        log_ratio = np.zeros(d.shape)
        log_ratio[tuple(near.T)] = QUANTUM * np.rint(share * np.log(ratio) / QUANTUM)
        return cls(surface, log_ratio)

    def change(self, weight: float) -> np.ndarray:
        """Return what the coefficients of the field e = R − s kᵐ are more than those of d, in m, for a weight m.

        e stands in a contact law where the distance stands.
        """
        surface = self.surface
        s = surface.radius - _node_values(surface.coefficients)
        grain = 2.0 ** (math.frexp(surface.spacing)[1] - GRAIN)
        change = through_nodes(s - s * np.exp(weight * self.log_ratio), surface.spacing)
        return np.asarray(grain * np.rint(change / grain) + 0.0)

    def field(self, weight: float) -> TouchedSurface:
        """Return the field e for a weight m."""
        return replace(self.surface, coefficients=self.surface.coefficients + self.change(weight))

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything but the surface as arrays, for a file."""
        return {"log_ratio": pack(self.log_ratio)}

    @classmethod
    def from_arrays(cls, surface: TouchedSurface, arrays: Mapping[str, np.ndarray]) -> Overlap:
        """Return the overlap of a surface whose `arrays` these are."""
        return cls(surface, unpack(arrays["log_ratio"], surface.coefficients.shape))


def plane_overlaps(depths: np.ndarray) -> np.ndarray:
    """Return V/R^{7/2} of a ball over a plane at depths s/R between 0 and 1, of any shape.

    With r dr = ρ dρ on the plane, V = 2π ∫ (R − r)^{3/2} w((R − s)/r) r dr from R − s to R.
    """
    nodes, weights = np.polynomial.legendre.leggauss(64)
    t, weights = (nodes + 1) / 2, weights / 2
    s = np.asarray(depths, dtype=np.float64)[..., None]
    # r = 1 − s t²: the square root of the integrand's end is gone
    r = 1 - s * t * t
    facing = _smooth_step(((1 - s) / r - TURNED) / (FACING - TURNED))
    return np.asarray(2 * np.pi * ((s * t * t) ** 1.5 * facing * r * 2 * s * t) @ weights)


def _equivalent_depths(overlaps: np.ndarray, radius: float) -> np.ndarray:
    """Return the depths (N,) in m on a plane that have overlaps V (N,); zero where V is."""
    # beyond the table s grows as V^{2/5}, as it does at its beginning
    depths = np.geomspace(1e-3 * LEAST, MOST, 400)
    table = np.log(plane_overlaps(depths))
    with np.errstate(divide="ignore"):
        asked = np.log(overlaps / radius**3.5)
    outside = np.where(asked > table[-1], asked - table[-1], np.minimum(asked - table[0], 0.0))
    return np.asarray(radius * np.exp(np.interp(asked, table, np.log(depths)) + 0.4 * outside))


def _ratios(surface: TouchedSurface, places: np.ndarray, pieces: _Pieces) -> np.ndarray:
    """Return k (N,) for a ball at places (N, 3), each moved along the normal to where k is measured."""
    R = surface.radius
    d, normals, _ = surface.at(places)
    s = R - d
    moved = places + (s - np.clip(s, LEAST * R, MOST * R))[:, None] * normals
    s = R - surface.at(moved)[0]
    overlaps = np.empty(len(moved))
    _overlaps_into(
        np.ascontiguousarray(moved), overlaps, pieces.points, pieces.normals, pieces.areas, pieces.first,
        pieces.origin, pieces.sides, R,
    )  # fmt: skip
    equivalent = _equivalent_depths(overlaps, R)
    there = s > 0.5 * LEAST * R
    ratio = np.where(there, equivalent / np.where(there, s, 1.0), 1.0)
    return np.asarray(np.clip(ratio, NARROWEST, WIDEST))


def _node_values(coefficients: np.ndarray) -> np.ndarray:
    """Return a cubic spline's values at its nodes, those at the rim as if it went on straight."""
    values = coefficients
    for axis in range(values.ndim):
        line = np.moveaxis(values, axis, 0)
        new = line.copy()
        new[1:-1] = (line[:-2] + 4 * line[1:-1] + line[2:]) / 6
        values = np.moveaxis(new, 0, axis)
    return np.ascontiguousarray(values)


def _smooth_step(t: np.ndarray) -> np.ndarray:
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t * t * (3 - 2 * t))


@dataclass(frozen=True, eq=False)
class _Pieces:
    """A surface in small flat pieces, sorted into cubes of a third of the ball's radius."""

    points: np.ndarray  # (M, 3), middles, m
    normals: np.ndarray  # (M, 3), unit
    areas: np.ndarray  # (M,), m²
    first: np.ndarray  # (cubes + 1,) int, first piece of each cube
    origin: np.ndarray  # (4,), corner of the first cube and their size, m
    sides: np.ndarray  # (3,) int, cubes along each axis

    @classmethod
    def of(cls, patches: Patches, radius: float) -> _Pieces:
        corners = patches.corners
        edge = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
        size = radius / FINE
        while (parts := np.maximum(np.ceil(edge / size), 1).astype(np.int64)) @ parts > MOST_PIECES:
            size *= 1.1
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        middles, upright, of = [], [], []
        for count in np.unique(parts):
            rows = np.flatnonzero(parts == count)
            lifted = _lift(corners[rows], patches.normals[rows], _middles(int(count)))
            middles.append(lifted[0])
            upright.append(lifted[1])
            of.append(np.repeat(rows, count * count))
        points, normals, own = (np.concatenate(a) for a in (middles, upright, of))
        low, cube = points.min(axis=0), radius / 3
        cells = ((points - low) / cube).astype(np.int64)
        sides = cells.max(axis=0) + 1
        number = (cells[:, 0] * sides[1] + cells[:, 1]) * sides[2] + cells[:, 2]
        order = np.argsort(number, kind="stable")
        first = np.searchsorted(number[order], np.arange(int(np.prod(sides)) + 1))
        areas = np.linalg.norm(cross, axis=1) / 2 / parts**2
        return cls(
            points[order],
            normals[order],
            areas[own[order]],
            first,
            np.append(low, cube),
            sides,
        )


def _lift(corners: np.ndarray, normals: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return places (t n, 3) of the curved surface over triangles (t, 3, 3), and its normals there.

    They are those from which the distance is measured, see `measured_distance`.
    """
    flat = np.einsum("nk,tki->tni", weights, corners)
    upright = np.einsum("nk,tki->tni", weights, normals)
    upright /= np.linalg.norm(upright, axis=2, keepdims=True)
    bulge = np.einsum(
        "tki,tki->tk", np.roll(normals, -1, axis=1) - normals, np.roll(corners, -1, axis=1) - corners
    )
    height = 0.5 * np.einsum("nk,tk->tn", weights * np.roll(weights, -1, axis=1), bulge)
    return (flat + height[:, :, None] * upright).reshape(-1, 3), upright.reshape(-1, 3)


def _middles(parts: int) -> np.ndarray:
    """Return barycentric coordinates (parts², 3) of the middles of a triangle's equal parts."""
    i, j = (k.ravel() for k in np.meshgrid(np.arange(parts), np.arange(parts), indexing="ij"))
    up, down = i + j < parts, i + j < parts - 1
    a = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / parts
    b = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / parts
    return np.column_stack([1 - a - b, a, b])


@part
def _penetration(x: float, y: float, z: float, radius: float) -> float:
    """Depth of a point in a ball about the origin, m; another tool has another function of the same place."""
    return radius - math.sqrt(x * x + y * y + z * z)


@part
def _between(c: float, low: float, size: float, sides: int) -> int:
    """The cube along one axis in which a coordinate lies, or the nearest."""
    return min(max(int((c - low) / size), 0), sides - 1)


@part
def _overlap(x: float, y: float, z: float, normal: np.ndarray, radius: float) -> float:
    """p^{3/2} w of a piece of the surface, (x, y, z) the way from there to the ball's centre."""
    p = _penetration(x, y, z, radius)
    if p <= 0.0:
        return 0.0
    along = (x * normal[0] + y * normal[1] + z * normal[2]) / (radius - p)
    t = min(max((along - TURNED) / (FACING - TURNED), 0.0), 1.0)
    return float(p * math.sqrt(p) * t * t * (3.0 - 2.0 * t))


@kernel
def _overlaps_into(places, out, points, normals, areas, first, origin, sides, radius) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """V of a ball at places (N, 3), into out (N,)."""
    size = origin[3]
    for n in range(len(places)):
        x, y, z, total = places[n, 0], places[n, 1], places[n, 2], 0.0
        top = _between(z + radius, origin[2], size, sides[2])
        bottom = _between(z - radius, origin[2], size, sides[2])
        for i in range(
            _between(x - radius, origin[0], size, sides[0]),
            _between(x + radius, origin[0], size, sides[0]) + 1,
        ):
            for j in range(
                _between(y - radius, origin[1], size, sides[1]),
                _between(y + radius, origin[1], size, sides[1]) + 1,
            ):
                row = (i * sides[1] + j) * sides[2]
                # pieces of cubes in a row follow each other
                for m in range(first[row + bottom], first[row + top + 1]):
                    total += areas[m] * _overlap(
                        x - points[m, 0], y - points[m, 1], z - points[m, 2], normals[m], radius
                    )
        out[n] = total
