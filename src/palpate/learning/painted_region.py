"""The trained region of a body that is pressed all over a painted surface: the paint itself, where the force is known.

A place of the ball is trained where its foot, the nearest point of the surface, is on the paint, it is no deeper than
the solves, and the posterior deviation of the force is under a bound. The rim around the paint belongs to the contact,
not to what is trained. Evaluators know a region as balls about points. So points are taken of those places, with the
largest balls that hold none of the others: the rule costs nothing at run time, and every export has it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.network import TrainedRegion
from palpate.surrogates import LearntEnergy
from palpate.units import bounds

__all__ = ["PaintedRegion", "cover", "painted_region"]

PLACES = 8192  # drawn all over the paint
AROUND = 32768  # drawn all over the rest, of which those near the paint count
NEAR = 1.0  # over the ball's radius: how far from the paint
MOST = 512  # balls of a region, as many as of any other
SLACK = 1 / 8  # of the ball's radius: how far beyond the paint a foot may lie; 1 mm of 8 mm
# Bound on the relative deviation: the force's just noticeable difference, which is what a validation allows at the 95th
# percentile (`palpate.validation.limits`). A force that is less sure than a hand can tell is not known.
DEVIATION = 0.07
# Share of the paint that is trained at least, where the deviation is larger: after few solves it is everywhere.
LEAST = 0.25
RADII = 0.5 * 0.85 ** np.arange(20)  # of balls that are tried, in scaled inputs
SHALLOW = 1 / 25  # least depth of the presses that are looked at, over the largest
OVERLAP = 0.7  # distance of points that are near enough, over the radius: what lies between them is covered
ENOUGH = 0.995  # share of the places that is covered, from which on larger balls are better than more of them


@dataclass(frozen=True, eq=False)
class PaintedRegion:
    """A trained region, and how much of the paint it takes."""

    region: TrainedRegion
    painted_area: float  # of the surface that was to be touched, m²
    trained_area: float  # of its part that is trained over the whole depth, in the mean, m²

    def record(self) -> dict[str, float]:
        """Return the areas as a record has them."""
        return {"painted_area": self.painted_area, "trained_area": self.trained_area}


def painted_region(
    energy: LearntEnergy,
    painted: np.ndarray,
    around: np.ndarray,
    *,
    radius: float,
    deepest: float,
    deviation: float = DEVIATION,
) -> PaintedRegion:
    """Return the region of an energy that was learnt from presses all over a painted surface.

    `painted` (t, 3, 3) are the corners in m of its triangles, counter-clockwise as seen from outside, and `around`
    those of the rest of the body's surface; `radius` is that of the ball and `deepest` the largest depth of the solves,
    in m. `deviation` is the bound on the relative standard deviation of the force.
    """
    from scipy.spatial import cKDTree

    rng, area = np.random.default_rng(0), float(_areas(painted).sum())
    low, high = bounds(energy.inputs)

    def scaled(X: np.ndarray) -> np.ndarray:
        return np.asarray(2 * (X - low) / (high - low) - 1)

    feet, inside = _presses(painted, PLACES, energy, radius, deepest, rng)
    spread = energy.deviation(inside)
    trusted = spread <= max(deviation, float(np.quantile(spread, LEAST)))
    others, outside = _presses(around, AROUND, energy, radius, deepest, rng)
    slack = SLACK * radius + 0.5 * np.sqrt(area / PLACES)
    far = cKDTree(feet).query(others)[0]
    outside = outside[(far > slack) & (far < NEAR * radius)]
    region = cover(scaled(inside[trusted]), scaled(np.concatenate([outside, inside[~trusted]])))
    trained = replace(energy, region=region).inside(inside)
    return PaintedRegion(region, area, float(area * trained.mean()))


def _presses(
    corners: np.ndarray,
    count: int,
    energy: LearntEnergy,
    radius: float,
    deepest: float,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the feet (N, 3) and centres (N, 3) in m of presses at random places and depths of triangles (t, 3, 3)."""
    if not len(corners):
        return np.empty((0, 3)), np.empty((0, 3))
    areas, surface = _areas(corners), energy.baseline.surface
    assert surface is not None
    chosen = corners[rng.choice(len(corners), count, p=areas / areas.sum())]
    a, b, c = np.moveaxis(chosen, 1, 0)
    u, v = np.sort(rng.random((2, count)), axis=0)[:, :, None]
    places = a * u + b * (v - u) + c * (1 - v)
    across = np.cross(b - a, c - a)
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    slope = surface.at(places + radius * normals)[1]
    length = np.linalg.norm(slope, axis=1, keepdims=True)
    normals = np.where(length > 0, slope / np.where(length > 0, length, 1.0), normals)
    depth = deepest * rng.uniform(SHALLOW, 1.0, count)
    centres = places + (radius - depth)[:, None] * normals
    distance, slope, _ = surface.at(centres)
    felt = (radius - distance > 0) & (radius - distance <= deepest)
    return (centres - distance[:, None] * slope)[felt], centres[felt]


def cover(inside: np.ndarray, outside: np.ndarray) -> TrainedRegion:
    """Return the balls about some of the points `inside` (N, n) that cover most of these, and hold none `outside`.

    Of the radii that cover nearly all the largest is taken, which takes the fewest points.
    """
    from scipy.spatial import cKDTree

    room = cKDTree(outside).query(inside)[0] if len(outside) else np.full(len(inside), np.inf)
    best, share = TrainedRegion(inside[[int(np.argmax(room))]], 0.0), 0.0
    for radius in RADII:
        candidates = inside[room > radius]
        if not len(candidates):
            continue
        points = _farthest(candidates, OVERLAP * radius)
        covered = float((cKDTree(points).query(inside)[0] <= radius).mean())
        if covered > share:
            best, share = TrainedRegion(points, float(radius)), covered
        if share >= ENOUGH:
            break
    return best


def _farthest(points: np.ndarray, near: float) -> np.ndarray:
    """Return points far from each other (Gonzalez 1985), at most `MOST`, until each other one is near one of them."""
    chosen = [int(np.argmin(((points - points.mean(axis=0)) ** 2).sum(axis=1)))]
    gap = ((points - points[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < min(MOST, len(points)) and gap.max() > near**2:
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return points[chosen]


def _areas(corners: np.ndarray) -> np.ndarray:
    """Return the areas (t,) in m² of triangles (t, 3, 3)."""
    return np.asarray(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    )
