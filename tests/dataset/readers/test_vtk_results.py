"""Files of the VTK family: written by PyVista and meshio, read back, and damaged."""

from __future__ import annotations

import importlib.util

import meshio
import numpy as np
import pytest

from palpate.dataset.readers import read_results
from palpate.errors import FileFormatError, UsageError

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
TETRAHEDRA = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])


def write(path, time=1.0, points=POINTS, coding="binary", **further):
    grid = meshio.Mesh(
        points,
        [("tetra", TETRAHEDRA)],
        point_data={"displacement": time * POINTS, "p": time * POINTS[:, 0], **further},
        cell_data={"stress": [time * np.arange(12.0).reshape(2, 6)]},
    )
    meshio.vtu.write(path, grid, binary=coding != "ascii", compression="zlib" if coding == "zlib" else None)
    return path


def series(folder, times, change=lambda step: {}):
    rows = []
    for step, time in enumerate(times):
        write(folder / f"step-{step}.vtu", time, **change(step))
        rows.append(f'<DataSet timestep="{time}" part="0" file="step-{step}.vtu"/>')
    path = folder / "series.pvd"
    path.write_text(
        f'<?xml version="1.0"?><VTKFile type="Collection"><Collection>{"".join(rows)}</Collection></VTKFile>'
    )
    return path


@pytest.fixture(params=["PyVista", "meshio"])
def reader(request, monkeypatch):
    """The package that reads; without the first the second does."""
    if request.param == "PyVista":
        pytest.importorskip("pyvista")
    else:
        known = importlib.util.find_spec
        monkeypatch.setattr(importlib.util, "find_spec", lambda n: None if n == "pyvista" else known(n))
    return request.param


@pytest.mark.grid
@pytest.mark.usefixtures("reader")
@pytest.mark.parametrize("coding", ["ascii", "binary", "zlib"])
def test_a_grid_is_read_with_its_surface_and_components(tmp_path, coding):
    results = read_results(write(tmp_path / "one.vtu", coding=coding))
    places = results.places["nodes"]
    np.testing.assert_allclose(places.points(), POINTS)
    assert len(places.triangles) == 6
    a, b, c = places.points()[places.triangles].transpose(1, 0, 2)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(1 / 6 + 1 / 3)
    np.testing.assert_allclose(results.columns["displacement.z"].values, [POINTS[:, 2]])
    np.testing.assert_allclose(results.columns["stress.yz"].values, [[4.0, 10.0]])
    assert results.columns["stress.yz"].places == "cells"


@pytest.mark.usefixtures("reader")
def test_a_series_has_a_case_for_each_time_in_order(tmp_path):
    results = read_results(series(tmp_path, [2.0, 0.5, 1.0]))
    np.testing.assert_allclose(results.columns["time"].values, [0.5, 1.0, 2.0])
    np.testing.assert_allclose(results.columns["p"].values, np.outer([0.5, 1.0, 2.0], POINTS[:, 0]))


@pytest.mark.parametrize("compressor", ["lz4", "lzma", "zlib", None])
def test_pyvista_reads_every_compression(tmp_path, compressor):
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: TETRAHEDRA}, POINTS)
    grid.point_data["u"] = 2 * POINTS
    grid.field_data["reaction"] = [5.0]
    grid.save(tmp_path / "one.vtu", compression=compressor)
    results = read_results(tmp_path / "one.vtu")
    np.testing.assert_allclose(results.columns["u.y"].values, [2 * POINTS[:, 1]])
    np.testing.assert_allclose(results.columns["reaction"].values, [5.0])


def test_legacy_files_and_surfaces_are_read(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    ball = pyvista.Sphere(theta_resolution=8, phi_resolution=8)
    ball.point_data["height"] = ball.points[:, 2]
    for name in ("ball.vtk", "ball.vtp"):
        ball.save(tmp_path / name)
        results = read_results(tmp_path / name)
        assert len(results.places["nodes"].triangles) == ball.n_cells
        np.testing.assert_allclose(results.columns["height"].values, [ball.points[:, 2]], atol=1e-7)


def test_without_pyvista_other_files_name_the_package(tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    (tmp_path / "old.vtk").write_text("# vtk DataFile Version 5.1\n")
    with pytest.raises(UsageError, match=r"palpate\[results\]"):
        read_results(tmp_path / "old.vtk")


@pytest.mark.usefixtures("reader")
@pytest.mark.parametrize("share", [0.05, 0.3, 0.6, 0.9])
def test_a_grid_that_is_cut_short_is_refused(tmp_path, share):
    content = write(tmp_path / "whole.vtu").read_bytes()
    (tmp_path / "cut.vtu").write_bytes(content[: int(share * len(content))])
    with pytest.raises(FileFormatError, match=r"cut\.vtu"):
        read_results(tmp_path / "cut.vtu")


def test_nodes_that_move_are_refused(tmp_path):
    path = series(tmp_path, [0.0, 1.0], lambda step: {"points": POINTS * (1 + 0.1 * step)})
    with pytest.raises(FileFormatError, match=r"step-1\.vtu: its nodes are elsewhere"):
        read_results(path)


def test_a_body_that_was_meshed_anew_is_refused(tmp_path):
    path = series(tmp_path, [0.0, 1.0])
    grid = meshio.Mesh(POINTS[:4], [("tetra", TETRAHEDRA[:1])], point_data={"p": np.zeros(4)})
    meshio.vtu.write(tmp_path / "step-1.vtu", grid)
    with pytest.raises(FileFormatError, match="4 nodes and 1 cells, the first step 5 and 2"):
        read_results(path)


def test_arrays_that_not_every_step_has_are_skipped_and_named(tmp_path):
    path = series(
        tmp_path, [0.0, 1.0], lambda step: {"q": POINTS[:, 0]} if step == 0 else {"r": POINTS[:, 0]}
    )
    results = read_results(path)
    assert "q" not in results.columns
    assert any(note.startswith("Skipped q") for note in results.notes)
    assert any(note.startswith("Skipped r") for note in results.notes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<VTKFile><Collection></Collection></VTKFile>", "names no files"),
        (
            "<VTKFile><Collection><DataSet timestep='x' file='a.vtu'/></Collection></VTKFile>",
            "'x' is no number",
        ),
        (
            "<VTKFile><Collection><DataSet timestep='0' file='a.vtu'/></Collection></VTKFile>",
            "a.vtu: there is no",
        ),
        ("<VTKFile>\n<Collection>", "line 2: the series can't be read"),
    ],
)
def test_a_damaged_series_is_refused(tmp_path, text, message):
    (tmp_path / "series.pvd").write_text(text)
    with pytest.raises(FileFormatError, match=message):
        read_results(tmp_path / "series.pvd")
