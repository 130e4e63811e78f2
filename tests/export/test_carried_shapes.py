"""Pictures of a body whose own surface is finer than its elements: VTU and glTF show that surface."""

from __future__ import annotations

from dataclasses import replace

import meshio
import numpy as np

from palpate.dataset import Dataset, Layout, assemble, solid_fields
from palpate.dataset.carried_surface import quadratic_triangles
from palpate.export.shape_files import series_of_dataset, write_shapes
from palpate.units import Range

SIZE = 0.04  # m, of a cube


def cube(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of the surface of a cube, its sides cut into so many parts, m."""
    t = np.linspace(0.0, 1.0, cells + 1)
    a, b = (x.ravel() for x in np.meshgrid(t, t, indexing="ij"))
    k = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    two = np.vstack([np.stack([k, k + cells + 1, k + cells + 2], 1), np.stack([k, k + cells + 2, k + 1], 1)])
    points, triangles = [], []
    for axis in range(3):
        for end in (0.0, 1.0):
            face = np.empty((a.size, 3))
            face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = end, a, b
            triangles.append((two if end else two[:, ::-1]) + len(points) * a.size)
            points.append(face)
    unique, which = np.unique(np.vstack(points).round(9), axis=0, return_inverse=True)
    return SIZE * unique, which.reshape(-1)[np.vstack(triangles)]


def bent(x: np.ndarray) -> np.ndarray:
    """A displacement of second order, m."""
    s = x / SIZE
    return 1e-3 * np.stack([s[..., 0] * s[..., 2], s[..., 1] ** 2, s[..., 0] ** 2 - s[..., 2]], axis=-1)


def solves() -> Dataset:
    """Two solves on coarse elements, the second of twice the displacement, with a finer surface to draw."""
    points, triangles = cube(2)
    edges, _ = quadratic_triangles(triangles, len(points))
    ranges = (Range("c_x", 0.0, 1.0, "m"), Range("c_y", 0.0, 1.0, "m"), Range("c_z", 0.0, 1.0, "m"))
    factors = np.array([1.0, 2.0])
    rows = len(factors)
    schema = solid_fields(len(points), ranges, stress=True, edges=len(edges))
    answers = {field.name: field.empty(rows) for field in schema}
    answers |= {
        "displacement": factors[:, None, None] * bent(points),
        "mid_displacement": factors[:, None, None] * bent(points[edges].mean(axis=1)),
        "von_mises": factors[:, None] * points[:, 0],
        "converged": np.ones(rows, bool),
        "iterations": np.ones(rows, int),
        "residual": np.zeros(rows),
        "message": np.array(["converged"] * rows),
        "solve_seconds": np.ones(rows),
    }
    layout = Layout(points, triangles=triangles, surfaces=("side",), drawn=cube(7))
    layout = replace(layout, surface_of=np.zeros(len(triangles), int))
    return assemble(ranges, layout, np.full((rows, 3), 0.5), answers, {"problem": {}}, schema=schema)


def test_a_dataset_is_shown_on_its_own_surface(tmp_path):
    data, (points, triangles) = solves(), cube(7)
    series = series_of_dataset(data)
    np.testing.assert_array_equal(series.points, points)
    np.testing.assert_array_equal(series.cells, triangles)
    np.testing.assert_allclose(series.displacement, np.stack([bent(points), 2 * bent(points)]), atol=1e-15)
    np.testing.assert_allclose(series.fields["von Mises stress"][0], points[:, 0], atol=1e-15)
    written = meshio.read(write_shapes(series, tmp_path / "cube.vtu"))
    np.testing.assert_allclose(written.point_data["displacement"], 2 * bent(points), atol=1e-15)
    assert len(written.cells_dict["triangle"]) == len(triangles)


def test_the_own_surface_outlives_a_store_and_the_joining_of_datasets(tmp_path):
    data = solves()
    file = data.save(tmp_path / "cube.zarr")
    both = Dataset.concat([Dataset.open(file), data])
    np.testing.assert_array_equal(both["drawn_points"], data["drawn_points"])
    assert series_of_dataset(both).displacement.shape == (4, len(data["drawn_points"]), 3)
    assert data.hash == Dataset.open(file).hash
