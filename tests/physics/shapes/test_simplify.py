"""Large surfaces with fewer triangles: closed, near the surface that they stand for, and told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from palpate.errors import UsageError
from palpate.physics.shapes import ImportedSolid
from palpate.physics.shapes.filled_surface import read_surface
from palpate.physics.shapes.surface_checks import closest_points, surface_gap
from palpate.physics.shapes.surface_repair import Surface
from palpate.physics.shapes.surface_simplify import simplify_surface

RADIUS = 0.05


def surface_of(mesh: trimesh.Trimesh, label_of: np.ndarray | None = None) -> Surface:
    labels = np.zeros(len(mesh.faces), dtype=int) if label_of is None else label_of
    return Surface(np.array(mesh.vertices), np.array(mesh.faces), labels)


def closed(surface: Surface) -> trimesh.Trimesh:
    mesh = trimesh.Trimesh(surface.points, surface.triangles, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    return mesh


@pytest.mark.full
@pytest.mark.parametrize("noise", [0.0, 2e-5])
def test_a_sphere_stays_a_sphere(noise: float):
    """Nodes and middles of triangles of both surfaces lie between the spheres that the tolerance allows."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    ball.vertices *= 1 + np.random.default_rng(1).normal(0, noise / RADIUS, (len(ball.vertices), 1))
    tolerance = 3e-4
    simple = simplify_surface(surface_of(ball), tolerance, 1000)
    mesh = closed(simple)
    assert mesh.euler_number == 2
    assert len(mesh.faces) < 1300
    assert mesh.volume == pytest.approx(ball.volume, rel=0.01)
    low, high = (f(np.linalg.norm(ball.triangles_center, axis=1)) for f in (np.min, np.max))
    radii = np.concatenate(
        [np.linalg.norm(mesh.vertices, axis=1), np.linalg.norm(mesh.triangles_center, axis=1)]
    )
    assert low - tolerance < radii.min()
    assert radii.max() < max(high, np.linalg.norm(ball.vertices, axis=1).max()) + tolerance
    assert "5,120 triangles were simplified to" in simple.notes[0]


def test_edges_and_corners_of_a_box_stay():
    box = trimesh.creation.box((0.1, 0.08, 0.05))
    for _ in range(4):
        box = box.subdivide()
    simple = simplify_surface(surface_of(box), 1e-5, 100)
    assert closed(simple).volume == pytest.approx(0.1 * 0.08 * 0.05, rel=1e-4)
    assert closed(simple).area == pytest.approx(2 * (0.008 + 0.005 + 0.004), rel=1e-4)
    assert len(simple.triangles) < 250


def test_no_tolerance_for_it_leaves_it_alone():
    rough = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS)
    rough.vertices *= 1 + np.random.default_rng(1).normal(0, 0.02, (len(rough.vertices), 1))
    surface = surface_of(rough)
    assert simplify_surface(surface, 1e-6, 100) is surface


def test_borders_of_labels_stay():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    upper = (ball.triangles_center[:, 2] > 0).astype(int)
    simple = simplify_surface(surface_of(ball, upper), 3e-4, 1500)

    def border(surface: Surface) -> set:
        nodes = [set(surface.triangles[surface.label_of == label].ravel().tolist()) for label in (0, 1)]
        return {tuple(point) for point in surface.points[list(nodes[0] & nodes[1])].tolist()}

    assert border(simple) == border(surface_of(ball, upper))
    assert len(simple.triangles) < 2000


@pytest.mark.full
def test_large_files_are_simplified_and_told(tmp_path: Path):
    ball = trimesh.creation.icosphere(subdivisions=5, radius=50)
    ball.export(path := tmp_path / "ball.stl")
    topology, surface, _ = read_surface(path, "mm")
    assert len(topology.faces) == len(surface.triangles) <= 20_000
    assert topology.volume == pytest.approx(ball.volume * 1e-9, rel=1e-4)
    assert "20,480 triangles were simplified to" in surface.notes[0]
    assert len(read_surface(path, "mm", 0.0)[0].faces) == 20_480
    described = ImportedSolid(path, unit="mm", simplify=0.0).describe()
    assert described["simplify"] == 0
    with pytest.raises(UsageError, match="simplified"):
        ImportedSolid(path, unit="mm", simplify=-1.0)


def test_distances_of_small_triangles_in_metres():
    """A triangle of half a millimetre: the nearest point is inside, on an edge, at a corner."""
    triangle = np.array([[0, 0, 0], [5e-4, 0, 0], [0, 5e-4, 0]])
    points = np.array([[1e-4, 1e-4, 1e-5], [1e-4, -1e-4, 0], [-1e-4, -1e-4, 0]])
    nearest = closest_points(np.repeat(triangle[None], 3, axis=0), points)
    assert np.allclose(nearest, [[1e-4, 1e-4, 0], [1e-4, 0, 0], [0, 0, 0]], atol=1e-12)
    gap, where = surface_gap(triangle[None], triangle[None] + np.array([1e-4, 1e-4, 2e-5]))
    assert gap == pytest.approx(2e-5)
    assert where == pytest.approx([1e-4, 1e-4, 0], abs=1e-12)
