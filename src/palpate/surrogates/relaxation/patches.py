"""Where a body keeps its memory: patches of the touched surface, so that fresh material comes under a sliding probe.

At a probe's centre c, patch j at x_j carries the share σ_j of the elastic energy,

    σ_j = exp(−|x_j − c|²/2w²) / Σ_k exp(−|x_k − c|²/2w²)        Σ σ_j = 1

On a plane the distance of c from it cancels, and σ is a Gaussian of width w about the foot point. With a single patch
the memory is a scalar that travels with the probe.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError

__all__ = ["Patches"]

FINE = 0.5  # distance of the points that a patch is the mean of, over its width
MOST = 20_000  # patches: 1 ms of work and more, far beyond what a loop at 1 kHz can spend


@dataclass(frozen=True, eq=False)
class Patches:
    """Places of memory on the touched surface.

    Attributes
    ----------
    points : (M, 3)
        x_j in m, at rest.
    width : float
        w in m. For a sphere of radius R on a soft block 0.32 R follows transient solves best.

    Raises
    ------
    UsageError
        If the points are no (M, 3) finite numbers, or the width isn't positive.
    """

    points: np.ndarray
    width: float

    def __post_init__(self) -> None:
        points = np.ascontiguousarray(self.points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
            raise UsageError(
                f"Patches can't lie at points of shape {points.shape}.", fix="Give (M, 3) finite coordinates in m."
            )
        if not 0 < self.width < np.inf:
            raise UsageError(f"A patch can't be {self.width} m wide.", fix="Give a positive width in m.")
        object.__setattr__(self, "points", points)

    def __len__(self) -> int:
        return len(self.points)

    def __str__(self) -> str:
        return f"{len(self)} patches of width {1e3 * self.width:.3g} mm"

    @classmethod
    def single(cls) -> Patches:
        """One patch, the same everywhere: a memory that travels with the probe."""
        return cls(np.zeros((1, 3)), 1.0)

    @classmethod
    def over(cls, points: np.ndarray, triangles: np.ndarray, width: float) -> Patches:
        """Patches about `width` (m) apart over a triangulated surface.

        Parameters
        ----------
        points : (P, 3)
            Nodes at rest, m.
        triangles : (t, 3) int
            The touched surface.
        width : float
            w in m; also the distance of the patches.

        Raises
        ------
        UsageError
            If the width isn't positive, or so small that there would be more than 20,000 patches.
        """
        if not 0 < width < np.inf:
            raise UsageError(f"A patch can't be {width} m wide.", fix="Give a positive width in m.")
        corners = np.asarray(points, dtype=float)[np.asarray(triangles)]
        area = 0.5 * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        if area.sum() > MOST * width**2:
            raise UsageError(
                f"Patches of {width:g} m on {area.sum():g} m² would be {area.sum() / width**2:.0f}.",
                why="Every step updates all patches that were touched lately.",
                fix="Give a larger width, or only the part of the surface that will be touched.",
            )
        return cls(_means(_sprinkled(corners, FINE * width), width), width)


def _sprinkled(corners: np.ndarray, distance: float) -> np.ndarray:
    """Centroids (K, 3) of the triangles (t, 3, 3), each split evenly until its sides are below a distance."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(1, np.ceil(sides / distance)).astype(int)
    found = []
    for n in np.unique(parts):
        i, j = np.nonzero(np.add.outer(np.arange(n), np.arange(n)) < n)
        up = np.stack([i + 1 / 3, j + 1 / 3], axis=1)
        down = up[i + j < n - 1] + 1 / 3
        weights = np.concatenate([up, down]) / n
        whole = np.concatenate([weights, 1 - weights.sum(axis=1, keepdims=True)], axis=1)
        found.append(np.einsum("kc,tcx->tkx", whole, corners[parts == n]).reshape(-1, 3))
    return np.concatenate(found)


def _means(points: np.ndarray, size: float) -> np.ndarray:
    """Mean (M, 3) of the points (K, 3) in each cube of a size that holds any."""
    cubes = np.floor((points - points.min(axis=0)) / size + 1e-9).astype(np.int64)
    _, which = np.unique(cubes, axis=0, return_inverse=True)
    which = which.reshape(-1)
    count = np.bincount(which)
    sums = [np.bincount(which, points[:, axis]) for axis in range(3)]
    return np.stack(sums, axis=1) / count[:, None]
