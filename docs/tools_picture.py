"""Draws the picture of all tools, in space and as sections of their distances: python docs/tools_picture.py."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from palpate.tools import Box, Capsule, Cone, Cylinder, Fingertip, Punch, Sphere, Tool
from palpate.tools.tool_mesh import tool_mesh

PICTURE = Path(__file__).parent / "images" / "tools.png"
SHAPES = (
    Sphere(0.008),
    Capsule(0.006, 0.024),
    Cylinder(0.006, 0.024, 0.001),
    Punch(0.006, 0.002),
    Cone(math.radians(50), 0.002),
    Box(0.020, 0.016, 0.010, 0.002),
    Fingertip(0.020, 0.016, 0.014),
)
HALF, LOW, HIGH = 0.0135, -0.004, 0.0185  # m, of the window of x and z
COLOUR, PLACE = np.array([0.55, 0.66, 0.80]), "#b03a2e"
LAMP = np.array([-0.45, -0.6, 0.66])  # direction from which light comes


def main() -> None:
    """Draw each tool in space, and its section y = 0 with lines of equal distance each millimetre and its place."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(11.5, 3.9))
    for column, shape in enumerate(SHAPES):
        axes: Any = figure.add_axes((column / 7, 0.40, 1 / 7, 0.56), projection="3d")
        draw_in_space(axes, shape)
        figure.text((column + 0.5) / 7, 0.94, type(shape).__name__, ha="center", fontsize=10)
        draw_section(figure.add_axes((column / 7 + 0.006, 0.10, 1 / 7 - 0.012, 0.32)), shape)
    figure.text(0.01, 0.02, "below: section y = 0; grey: 1 to 7 mm from the tool; red: its place", fontsize=9)
    figure.savefig(PICTURE, dpi=90, pil_kwargs={"optimize": True})


def draw_in_space(axes: Any, shape: Tool) -> None:
    """Draw a tool from the side and a little from above."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    mesh = tool_mesh(shape)
    light = 0.55 + 0.5 * np.clip(mesh.normals[mesh.triangles].mean(axis=1) @ LAMP, 0, 1)
    faces = 1e3 * (mesh.points + np.array([0.0, 0.0, shape.front]))[mesh.triangles]
    colours = np.clip(light[:, None] * COLOUR, 0, 1)
    axes.add_collection3d(Poly3DCollection(faces, facecolors=colours, edgecolors=colours, linewidths=0.2))
    middle = 0.5 * faces[..., 2].max()
    half = max(np.abs(faces[..., :2]).max(), middle)
    axes.set(xlim=(-half, half), ylim=(-half, half), zlim=(middle - half, middle + half))
    axes.set_box_aspect((1, 1, 1), zoom=1.35)
    axes.view_init(elev=18, azim=-62)
    axes.set_axis_off()


def draw_section(axes: Any, shape: Tool) -> None:
    """Draw the section of a tool with its place."""
    x, z = np.meshgrid(np.linspace(-HALF, HALF, 281), np.linspace(LOW, HIGH, 225))
    distance = 1e3 * shape.distance(np.stack([x, np.zeros_like(x), z - shape.front], axis=-1))
    axes.contourf(1e3 * x, 1e3 * z, distance, [-1e3, 0], colors=["#c9d6e8"])
    axes.contour(1e3 * x, 1e3 * z, distance, range(1, 8), colors="0.8", linewidths=0.6)
    axes.contour(1e3 * x, 1e3 * z, distance, [0], colors="#27496d", linewidths=1.5)
    axes.plot(0, 0, "o", color=PLACE, markersize=4)
    axes.set_aspect("equal")
    axes.set_axis_off()


if __name__ == "__main__":
    main()
