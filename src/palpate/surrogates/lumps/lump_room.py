"""The room for lumps in a body: a box of their centres, ranges of their sizes, and the skin that they stay under."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.surrogates.lumps.lump import EDGE, Lump
from palpate.units import Range

__all__ = ["LumpRoom", "skin_of"]

SLACK = 1e-9  # of a range or a length: a number at its end is inside


@dataclass(frozen=True, eq=False)
class LumpRoom:
    """The room in a body where lumps were looked up, and their sizes."""

    lower: np.ndarray  # (3,), least corner in m of the box of a lump's centre
    upper: np.ndarray  # (3,), largest corner in m of the box of a lump's centre
    radius: Range  # of radii, m
    ratio: Range  # of ratios of moduli
    cover: float = 0.0  # least tissue in m between a lump's edge and any surface of the body
    # (T, 7), triangles of the body's surface: middle (m), outward unit normal, and the distance of the
    # farthest corner from the middle (m). Without any, the box alone decides
    skin: np.ndarray = field(default_factory=lambda: np.zeros((0, 7)))

    def __post_init__(self) -> None:
        own_arrays(self, "lower", "upper", "skin")
        fits = self.lower.shape == self.upper.shape == (3,) and bool((self.lower < self.upper).all())
        if not fits or self.radius.low <= 0 or self.ratio.low <= 0:
            raise UsageError(
                f"There is no room for lumps from {self.lower} to {self.upper} m.",
                why="The lower corner must lie below the upper one, and radius and ratio are positive.",
                fix="Give two corners of a box inside the body, in m.",
            )

    def clearances(self, places: np.ndarray) -> np.ndarray:
        """Return distances (N,) in m from places (N, 3) to the skin, at least so far; 0 outside the body.

        A triangle lies in its plane, within a circle about its middle: the distance to that is exact above plane parts.
        """
        if not len(self.skin):
            return np.full(len(places), np.inf)
        middles, normals, reach = self.skin[:, :3], self.skin[:, 3:6], self.skin[:, 6]
        clear = np.empty(len(places))
        for i, place in enumerate(places):
            way = middles - place
            along = (way * normals).sum(axis=1)
            across = np.sqrt(np.maximum((way**2).sum(axis=1) - along**2, 0.0))
            distance = np.hypot(along, np.maximum(across - reach, 0.0))
            nearest = int(distance.argmin())
            clear[i] = distance[nearest] if along[nearest] > 0 else 0.0
        return clear

    def hold(self, places: np.ndarray, radii: np.ndarray) -> np.ndarray:
        """Return which lumps at places (N, 3) with radii (N,) stay under the skin, (N,) bool."""
        return np.asarray(self.clearances(places) >= (EDGE * radii + self.cover) * (1 - SLACK))

    def require(self, lump: Lump) -> None:
        """Refuse a lump that lies outside, has another size, or leaves the skin."""
        place, spans = np.array(lump.place), self.upper - self.lower
        if (place < self.lower - SLACK * spans).any() or (place > self.upper + SLACK * spans).any():
            low, high = (millimetres(*corner) for corner in (self.lower, self.upper))
            raise UsageError(
                f"The {lump} is outside the room for lumps.",
                why=f"Their centres may lie between {low} and {high} in the body's frame.",
                fix="Move it there, or learn a body with more room.",
            )
        for what, value, own, scale, unit in (
            ("radius", lump.radius, self.radius, 1e3, " mm"),
            ("ratio", lump.ratio, self.ratio, 1.0, ""),
        ):
            if not own.low * (1 - SLACK) <= value <= own.high * (1 + SLACK):
                raise UsageError(
                    f"The {what} of the {lump} is {scale * value:.3g}{unit}.",
                    why=f"It was learnt for {scale * own.low:.3g} to {scale * own.high:.3g}{unit}.",
                    fix=f"Choose a {what} between these.",
                )
        self.require_cover(lump)

    def require_cover(self, lump: Lump) -> None:
        """Refuse a lump whose edge, and the tissue about it, reach beyond the skin."""
        if not self.hold(np.array([lump.place]), np.array([lump.radius]))[0]:
            clear, least = self.clearances(np.array([lump.place]))[0], EDGE * lump.radius + self.cover
            raise UsageError(
                f"The {lump} leaves the skin.",
                why=f"Its centre is {1e3 * clear:.3g} mm under the surface; with its edge and the tissue about it, it "
                f"needs {1e3 * least:.3g} mm.",
                fix=f"Move it {1e3 * (least - clear):.2g} mm deeper, or make it smaller.",
            )


def skin_of(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the skin (T, 7) of triangles (T, 3) of points (P, 3) in m, counter-clockwise seen from outside."""
    corners = points[triangles]
    middles = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    return np.column_stack([middles, normals, reach])
