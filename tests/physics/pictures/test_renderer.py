"""Pictures: what they show can be read back from their pixels."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from drawn import Made, bent
from matplotlib.text import Text

from palpate.errors import UsageError
from palpate.physics.deformed import (
    corner_normals,
    cut_lines,
    fine_body,
    hatching,
    nodal_field,
    nodal_strain,
    section,
)
from palpate.physics.renderer import Camera, draw_body, draw_triangles, palette, plot_solution


def area(triangles: np.ndarray) -> float:
    a, b, c = np.moveaxis(triangles[:, :, :3], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize("place", [0.0123, 0.05, 0.071])
def test_a_cut_keeps_the_areas_that_geometry_says(mesh, place: float):
    heights = mesh.points[:, 0] - place
    faces = section(mesh.points[mesh.tetrahedra], heights[mesh.tetrahedra])
    assert area(faces) == pytest.approx(0.10 * 0.05, rel=1e-9)
    assert np.allclose(faces[:, :, 0], place, rtol=0, atol=1e-12)
    rim = section(mesh.points[mesh.triangles], heights[mesh.triangles])
    assert np.linalg.norm(rim[:, 1] - rim[:, 0], axis=1).sum() == pytest.approx(2 * (0.10 + 0.05), rel=1e-9)


def test_values_on_a_cut_are_interpolated(mesh):
    linear = np.concatenate([mesh.points, mesh.points @ [[1.0], [2.0], [-3.0]]], axis=1)
    faces = section(linear[mesh.tetrahedra], (mesh.points[:, 1] - 0.043)[mesh.tetrahedra])
    assert np.allclose(faces[:, :, 3], faces[:, :, :3] @ [1.0, 2.0, -3.0], rtol=0, atol=1e-12)


@pytest.mark.full
def test_the_nearer_triangle_hides_the_farther_and_covers_its_area():
    far = [[10.0, 10.0, 0.0], [90.0, 10.0, 0.0], [10.0, 90.0, 0.0]]
    near = [[10.0, 10.0, 1.0], [50.0, 10.0, 1.0], [10.0, 50.0, 1.0]]
    for order in ((0, 1), (1, 0)):
        depth, image = np.full((100, 100), -np.inf), np.zeros((100, 100, 2))
        screen = np.array([far, near])[list(order)]
        draw_triangles(screen, np.array([[[5.0, 0.0]] * 3, [[7.0, 0.0]] * 3])[list(order)], depth, image)
        # a pixel counts where its centre is inside: the error is at most the edge's length
        assert np.sum(np.isclose(image[..., 0], 7.0)) == pytest.approx(40**2 / 2, abs=60)
        assert np.sum(np.isfinite(depth)) == pytest.approx(80**2 / 2, abs=120)


def ball(rings: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Points of a unit sphere and its triangles; those at the poles have two equal corners and are left out."""
    polar, around = np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    p, a = np.meshgrid(polar, around, indexing="ij")
    grid = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    number = np.arange(p.size).reshape(p.shape)
    corners = [number[:-1], number[1:], np.roll(number, -1, axis=1)[1:], np.roll(number, -1, axis=1)[:-1]]
    triangles = [
        np.stack([corners[i] for i in way], axis=-1).reshape(-1, 3) for way in ((0, 1, 2), (0, 2, 3))
    ]
    points, node = np.unique(np.round(grid.reshape(-1, 3), 12), axis=0, return_inverse=True)
    triangles = node.ravel()[np.concatenate(triangles)]
    return points, triangles[(np.diff(np.sort(triangles, axis=1), axis=1) != 0).all(axis=1)]


def test_normals_are_smooth_on_a_ball_and_sharp_on_a_block(mesh):
    points, triangles = ball()
    found = corner_normals(points, triangles)
    assert np.einsum("tci,tci->tc", found, points[triangles]).min() > np.cos(
        np.radians(4.5)
    )  # a ring's width
    on_block = corner_normals(mesh.points, mesh.triangles)
    assert np.allclose(on_block, mesh.normals[:, None], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("place", "view"), [(0.2, (0.0, 0.0)), (0.2, (90.0, 0.0)), (0.037, (90.0, 0.0))])
def test_a_body_fills_the_picture_as_the_projection_says(made: Made, place: float, view):
    """What lies above the plane x = place is left out: of the face seen along y, place × 50 mm remain."""
    mesh = made.mesh
    camera = Camera.around(mesh.points, view, (600, 600))
    corners = mesh.points[mesh.triangles]
    zero = np.zeros_like(corners[:, :, :1])
    normals = corner_normals(mesh.points, mesh.triangles)
    columns = [corners, zero, normals, corners[:, :, :1] - place]
    depth, _ = draw_body(np.concatenate(columns, axis=2), camera, None)
    seen = np.isfinite(depth).sum() / camera.scale**2
    assert seen == pytest.approx(min(place, 0.10) * 0.05, rel=0.01)


def test_strain_of_a_uniform_stretch_is_uniform(mesh):
    u = mesh.points * [0.1, -0.02, 0.03]
    assert np.allclose(nodal_strain(Made(mesh, u)), 0.1, rtol=0, atol=1e-12)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = (mesh.points + u) @ turn.T - mesh.points
    assert np.allclose(nodal_strain(Made(mesh, turned)), 0.1, rtol=0, atol=1e-12)


def test_with_mid_side_nodes_strain_is_that_of_the_second_order(mesh):
    """u_z = 5 x² m⁻¹ is of second order, so the gradient at each node is exact."""
    made = bent(mesh)
    gradients = np.tile(np.eye(3), (len(mesh.points), 1, 1))
    gradients[:, 2, 0] = 10.0 * mesh.points[:, 0]
    exact = np.abs(np.linalg.svd(gradients, compute_uv=False) - 1).max(axis=1)
    assert np.allclose(nodal_strain(made), exact, rtol=0, atol=1e-12)
    assert np.abs(nodal_strain(made.with_(mid_sides=None)) - exact).max() > 0.01


def test_what_is_drawn_follows_the_second_order(mesh):
    made = bent(mesh)
    fine = fine_body(made)
    assert np.allclose(fine.displacement[:, 2], 5 * fine.points[:, 0] ** 2, rtol=0, atol=1e-15)
    assert len(fine.triangles) == 4 * len(mesh.triangles)
    # eight tetrahedra of an eighth each, all the same way round, and a closed skin around them
    cells = np.linalg.det(np.diff(fine.points[fine.tetrahedra], axis=1))
    parents = np.linalg.det(np.diff(mesh.points[mesh.tetrahedra], axis=1))
    assert np.allclose(cells.reshape(-1, 8), parents[:, None] / 8, rtol=1e-9, atol=0)
    a, b, c = np.moveaxis(fine.points[fine.triangles], 1, 0)
    assert np.einsum("ti,ti->", a, np.cross(b, c)) / 6 == pytest.approx(0.1 * 0.1 * 0.05, rel=1e-9)
    half = np.linalg.norm(np.diff(fine.points[fine.wires], axis=1)[:, 0], axis=1)
    whole = np.unique(np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    assert half.sum() == pytest.approx(
        np.linalg.norm(np.diff(mesh.points[whole], axis=1)[:, 0], axis=1).sum()
    )


def pixels(picture) -> np.ndarray:
    import io

    return matplotlib.image.imread(io.BytesIO(picture._repr_png_()))[:, :, :3]


@pytest.mark.full
def test_the_probe_the_cut_and_the_colours_change_the_picture_where_they_should(made: Made):
    size = (500, 340)
    plain = pixels(plot_solution(made, None, probe=False, fixed=(), outline=False, size=size))
    with_probe = pixels(plot_solution(made, None, fixed=(), outline=False, size=size))
    assert plain.shape == with_probe.shape == (340, 500, 3)
    changed, body = np.abs(plain - with_probe).max(axis=2) > 0.05, plain.min(axis=2) < 0.99
    assert np.mean(changed) > 1e-3
    # over the body the ball is lines only, of 3 px at most with their smoothing, so its colours can be read there
    radius = 0.010 * Camera.around(made.mesh.points, (-58.0, 28.0), size).scale
    assert 0 < np.sum(changed & body) < 3 * 2 * 2 * np.pi * radius < 0.5 * np.pi * radius**2
    brightest = np.array(palette()[-1])
    for cut in (None, "y"):
        coloured = pixels(plot_solution(made, probe=False, cut=cut, size=size))[:, :400]
        # the dent's bottom is in the scale's last colour
        assert np.mean(np.abs(coloured - brightest).max(axis=2) < 0.15) > 1e-4


@pytest.mark.full
def test_a_picture_is_saved_where_asked(made: Made, tmp_path: Path):
    picture = plot_solution(made, "von_mises", path=tmp_path / "one.png", edges=True, scale=1.5)
    assert matplotlib.image.imread(tmp_path / "one.png").shape[:2] == (680, 1000)
    assert picture.save(tmp_path / "two.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(UsageError, match="Could not write"):
        picture.save(tmp_path / "three.xyz")
    with pytest.raises(UsageError, match="no display"):
        picture.show()


@pytest.mark.parametrize(("scale", "moved", "says"), [(2.0, 1.0, True), (2.0, 0.0, False), (1.0, 1.0, False)])
def test_a_picture_says_that_it_exaggerates_where_it_does(made: Made, scale: float, moved: float, says: bool):
    solution = made.with_(displacement=moved * made.displacement)
    texts = plot_solution(solution, None, scale=scale, size=(300, 200)).figure.findobj(Text)
    assert any("displacement drawn × 2" in text.get_text() for text in texts) is says


def test_what_cannot_be_drawn_is_said(made: Made):
    with pytest.raises(UsageError, match="heat"):
        plot_solution(made, "heat")
    with pytest.raises(UsageError, match="no stresses"):
        nodal_field(made.with_(von_mises=None), "von_mises")
    with pytest.raises(UsageError, match="plane 'w'"):
        plot_solution(made, cut="w")
    for wrong in ("here", (1, 2, 3)):
        with pytest.raises(UsageError, match="no probe"):
            plot_solution(made, probe=wrong)
    with pytest.raises(UsageError, match="no deformed state"):
        plot_solution(made.with_(displacement=np.full_like(made.displacement, np.nan)))


@pytest.mark.full
@pytest.mark.parametrize(
    ("colour", "unit"), [("displacement", "mm"), ("von_mises", "kPa"), ("largest_strain", "%")]
)
def test_scales_read_in_multiples_of_units(made: Made, colour: str, unit: str):
    body, bar = plot_solution(made, colour).figure.axes
    labels = [label.get_text() for label in bar.get_yticklabels()]
    assert all(label.endswith((unit, "0 m", "0 Pa")) for label in labels), labels
    length = body.texts[0].get_text()
    number, of = length.split()
    assert of == "mm"
    assert number in {"10", "20", "50"}


def test_importing_pictures_is_light():
    probe = "import palpate.physics, sys; print([m for m in ('matplotlib', 'vtk') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_lines_end_at_the_plane():
    segments = np.array([[[0.0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[2, 0, 0], [0.5, 0, 0]]])
    points, ends = segments.reshape(-1, 3), np.arange(6).reshape(-1, 2)
    heights = points[:, 0] - 0.75  # the plane x = 0.75
    assert cut_lines(points, heights, ends) == pytest.approx(
        np.array([[[0, 0, 0], [0.75, 0, 0]], [[0, 0, 0], [0, 1, 0]], [[0.75, 0, 0], [0.5, 0, 0]]])
    )
    assert len(cut_lines(points, heights + 5, ends)) == 0
    strokes = hatching(segments[:1], 0.25, np.array([0.0, 0.0, 0.1]))
    assert strokes[:, 0, 0].tolist() == [0.125, 0.375, 0.625, 0.875]
