"""Where a body keeps its memory: patches of the touched surface, so that fresh material comes under a sliding probe.

At a probe's centre c, patch j at x_j carries the share σ_j of the elastic energy,

    σ_j = exp(−|x_j − c|²/2w²) / Σ_k exp(−|x_k − c|²/2w²)        Σ σ_j = 1

On a plane the distance of c from it cancels, and σ is a Gaussian of width w about the contact point. It widens with the
area of contact. A sphere of radius R at depth s touches a Hertzian body over a radius a = √(R s), and a little less
than half of it follows transient solves best; with U ~ s³ for the pad in front

    w² = w₁² (U/U₁)^(1/3) + w₀²        w₁ = 0.45 √(R s₁)        U₁ = U(s₁)

where w₀, 0.7 times the patches' spacing, keeps the patterns of light touches wider than the patches are apart. With a
single patch the memory is a scalar that travels with the probe.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError

__all__ = ["Patches", "nearest_points"]

FINE = 0.5  # distance of the points whose mean a patch is, over the spacing of patches
LEAST = 0.7  # w₀ over the spacing: narrower patterns jump from patch to patch
SHARE = 0.45  # w over the radius of a Hertzian contact
_AT_ONCE = 64  # points whose distances to all others are taken at once
MOST = 20_000  # patches: 1 ms of work and more, far beyond what a loop at 1 kHz can spend


@dataclass(frozen=True, eq=False)
class Patches:
    """Places of memory on the touched surface.

    Attributes
    ----------
    points : (M, 3)
        x_j in m, at rest.
    width : float
        w₁ in m, at the energy U₁; `width_at` tells it for a depth s₁ that is typical.
    energy : float
        U₁ in J; 0 for a width that doesn't change.
    least : float
        w₀ in m.

    Raises
    ------
    UsageError
        If the points are no (M, 3) finite numbers, the width isn't positive, or energy or least width is negative.
    """

    points: np.ndarray
    width: float
    energy: float = 0.0
    least: float = 0.0

    def __post_init__(self) -> None:
        points = np.ascontiguousarray(self.points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
            raise UsageError(
                f"Patches can't lie at points of shape {points.shape}.",
                fix="Give (M, 3) finite coordinates in m.",
            )
        _require_sizes(self.width, self.energy, self.least)
        object.__setattr__(self, "points", points)

    def __len__(self) -> int:
        return len(self.points)

    def __str__(self) -> str:
        if len(self) == 1:
            return "one memory that travels with the probe"
        return f"{len(self)} patches of width {1e3 * self.width:.3g} mm"

    @classmethod
    def single(cls) -> Patches:
        """One patch, the same everywhere: a memory that travels with the probe."""
        return cls(np.zeros((1, 3)), 1.0)

    @staticmethod
    def width_at(radius: float, depth: float) -> float:
        """w₁ in m, of a sphere of this radius at this depth, both in m."""
        return SHARE * math.sqrt(radius * depth)

    @classmethod
    def over(
        cls, points: np.ndarray, triangles: np.ndarray, spacing: float, *, width: float, energy: float
    ) -> Patches:
        """Patches over a triangulated surface.

        Parameters
        ----------
        points : (P, 3)
            Nodes at rest, m.
        triangles : (t, 3) int
            The touched surface.
        spacing : float
            Distance of the patches, m; R/4 is fine enough from a depth of R/20 on.
        width, energy : float
            w₁ in m and U₁ in J.

        Raises
        ------
        UsageError
            If a size isn't positive, or the spacing so small that there would be more than 20,000 patches.
        """
        if not 0 < spacing < np.inf:
            raise UsageError(f"Patches can't be {spacing} m apart.", fix="Give a positive spacing in m.")
        corners = np.asarray(points, dtype=float)[np.asarray(triangles)]
        area = 0.5 * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        if area.sum() > MOST * spacing**2:
            raise UsageError(
                f"Patches every {spacing:g} m on {area.sum():g} m² would be {area.sum() / spacing**2:.0f}.",
                why="Every step looks at all of them.",
                fix="Give a larger spacing, or only the part of the surface that will be touched.",
            )
        return cls(_means(_sprinkled(corners, FINE * spacing), spacing), width, energy, LEAST * spacing)


def nearest_points(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return for each point (M, 3) the index (M,) of the nearest of others (K, 3), both in m."""
    rows = (points[start : start + _AT_ONCE] for start in range(0, len(points), _AT_ONCE))
    return np.concatenate([((part[:, None] - others) ** 2).sum(axis=2).argmin(axis=1) for part in rows])


def _require_sizes(width: float, energy: float, least: float) -> None:
    if not (0 < width < np.inf and 0 <= energy < np.inf and 0 <= least < np.inf):
        raise UsageError(
            f"Patches can't be {width} m wide at {energy} J, and {least} m at least.",
            fix="Give a positive width in m, an energy ≥ 0 in J and a least width ≥ 0 in m.",
        )


def _sprinkled(corners: np.ndarray, distance: float) -> np.ndarray:
    """Centroids (K, 3) of the triangles (t, 3, 3), each split evenly until its sides are below a distance."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(1, np.ceil(sides / distance)).astype(int)
    pieces = []
    for n in np.unique(parts):
        i, j = np.nonzero(np.add.outer(np.arange(n), np.arange(n)) < n)
        up = np.stack([i + 1 / 3, j + 1 / 3], axis=1)
        down = up[i + j < n - 1] + 1 / 3
        weights = np.concatenate([up, down]) / n
        whole = np.concatenate([weights, 1 - weights.sum(axis=1, keepdims=True)], axis=1)
        pieces.append(np.einsum("kc,tcx->tkx", whole, corners[parts == n]).reshape(-1, 3))
    return np.concatenate(pieces)


def _means(points: np.ndarray, size: float) -> np.ndarray:
    """Mean (M, 3) of the points (K, 3) in each cube of a size that holds any."""
    cubes = np.floor((points - points.min(axis=0)) / size + 1e-9).astype(np.int64)
    _, which = np.unique(cubes, axis=0, return_inverse=True)
    which = which.reshape(-1)
    count = np.bincount(which)
    sums = [np.bincount(which, points[:, axis]) for axis in range(3)]
    return np.stack(sums, axis=1) / count[:, None]
