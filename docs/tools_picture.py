"""Draws the picture of all tools, as sections of their distances: python docs/tools_picture.py."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from palpate.tools import Box, Capsule, Cone, Cylinder, Fingertip, Punch, Sphere

PICTURE = Path(__file__).parent / "images" / "tools.png"
SHAPES = (
    Sphere(0.008),
    Capsule(0.006, 0.024),
    Cylinder(0.006, 0.024, 0.001),
    Punch(0.008, 0.002),
    Cone(math.radians(50), 0.002),
    Box(0.020, 0.016, 0.010, 0.002),
    Fingertip(0.020, 0.016, 0.014),
)
HALF, HEIGHT = 0.014, 0.018  # m, of the window of x and z


def main() -> None:
    """Draw the section y = 0 of each tool, with lines of equal distance each millimetre and its place."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, rows = plt.subplots(2, 4, figsize=(9, 5), sharex=True, sharey=True)
    x, z = np.meshgrid(np.linspace(-HALF, HALF, 281), np.linspace(-0.004, HEIGHT - 0.004, 181))
    for axes, shape in zip(rows.flat, SHAPES, strict=False):
        points = np.stack([x, np.zeros_like(x), z - shape.front], axis=-1)
        distance = 1e3 * shape.distance(points)
        axes.contourf(1e3 * x, 1e3 * z, distance, [-1e3, 0], colors=["#c9d6e8"])
        axes.contour(1e3 * x, 1e3 * z, distance, range(1, 8), colors="0.8", linewidths=0.6)
        axes.contour(1e3 * x, 1e3 * z, distance, [0], colors="#27496d", linewidths=1.5)
        axes.plot(0, 0, "o", color="#b03a2e", markersize=4)
        axes.set_title(type(shape).__name__, fontsize=9)
        axes.set_aspect("equal")
    rows[1, 3].axis("off")
    rows[1, 3].text(-13, 6, "blue: the tool\nred: its place\ngrey: 1 to 7 mm\nx across, z up, mm", fontsize=8)
    figure.tight_layout()
    figure.savefig(PICTURE, dpi=80, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    main()
