"""How long the distance of a touched surface takes to build, and how large its table is.

python -m benchmarks.surface_distance [--deep]        ellipsoids of 1,280 and 20,480 triangles; 81,920 with --deep

The ellipsoid of semi-axes 56, 40 and 24 mm is a sphere of triangles, scaled; a ball of 8 mm touches all of it, or its
upper half. Seconds are of processor time on one core.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from palpate.surrogates import TouchedSurface

__all__ = ["built", "ellipsoid"]

SEMI_AXES = np.array([0.056, 0.040, 0.024])  # m
RADIUS = 0.008  # of the probe, m
GOLDEN = (1 + 5**0.5) / 2


def ellipsoid(divisions: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (P, 3) in m and triangles (20 · 4^divisions, 3) of an icosahedron, each halved so often, scaled."""
    a, b = 1.0, GOLDEN
    corners = [(s * a, t * b, 0.0) for s in (1, -1) for t in (1, -1)]
    points = np.array([np.roll(c, k) for k in range(3) for c in corners])
    edge = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = np.abs(edge - 2 * a) < 1e-9
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    triangles = np.array([f if np.linalg.det(points[list(f)]) > 0 else f[::-1] for f in faces])
    for _ in range(divisions):
        middles = points[triangles] + points[np.roll(triangles, -1, axis=1)]
        own, numbers = np.unique(np.round(middles.reshape(-1, 3), 9), axis=0, return_inverse=True)
        m = len(points) + numbers.reshape(-1, 3)
        points = np.vstack([points, own / 2])
        corner = [np.column_stack([triangles[:, k], m[:, k], m[:, k - 1]]) for k in range(3)]
        triangles = np.vstack([*corner, m])
    return points / np.linalg.norm(points, axis=1, keepdims=True) * SEMI_AXES, triangles


def built(points: np.ndarray, triangles: np.ndarray) -> tuple[float, TouchedSurface]:
    """Seconds that the distance takes, and the distance."""
    began = time.process_time()
    surface = TouchedSurface.of(points, triangles, radius=RADIUS, shoulder=RADIUS / 3)
    return time.process_time() - began, surface


def main() -> None:
    """Print a line for each surface."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--deep", action="store_true", help="the finest ellipsoid too")
    divisions = (3, 5, 6) if parser.parse_args().deep else (3, 5)
    TouchedSurface.of(*ellipsoid(1), radius=3 * RADIUS, spacing=RADIUS)  # compiles
    print("triangles  touched     seconds   table (MB)   spacing (mm)   error (µm)")
    for division in divisions:
        points, triangles = ellipsoid(division)
        upper = points[triangles].mean(axis=1)[:, 2] > 0
        for name, some in (("all", triangles), ("upper half", triangles[upper])):
            seconds, surface = built(points, some)
            size = sum(array.nbytes for array in surface.arrays().values()) / 1e6
            print(
                f"{len(triangles):9,}  {name:10}  {seconds:8.2f}  {size:11.2f}  {1e3 * surface.spacing:13.2f}  "
                f"{1e6 * surface.error:11.2f}"
            )


if __name__ == "__main__":
    main()
