"""Ten parts made by scripts, as people have them: STL, STEP, volume meshes; smooth, noisy, grooved, thin.

Each function writes one file and returns its path. None of them was made to suit palpate: each stands for a kind of
part that people press (a lattice, a cup, a sponge, a limb, a scan, a bracket), with the triangles that its tool would
give it. A grooved organ and a dome come beside these ten, for `painted_parts`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np

__all__ = ["PARTS", "dome", "grooved_organ"]


def lattice_ring(folder: Path) -> Path:
    """Write a ring of two hoops and twelve struts as STL, 60 mm across: a lattice as it is printed of silicone."""
    from netgen.occ import Axis, Cylinder, Pnt, Z

    def hoop(height: float) -> Any:
        outer = Cylinder(Pnt(0, 0, height), Z, r=30, h=5)
        return outer - Cylinder(Pnt(0, 0, height - 1), Z, r=21, h=7)

    strut = Cylinder(Pnt(25.5, 0, 4), Z, r=3, h=10)
    ring = hoop(0) + hoop(13)
    for k in range(12):
        ring = ring + strut.Rotate(Axis((0, 0, 0), Z), 30 * k)
    return _stl_of(ring, folder / "lattice-ring.stl", 4)


def thin_cup(folder: Path) -> Path:
    """Write a cup of 50 mm with walls of 3 mm, upside down, as STEP: thin everywhere it is pressed."""
    from netgen.occ import Cylinder, Pnt, Z

    cup = Cylinder(Pnt(0, 0, 0), Z, r=25, h=30) - Cylinder(Pnt(0, 0, -1), Z, r=22, h=28)
    return _step_of(cup, folder / "thin-cup.step")


def gyroid_sponge(folder: Path) -> Path:
    """Write a block of 40 mm of a gyroid, half of it solid, as STL: a surface with handles and sharp cut edges."""
    side, cells, points_a_side = 40.0, 1.5, 33
    axis = np.linspace(-0.02, 1.02, points_a_side)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    u, v, w = (2 * np.pi * cells * t for t in (x, y, z))
    gyroid = np.sin(u) * np.cos(v) + np.sin(v) * np.cos(w) + np.sin(w) * np.cos(u) - 0.3
    walls = 12 * (np.max(np.abs(np.stack([x, y, z]) - 0.5), axis=0) - 0.5)
    points, triangles = zero_surface(np.maximum(gyroid, walls))
    points = side * (axis[0] + points * (axis[1] - axis[0]))
    return _stl(points, triangles, folder / "gyroid-sponge.stl")


def limb(folder: Path) -> Path:
    """Write a lying limb of 120 mm with a bone of 14 mm within as STEP: two regions that share a surface."""
    from netgen.occ import Box, Cylinder, Glue, Pnt, X

    flesh = Cylinder(Pnt(0, 0, 0), X, r=25, h=120) * Box(Pnt(-1, -30, -18), Pnt(121, 30, 30))
    bone = Cylinder(Pnt(0, 0, -2), X, r=7, h=120)
    flesh = flesh - bone
    flesh.mat("flesh")
    bone.mat("bone")
    return _step_of(Glue([flesh, bone]), folder / "limb.step")


def scanned_blob(folder: Path) -> Path:
    """Write a blob of 80 mm with the noise of a scanner on its 5,120 corners as STL."""
    from trimesh.creation import icosphere

    sphere, rng = icosphere(subdivisions=4), np.random.default_rng(7)
    points = np.array(sphere.vertices)
    waves = rng.standard_normal((12, 3)) * 2.0
    bumps = sum(np.sin(points @ wave + rng.uniform(0, 6)) for wave in waves) / len(waves)
    radius = 40.0 * (1 + 0.25 * bumps)[:, None]
    noise = 0.12 * rng.standard_normal(points.shape)
    return _stl(points * radius + noise, np.array(sphere.faces), folder / "scanned-blob.stl")


def drilled_block(folder: Path) -> Path:
    """Write a block of 60 × 40 × 25 mm with a hole of 12 mm through it, lengthwise, as STEP."""
    from netgen.occ import Box, Cylinder, Pnt, X

    block = Box(Pnt(0, 0, 0), Pnt(60, 40, 25)) - Cylinder(Pnt(-1, 20, 11), X, r=6, h=62)
    return _step_of(block, folder / "drilled-block.step")


def fine_organ(folder: Path) -> Path:
    """Write an organ of 81,920 triangles as STL, 90 mm long, as segmentation of a CT scan gives it."""
    from trimesh.creation import icosphere

    sphere = icosphere(subdivisions=6)
    x, y, z = np.array(sphere.vertices).T
    lobes = 1 + 0.12 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.06 * np.cos(4 * z + x)
    points = np.stack(
        [45 * x * lobes, 30 * y * lobes + 8 * x * x, 20 * z * lobes * (1 - 0.2 * (z < 0) * z * z)], axis=1
    )
    return _stl(points, np.array(sphere.faces), folder / "fine-organ.stl")


def layered_skin(folder: Path) -> Path:
    """Write a plate of skin on fat as a volume mesh (VTU) with a whole number a cell as its region."""
    from palpate.physics.shapes import Block

    mesh = Block(size=(0.06, 0.06, 0.02), element=0.006).rest()
    middles = mesh.points[mesh.tetrahedra].mean(axis=1)
    region = np.where(middles[:, 2] > 0.015, 2, 1)
    path = folder / "layered-skin.vtu"
    meshio.Mesh(1e3 * mesh.points, [("tetra", mesh.tetrahedra)], cell_data={"layer": [region]}).write(path)
    return path


def bent_finger(folder: Path) -> Path:
    """Write a finger of a soft gripper, a bent bar of 80 mm with seven notches below, as STEP."""
    from netgen.occ import Box, Pnt

    finger = Box(Pnt(0, 0, 0), Pnt(80, 16, 14))
    for k in range(7):
        finger = finger - Box(Pnt(8 + 10 * k, -1, -1), Pnt(12 + 10 * k, 17, 6))
    return _step_of(finger, folder / "bent-finger.step")


def hollow_heart(folder: Path) -> Path:
    """Write an egg of 70 mm with a closed chamber within as STL: two nested shells, the inner one facing inwards."""
    from trimesh.creation import icosphere

    sphere = icosphere(subdivisions=4)
    points, faces = np.array(sphere.vertices), np.array(sphere.faces)
    outer = points * (28, 26, 35 * (1 + 0.1 * points[:, 2].mean()))
    outer[:, 0] *= 1 + 0.15 * points[:, 2]
    inner = points * (14, 13, 18) + (0, 0, 1)
    joined = np.concatenate([outer, inner])
    return _stl(joined, np.concatenate([faces, len(points) + faces[:, ::-1]]), folder / "hollow-heart.stl")


def grooved_organ(folder: Path) -> Path:
    """Write an organ of 76 × 96 × 81 mm with winding grooves of 9 mm width and 2.5 mm depth on top, noisy, as STL.

    The grooves are narrower than the contact of a ball of 12 mm, which is 13 mm wide at a depth of 2 mm, and deeper
    than that; each corner has the noise of a scanner. The triangles are of 3 mm.
    """
    from trimesh.creation import icosphere

    sphere, rng = icosphere(subdivisions=4), np.random.default_rng(11)
    unit = np.array(sphere.vertices)
    x, y, z = unit.T
    lobes = 1 + 0.05 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.03 * np.cos(4 * z + x)
    points = unit * (38, 48, 40.5) * lobes[:, None]
    # height in the grooves' own wave: they lie 15 mm apart and wind by 6 mm
    phase = points[:, 1] + 6 * np.sin(points[:, 0] / 9) * np.cos(points[:, 2] / 14)
    beside = np.abs((phase + 7.5) % 15 - 7.5)
    # they end gently below the middle: a groove that broke off would be a sharp edge
    rise = np.clip((z - 0.2) / 0.3, 0, 1)
    depth = 2.5 * np.exp(-((beside / 3.15) ** 2)) * rise * rise * (3 - 2 * rise)
    moved = points - depth[:, None] * unit + 0.06 * rng.standard_normal(points.shape)
    return _stl(moved, np.array(sphere.faces), folder / "grooved-organ.stl")


def dome(folder: Path) -> Path:
    """Write half a ball of 80 mm on its flat side as STL, as a breast phantom."""
    from netgen.occ import Box, Pnt, Sphere

    half = Sphere(Pnt(0, 0, 0), r=40) * Box(Pnt(-50, -50, 0), Pnt(50, 50, 50))
    return _stl_of(half, folder / "dome.stl", 4)


PARTS: dict[str, Callable[[Path], Path]] = {
    function.__name__: function
    for function in (
        lattice_ring,
        thin_cup,
        gyroid_sponge,
        limb,
        scanned_blob,
        drilled_block,
        fine_organ,
        layered_skin,
        bent_finger,
        hollow_heart,
    )
}


def zero_surface(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface on which a function on a grid is zero, negative inside, by marching tetrahedra.

    Each cube of the grid is divided into six tetrahedra around one diagonal, the same way in all cubes, so that the
    surface is closed where the function is positive on the border (Doi & Koide 1991).

    Parameters
    ----------
    values : (a, b, c) array
        Function on the points of the grid.

    Returns
    -------
    points : (n, 3) array
        In steps of the grid.
    triangles : (t, 3) int array
        Counter-clockwise as seen from outside.
    """
    flat = np.where(np.abs(values) < 1e-3, 1e-3, values).ravel()  # no corner lies on the surface
    shape = np.array(values.shape)
    corner = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
    ways = [(4, 2, 1), (4, 1, 2), (2, 4, 1), (2, 1, 4), (1, 4, 2), (1, 2, 4)]
    tetrahedra = np.array([[0, a, a | b, 7] for a, b, _ in ways])
    cube = np.stack(np.meshgrid(*[np.arange(n - 1) for n in shape], indexing="ij"), axis=-1).reshape(
        -1, 1, 1, 3
    )
    places = cube + corner[tetrahedra][None]
    number = (places @ np.array([shape[1] * shape[2], shape[2], 1])).reshape(-1, 4)
    inside = flat[number] < 0
    edges: list[np.ndarray] = []  # (t, 3, 2) corners of the grid between which each corner of a triangle lies
    for pattern in range(1, 15):
        within = np.array([bool(pattern >> k & 1) for k in range(4)])
        rows = number[(inside == within).all(axis=1)]
        below, above = np.flatnonzero(within), np.flatnonzero(~within)
        pairs = [(p, q) for p in below for q in above]
        if len(pairs) == 4:
            pairs = [pairs[0], pairs[1], pairs[3], pairs[2]]
        for pick in [(0, 1, 2)] if len(pairs) == 3 else [(0, 1, 2), (0, 2, 3)]:
            edges.append(np.stack([rows[:, list(pairs[k])] for k in pick], axis=1))  # noqa: PERF401
    found = np.concatenate(edges)
    ends = np.sort(found.reshape(-1, 2), axis=1)
    unique, index = np.unique(ends, axis=0, return_inverse=True)
    low, high = (np.stack(np.unravel_index(unique[:, k], shape), axis=1).astype(float) for k in (0, 1))
    share = flat[unique[:, 0]] / (flat[unique[:, 0]] - flat[unique[:, 1]])
    points = low + np.clip(share, 0.08, 0.92)[:, None] * (high - low)
    triangles = index.reshape(-1, 3)
    # the outer side is where the function grows
    inner = np.where((flat[found[..., 0]] < 0)[..., None], *_coordinates(found, shape)).mean(axis=1)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    outwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3 - inner) > 0
    return points, np.where(outwards[:, None], triangles, triangles[:, ::-1])


def _coordinates(edges: np.ndarray, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of both ends of each edge, in steps of the grid."""
    first, second = (np.stack(np.unravel_index(edges[..., k], shape), axis=-1).astype(float) for k in (0, 1))
    return first, second


def _stl(points: np.ndarray, triangles: np.ndarray, path: Path) -> Path:
    meshio.Mesh(points, [("triangle", triangles)]).write(path, binary=True)
    return path


def _stl_of(solid: Any, path: Path, size: float) -> Path:
    """Write the surface of a solid of OpenCASCADE as STL, its triangles of at most this size."""
    from netgen.occ import OCCGeometry

    mesh = OCCGeometry(solid).GenerateMesh(maxh=size, perfstepsend=4)
    points = np.array([point.p for point in mesh.Points()])
    triangles = np.array([[vertex.nr - 1 for vertex in element.vertices] for element in mesh.Elements2D()])
    return _stl(points, triangles, path)


def _step_of(solid: Any, path: Path) -> Path:
    solid.WriteStep(str(path))
    return path
