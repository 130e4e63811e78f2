"""A liver-like organ of two lobes, made from a formula and a seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.physics.shapes.shape import Solid

__all__ = ["Organ"]

# centre and half axes of the two lobes, in lengths of the organ: a large right one and a flat left one
LOBES = (((-0.14, 0.0, 0.0), (0.34, 0.32, 0.20)), ((0.24, 0.05, -0.01), (0.24, 0.21, 0.10)))
SHARPNESS = 9.0  # of the notch between the lobes
HOLLOW = 0.35  # curvature of the underside, per length of the organ
BUMP = 0.03  # largest change of a half axis or of the radius by the seed, as a share
PATCH = 17  # points along each side of a patch: its spline follows the formula to 1e-5 of the organ's length
# half angles along x and y, in rad as seen from the centre, of the upper and the lower patch
FRONT, ATTACHED = (1.43, 1.36), (1.0, 0.95)


@dataclass(frozen=True)
class Organ(Solid):
    """An organ shaped like a liver: smooth, with a large and a small lobe, a domed front and a hollow back.

    It lies on its back around the origin, its length along x. Surfaces are ``front`` (what can be reached, facing
    up), ``attached`` (the middle of the back, where ligaments hold it) and ``side`` (the rest of the back and the
    rim); the region is ``body``. Elements are curved. It is a smooth stand-in, not a patient's anatomy.

    Attributes
    ----------
    length : float
        Extent along x in m.
    seed : int
        Which of the similar organs: half axes and bumps vary by a few percent.
    element : float, optional
        Largest element size in m, by default a twentieth of the length.

    Raises
    ------
    UsageError
        If the length is not positive or tells of mistaken units, or the seed is no whole number ≥ 0.
    """

    curved: ClassVar[bool] = True

    length: float = 0.20
    seed: int = 0
    element: float | None = None

    def __post_init__(self) -> None:
        checks.positive("The organ's length", self.length, "m")
        if not isinstance(self.seed, int) or self.seed < 0:
            raise UsageError(
                f"The seed of an organ is {self.seed!r}.",
                why="It selects one of the organs and must be a whole number, 0 or more.",
                fix="Pass seed=0, 1, 2, …",
            )
        self.check_extent("The organ")

    @property
    def surfaces(self) -> tuple[str, ...]:
        """``front``, ``attached`` and ``side``."""
        return ("front", "attached", "side")

    @property
    def size(self) -> tuple[float, float, float]:
        """Approximate extent along x, y and z in m."""
        return (self.length, 0.65 * self.length, 0.4 * self.length)

    @property
    def coarse(self) -> float:
        """Largest element size in m."""
        return self.element if self.element is not None else self.length / 20

    def __str__(self) -> str:
        return f"organ {millimetres(self.length)} long, seed {self.seed}"

    def solid(self) -> Any:
        """Six spline patches, sewn; their names set."""
        from netgen.occ import ApproxParamType, Sew, SplineSurfaceInterpolation
        from netgen.occ import Solid as Filled

        names, grids = ("front", "attached", "side", "side", "side", "side"), _directions()
        surface = [_radius(directions, self.seed)[..., None] * directions for directions in grids]
        low = min(points[..., 0].min() for points in surface)
        high = max(points[..., 0].max() for points in surface)
        scale, patches = self.length / (high - low), []
        for name, points in zip(names, surface, strict=True):
            # even parameters: else two patches would run apart between the points they share
            patch = SplineSurfaceInterpolation(points * scale, approx_type=ApproxParamType.IsoParametric)
            patch.name = name
            patches.append(patch)
        body = Filled(Sew(patches, tolerance=1e-6 * self.length))
        body.mat("body")
        return body


def _directions() -> list[np.ndarray]:
    """Unit vectors on six patches that close the sphere: above, below and four around, each (PATCH, PATCH, 3).

    Two patches that meet have the same points on the edge between them.
    """
    above, below = _cap(FRONT, 1.0), _cap(ATTACHED, -1.0)
    share = np.linspace(0.0, 1.0, PATCH)[None, :, None]
    grids = [above, below[:, ::-1]]  # all six are seen from outside, or Netgen would find the inside outside
    for lower, upper in zip(_rim(below), _rim(above), strict=True):
        # turned along the great circle, so that the points are evenly spread
        angle = np.arccos((lower * upper).sum(axis=1))[:, None, None]
        turned = np.sin((1 - share) * angle) * lower[:, None] + np.sin(share * angle) * upper[:, None]
        grids.append(turned / np.sin(angle))
    return grids


def _cap(half_angles: tuple[float, float], z: float) -> np.ndarray:
    """Unit vectors about the z axis, evenly spread up to the half angles in rad; (PATCH, PATCH, 3)."""
    u = np.linspace(-1.0, 1.0, PATCH)
    across, along = np.meshgrid(*(np.tan(u * half) for half in half_angles), indexing="ij")
    grid = np.stack([across, along, np.full_like(along, z)], axis=-1)
    return np.asarray(grid / np.linalg.norm(grid, axis=-1, keepdims=True))


def _rim(grid: np.ndarray) -> tuple[np.ndarray, ...]:
    """The four edges of a patch, each beginning where the one before ends."""
    return grid[:, 0], grid[-1], grid[::-1, -1], grid[0, ::-1]


def _radius(directions: np.ndarray, seed: int) -> np.ndarray:
    """Distance from the origin to the surface along each direction, in about lengths of the organ.

    The level function grows along every ray from the origin, so one bisection finds the only crossing.
    """
    random = np.random.default_rng(seed)
    stretch = 1 + BUMP * random.uniform(-1, 1, (2, 3))
    waves, phases = random.normal(size=(3, 3)), random.uniform(0, 2 * np.pi, 3)
    low, high = np.full(directions.shape[:-1], 0.01), np.full(directions.shape[:-1], 2.0)
    for _ in range(60):
        middle = (low + high) / 2
        outside = _level(middle[..., None] * directions, stretch) > 0
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    bumps = np.cos(2 * directions @ waves.T + phases).mean(axis=-1)
    return np.asarray((low + high) / 2 * (1 + BUMP * bumps))


def _level(points: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Negative inside the organ: two ellipsoids, joined smoothly and bent over a hollow."""
    x, y, z = np.moveaxis(points, -1, 0)
    bent = np.stack([x, y, z + HOLLOW * (x * x + y * y)], axis=-1)
    distances = [
        np.linalg.norm((bent - np.array(centre)) / (np.array(axes) * factor), axis=-1) - 1
        for (centre, axes), factor in zip(LOBES, stretch, strict=True)
    ]
    nearest = np.minimum(*distances)
    excess = sum(np.exp(-SHARPNESS * (d - nearest)) for d in distances)
    return np.asarray(nearest - np.log(excess) / SHARPNESS)
