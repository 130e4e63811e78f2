"""Draws the picture of all shapes: python docs/shapes_picture.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from palpate.physics.shapes import (
    Block,
    BodyMesh,
    Cylinder,
    Dome,
    FineMesh,
    LayeredBlock,
    Organ,
    Tube,
)

PICTURE = Path(__file__).parent / "images" / "shapes.png"
COLOURS = np.array([[0.86, 0.45, 0.38], [0.40, 0.52, 0.72], [0.72, 0.72, 0.70], [0.88, 0.76, 0.45]])
LIGHT = np.array([0.35, -0.55, 0.76])


def main() -> None:
    """Draw each shape, its surfaces in colours of their own."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    fine = FineMesh("top", 0.006, (0.03, 0.03, 0.0), (0.07, 0.07, 1.0))
    shapes = {
        "Block, refined": Block(element=0.02).rest((fine,)),
        "Cylinder": Cylinder(element=0.01).rest(),
        "LayeredBlock": LayeredBlock().rest(),
        "Dome": Dome(height=0.05, element=0.01).rest(),
        "Organ": Organ().rest(),
        "Tube": Tube().rest(),
    }
    figure = plt.figure(figsize=(9, 5.4))
    for number, (name, mesh) in enumerate(shapes.items()):
        axes = figure.add_subplot(2, 3, number + 1, projection="3d")
        _draw(axes, mesh)
        axes.set_title(f"{name}: {', '.join(mesh.surfaces)}", fontsize=8, y=0.98)
    figure.subplots_adjust(0, 0, 1, 0.96, 0, 0.06)
    figure.savefig(PICTURE, dpi=80, pil_kwargs={"optimize": True})


def _draw(axes: Any, mesh: BodyMesh) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    shade = 0.65 + 0.35 * np.clip(mesh.normals @ LIGHT, 0, 1)
    faces = np.clip(COLOURS[mesh.surface_of % len(COLOURS)] * shade[:, None], 0, 1)
    corners = mesh.points[mesh.triangles]
    axes.add_collection3d(Poly3DCollection(corners, facecolors=faces, edgecolors="0.25", linewidths=0.2))
    low, high = mesh.corners
    half, middle = 0.43 * (high - low).max(), (low + high) / 2
    axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
    axes.set_zlim(middle[2] - half, middle[2] + half)
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(28, -60)
    axes.set_axis_off()


if __name__ == "__main__":
    main()
