"""A tool from the file of its surface: a scan or a drawing becomes a smooth signed distance.

The file's triangles are read, repaired and judged as those of a body. The distance is measured at the nodes of a
lattice from the smooth surface behind the triangles (`palpate.surrogates.surface.measured_distance`), and levelled off
deep inside, where it would have kinks.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.physics.shapes.body_file import UNITS, require_unit
from palpate.physics.shapes.divided_surface import divide_large
from palpate.physics.shapes.shape import require_size
from palpate.physics.shapes.surface_checks import require_closed
from palpate.physics.shapes.surface_file import parse_surface
from palpate.physics.shapes.surface_repair import repair_surface
from palpate.surrogates.surface.measured_distance import MeasuredDistance
from palpate.surrogates.surface.oriented_mesh import OrientedMesh
from palpate.tools.scanned_tool import ScannedTool

__all__ = ["read_tool"]

# of the inscribed radius: the lattice's spacing; how deep the distance is one, and over which depth it levels off
SPACING, DEEP, LEVELS = 1 / 6, 0.55, 0.25
SIDE = (
    0.5  # of the inscribed radius: longer edges are halved, or normals at their ends would bend their middle
)
MARGIN = 3  # nodes of the lattice outside the tool on each side
MOST = 120  # nodes along an axis
MOST_TRIANGLES = 100_000
LONGEST = 1.0  # m: a tool that a hand leads is shorter, so a longer one's unit is mistaken
LEVEL = 0.995  # of the largest inscribed radius on the tool's axis, at which its centre is
AXES = {"+x": (0, 1), "-x": (0, -1), "+y": (1, 1), "-y": (1, -1), "+z": (2, 1), "-z": (2, -1)}


def read_tool(
    path: str | os.PathLike[str],
    *,
    unit: str,
    presses: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = "-z",
    spacing: float | None = None,
    name: str = "",
) -> ScannedTool:
    """Return the tool of a closed surface, for `SurfaceTool`.

    The tool keeps its shape in itself: datasets and learnt files do not need its file any more.

    Parameters
    ----------
    path : path
        STL, OBJ, PLY, OFF, GLB, VTP or legacy polydata, also packed with gzip.
    unit : {"m", "dm", "cm", "mm", "um", "in"}
        Unit of its coordinates, which are bare numbers.
    presses : {"+x", "-x", "+y", "-y", "+z", "-z"}
        Direction of the file in which the tool presses; by default downwards.
    spacing : float, optional
        Distance in m of the places at which the shape is kept; by default a sixth of the radius of the ball that fits
        into its end. A finer one keeps smaller features.
    name : str
        What it is called; by default as the file.

    Returns
    -------
    ScannedTool
        In its own frame, pressing along −z; its foremost point is on its axis.

    Raises
    ------
    UsageError
        If the surface is open, inside out, of several shells, cuts itself or is no manifold, its size tells of a
        mistaken unit, or the spacing is too fine or too coarse for it.
    FileFormatError
        If the file is damaged or of another format.
    """
    path = os.fspath(path)
    require_unit(unit)
    if presses not in AXES:
        raise UsageError(
            f"A tool can't press along {presses!r}.",
            why=f"Known are {', '.join(AXES)}.",
            fix="Name one of them.",
        )
    points, triangles = _closed_surface(path, unit)
    points = _turned(points, presses)
    used = points[np.unique(triangles)]
    foremost = used[used[:, 2] <= used[:, 2].min() + 1e-6 * np.ptp(used, axis=0).max()].mean(axis=0)
    points, used = points - foremost, used - foremost
    height = float(used[:, 2].max())
    inscribed = _centre(_measured(points, triangles), height)[1]
    measured = _measured(*divide_large(points, triangles, SIDE * inscribed, MOST_TRIANGLES))
    front, inscribed = _centre(measured, height)
    spacing = (
        inscribed * SPACING if spacing is None else checks.positive("The spacing of a tool", spacing, "m")
    )
    _require_spacing(path, spacing, inscribed, used)
    used = used - np.array([0.0, 0.0, front])
    return _on_lattice(name or Path(path).stem, measured, front, inscribed, spacing, used)


def _closed_surface(path: str, unit: str) -> tuple[np.ndarray, np.ndarray]:
    """Return points (P, 3) in m and triangles (t, 3) of a surface that bounds a body."""
    from trimesh import Trimesh

    surface = repair_surface(parse_surface(path))
    points = surface.points * UNITS[unit]
    require_size(path, float(np.ptp(points, axis=0).max()), unit, "tool", LONGEST)
    solid = Trimesh(points, surface.triangles, process=False)
    if solid.is_watertight and solid.volume < 0:
        raise UsageError(
            f"The surface of the tool {path} is inside out.",
            why="Its triangles face inwards, so that it would be a cavity.",
            fix="Turn its normals in the program that made the file, and export it again.",
        )
    require_closed(solid, path)
    if solid.body_count > 1:
        raise UsageError(
            f"The surface of the tool {path} consists of {solid.body_count} closed shells.",
            why="A tool is one rigid solid, whose distance is measured from one surface.",
            fix="Unite the parts that touch (Boolean union), or export only the outer shell of the part that presses.",
        )
    return points, np.asarray(surface.triangles)


def _measured(points: np.ndarray, triangles: np.ndarray) -> MeasuredDistance:
    """Return the distance to the smooth surface behind a mesh, as for a probe as large as the tool."""
    return MeasuredDistance.of(OrientedMesh.of(points, triangles), float(np.ptp(points, axis=0).max()))


def _turned(points: np.ndarray, presses: str) -> np.ndarray:
    """Return points (P, 3) turned so that the tool presses along −z."""
    axis, sign = AXES[presses]
    z = np.zeros(3)
    z[axis] = -sign
    x = np.eye(3)[(axis + 1) % 3]
    return np.asarray(points @ np.stack([x, np.cross(z, x), z], axis=1))


def _centre(measured: MeasuredDistance, height: float) -> tuple[float, float]:
    """Return the height in m of the tool's centre above its foremost point, and the radius that fits there."""
    line = np.zeros((400, 3))
    line[:, 2] = np.linspace(0.0, height, len(line))
    depth = -measured.at(line)[0]
    first = int(np.argmax(depth >= LEVEL * depth.max()))
    return float(line[first, 2]), float(depth[first])


def _require_spacing(path: str, spacing: float, inscribed: float, points: np.ndarray) -> None:
    """Refuse a lattice that is too coarse for the tool's end, or has too many nodes."""
    least, most = float(np.ptp(points, axis=0).max()) / (MOST - 2 * MARGIN - 2), DEEP * inscribed
    if least <= spacing <= most:
        return
    raise UsageError(
        f"The tool {path} can't be kept at places {millimetres(spacing)} apart.",
        why=f"Its end is {millimetres(2 * inscribed)} thick and it is {millimetres(least * MOST)} long: "
        f"{millimetres(least)} to {millimetres(most)} would do.",
        fix="Give a spacing in m between these, or cut away the part of the file that never touches.",
    )


def _on_lattice(
    name: str, measured: MeasuredDistance, front: float, inscribed: float, spacing: float, points: np.ndarray
) -> ScannedTool:
    """Return the tool, whose points (P, 3) are in its frame and whose distance is measured from its foremost point."""
    from scipy.spatial import ConvexHull

    low = points.min(axis=0) - MARGIN * spacing
    count = np.ceil((points.max(axis=0) + MARGIN * spacing - low) / spacing).astype(int) + 1
    axes = [low[k] + spacing * np.arange(count[k]) for k in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    places = nodes.reshape(-1, 3) + np.array([0.0, 0.0, front])
    distances = measured.at(places)[0].reshape(nodes.shape[:3])
    deep, width = DEEP * inscribed, LEVELS * inscribed
    level = -deep - width * np.tanh((-distances - deep) / width)
    values = np.where(distances < -deep, level, distances)
    hull = points[ConvexHull(points).vertices]
    return ScannedTool.of_lattice(name, low, spacing, values, hull, (front, inscribed, deep))
