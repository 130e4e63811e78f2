"""What a touched surface is made of: checked triangles, normals, curved patches, nearest points."""

import numpy as np
import pytest
from skins import ball, box, directions, plate, tube

from palpate.errors import UsageError
from palpate.surrogates.surface.curved_patches import patches_of
from palpate.surrogates.surface.measured_distance import MeasuredDistance
from palpate.surrogates.surface.nearest_triangle import DEEP, disc_tree, nearest_into
from palpate.surrogates.surface.oriented_mesh import OrientedMesh, corners_of


def broken(change):
    points, triangles = plate(0.1, 4)
    points, triangles = points.copy(), triangles.copy()
    return change(points, triangles)


def turn(points, triangles):
    triangles[5] = triangles[5, ::-1]
    return points, triangles


def flatten(points, triangles):
    triangles[3, 1] = triangles[3, 0]
    return points, triangles


def third(points, triangles):
    edge = triangles[0, [2, 0]]
    return np.vstack([points, [0, 0, 1.0]]), np.vstack([triangles, [*edge, len(points)]])


def apart(points, triangles):
    return points[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (turn, "opposite"),
        (flatten, "no area"),
        (third, "more than two"),
        (apart, "where another one is"),
        (lambda p, t: (p, t + 5), "corner"),
        (lambda p, t: (p, t - 1), "corner -1"),
        (lambda p, t: (np.where(p == p[3], np.nan, p), t), "finite"),
        (lambda p, t: (p[:, :2], t), "shape"),
        (lambda p, t: (p, t[:0]), "needs triangles"),
        (lambda p, t: (p, t.astype(float)), "whole numbers"),
    ],
)
def test_what_is_no_oriented_surface_is_refused(change, word):
    with pytest.raises(UsageError, match=word):
        OrientedMesh.of(*broken(change))


def test_neighbours_share_an_edge_and_the_rest_is_border():
    mesh = OrientedMesh.of(*plate(0.1, 4))
    assert mesh.border.sum() == 16
    for t, k in np.argwhere(~mesh.border):
        s, m = divmod(mesh.neighbours[t, k], 3)
        assert mesh.triangles[t, k] == mesh.triangles[s, (m + 1) % 3]
        assert mesh.triangles[t, (k + 1) % 3] == mesh.triangles[s, m]
    assert not OrientedMesh.of(*ball(1.0, 4)).border.any()


def test_normals_of_a_ball_are_exact_however_irregular():
    mesh = OrientedMesh.of(*ball(0.05, 8, scatter=0.1))
    corners = corners_of(mesh)
    assert np.abs(corners.normals - mesh.corners / 0.05).max() < 1e-9
    assert not corners.sharp.any()


def test_at_the_border_a_paraboloid_tells_the_normal():
    points, triangles = ball(0.05, 12, scatter=0.05)
    half = triangles[(points[triangles, 2] > -1e-3).all(axis=1)]
    mesh = OrientedMesh.of(points, half)
    corners = corners_of(mesh)
    assert corners.sharp.any()
    angle = np.linalg.norm(corners.normals - mesh.corners / 0.05, axis=2)
    facet = np.linalg.norm(mesh.facets[:, None] - mesh.corners / 0.05, axis=2)
    # a facet leans by first order of the edge, the paraboloid by third: (h/R)³ with h/R = 0.13
    assert angle.max() < 0.01
    assert facet.max() > 0.06


def test_creases_part_the_normals_and_stay_straight():
    mesh = OrientedMesh.of(*box(0.06, 3))
    corners = corners_of(mesh)
    assert mesh.creases.sum() == 2 * 12 * 3
    assert np.abs(np.abs(corners.normals).max(axis=2) - 1).max() < 1e-12
    patches = patches_of(mesh)
    assert len(patches.corners) == len(mesh.triangles)
    assert np.abs(np.abs(patches.corners).max(axis=2) - 0.03).max() < 1e-15


def test_patches_of_a_coarse_tube_lie_on_it_and_its_rim_is_a_circle():
    mesh = OrientedMesh.of(*tube(0.03, 0.06, 24, 6))
    patches = patches_of(mesh)
    sag = 0.03 * (1 - np.cos(np.pi / 24))
    r = np.linalg.norm(patches.corners[..., :2], axis=2)
    assert len(patches.corners) > 4 * len(mesh.triangles)
    # a cubic with the circle's tangents misses 0.19 θ² of the sag, θ = 15°; across diagonals about twice that
    assert np.abs(r - 0.03).max() < sag / 30
    rim = np.abs(patches.corners[..., 2]) > 0.03 - 1e-9
    assert np.abs(r[rim] - 0.03).max() < sag / 50
    radial = (
        np.concatenate([patches.corners[..., :2], np.zeros_like(patches.corners[..., :1])], axis=2)
        / r[..., None]
    )
    assert np.abs(patches.normals - radial).max() < 0.005


@pytest.mark.full
def test_the_tree_finds_the_nearest_of_all_triangles():
    rng = np.random.default_rng(0)
    corners = rng.uniform(-1, 1, (301, 1, 3)) + 0.2 * rng.normal(size=(301, 3, 3))
    order, discs = disc_tree(corners)
    corners, foot, trial = corners[order], np.zeros(3), np.zeros(3)
    waiting = np.zeros(DEEP, dtype=np.int64)
    fine = np.array([(i, j, 20 - i - j) for i in range(21) for j in range(21 - i)]) / 20
    cloud = np.einsum("nk,tki->tni", fine, corners)
    for c in rng.uniform(-1.5, 1.5, (200, 3)):
        square, t, _ = nearest_into(*c, 7, discs, corners, waiting, foot, trial)
        assert foot.min() >= 0
        assert foot.sum() == pytest.approx(1)
        assert square == pytest.approx(((foot @ corners[t] - c) ** 2).sum(), abs=1e-12)
        nearest = np.linalg.norm(cloud - c, axis=2).min()
        assert np.sqrt(square) <= nearest + 1e-12
        assert nearest - np.sqrt(square) < 0.1  # points 1/20 of an edge apart


def test_measured_distance_of_a_ball():
    points, triangles = ball(0.05, 12, scatter=0.06)
    truth = np.random.default_rng(0).uniform(-0.02, 0.02, 5000)
    d, kinds = MeasuredDistance.of(OrientedMesh.of(points, triangles), 0.01).at(
        (0.05 + truth)[:, None] * directions(5000, 3)
    )
    assert np.abs(d - truth).max() < 4e-6
    assert not kinds.any()


def test_measured_distance_beside_a_plate_is_that_to_its_rim():
    C = np.random.default_rng(1).uniform([-0.06, -0.06, 0], [0.06, 0.06, 0.02], (5000, 3))
    d, _ = MeasuredDistance.of(OrientedMesh.of(*plate(0.08, 5, seed=3)), 0.01).at(C)
    beyond = np.maximum(np.abs(C) - [0.04, 0.04, 0], 0)
    assert d == pytest.approx(np.linalg.norm(beyond, axis=1), abs=1e-15)


@pytest.mark.full
def test_depths_into_a_dome_are_those_of_its_finite_elements():
    from palpate.physics.interactions.surface_patch import surface_of
    from palpate.physics.shapes.dome import Dome

    dome = Dome(radius=0.05, element=0.01)
    mesh = dome.rest(())
    exact = MeasuredDistance.of(OrientedMesh.of(mesh.points, mesh.triangles_of("top")), 0.01)
    v = directions(200, 4)
    v[:, 2] = np.abs(v[:, 2])
    C = 0.05 * v + [0, 0, 0.01]
    elements = surface_of(dome, "top")
    d = exact.at(C)[0]
    longest = np.linalg.norm(np.diff(mesh.points[mesh.triangles_of("top")], axis=1), axis=2).max()
    sag = longest**2 / (8 * 0.05)
    # small triangles, four to an edge, miss a sixteenth; a third more off the edges
    assert np.abs(d - [elements.nearest(c)[2] for c in C]).max() < sag / 16 * 1.5
    assert np.abs(d - (np.linalg.norm(C, axis=1) - 0.05)).max() < sag / 40
