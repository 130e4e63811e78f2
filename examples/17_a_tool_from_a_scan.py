"""Press soft tissue with the fingertip of a scan, which is made here by a formula, and compare it with an ellipsoid."""

import tempfile
from pathlib import Path

import numpy as np
import trimesh

import palpate as pp


def scan_of_a_fingertip() -> trimesh.Trimesh:
    """Return a finger of 16 × 14 × 24 mm that points down: round at its end, flat at the nail, a little lumpy."""
    finger = trimesh.creation.icosphere(subdivisions=4)
    x, y, z = finger.vertices.T
    finger.vertices = np.stack(
        [
            8 * x * (1 - 0.06 * z),
            7 * y * np.where(y > 0, 0.8, 1.0) + 0.15 * np.sin(3 * x),  # the nail's side is flatter
            12 * z,
        ],
        axis=1,
    )
    return finger


with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "finger.stl"
    scan_of_a_fingertip().export(path)
    finger = pp.read_tool(path, unit="mm", presses="-z")
print(finger)  # the file is gone, the tool is not

block = pp.shapes.Block((0.04, 0.04, 0.02))  # m
body = pp.Body(block, pp.materials.NeoHookean(young=9e3, poisson=0.45))
for shape in (finger, pp.tools.Fingertip(0.016, 0.014, 0.024)):
    tool = pp.SurfaceTool(shape, depth=(0.0, 0.003), over=((0.019, 0.019), (0.021, 0.021)), element=0.006)
    solution = body.problem(tool).solve([0.020, 0.020, 0.018])  # 2 mm deep
    print(f"{shape}: {1e3 * solution.force[2]:.1f} mN")
