"""Exodus, EnSight, OpenFOAM and XDMF: small files as their makers publish the formats, read through VTK."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from dataset.readers.mesh_results import (
    POINTS,
    TIMES,
    displacement,
    temperature,
    write_ensight,
    write_exodus,
    write_foam,
    write_xdmf,
)
from palpate.errors import FileFormatError
from system_programs import require_package

FILES = {"bricks.exo": write_exodus, "bricks.case": write_ensight, "bricks.xdmf": write_xdmf}


@pytest.fixture(scope="module", autouse=True)
def pyvista():
    return require_package("pyvista", "results")


@pytest.mark.parametrize("name", FILES)
def test_nodes_times_and_fields_are_those_of_the_file(name, tmp_path):
    results = pp.read_results(FILES[name](tmp_path / name))
    assert results.cases == 2
    np.testing.assert_allclose(results.columns["time"].values, TIMES)
    np.testing.assert_allclose(results.places["nodes"].points(), POINTS)
    assert len(results.places["nodes"].triangles) == 2 * 10  # ten outer quadrilaterals
    wanted = np.stack([temperature(time) for time in TIMES])
    np.testing.assert_allclose(results.columns["T"].values, wanted, rtol=1e-5)
    moves = np.stack([displacement(time) for time in TIMES])
    names = [key for key in results.columns if key.startswith(("u.", "u_"))]
    assert len(names) == 3
    for i, key in enumerate(sorted(names)):
        np.testing.assert_allclose(results.columns[key].values, moves[:, :, i], rtol=1e-5, atol=1e-12)


def test_xdmf_with_its_numbers_in_hdf5_beside_it(tmp_path, monkeypatch):
    pytest.importorskip("h5py")  # which writes it, and is no dependency
    monkeypatch.chdir(tmp_path)
    results = pp.read_results(write_xdmf(tmp_path / "bricks.xdmf", "HDF"))
    assert (tmp_path / "bricks.h5").is_file()
    np.testing.assert_allclose(results.columns["T"].values, np.stack([temperature(time) for time in TIMES]))


def test_openfoam_gives_its_cells_and_their_means_at_nodes(tmp_path):
    results = pp.read_results(write_foam(tmp_path / "bricks.foam"))
    assert results.cases == 2
    points = results.places["nodes"].points()
    np.testing.assert_allclose(points[np.lexsort(points.T)], POINTS[np.lexsort(POINTS.T)])
    for row, time in enumerate(TIMES):
        left, right = 300 + 5 * time, 300 + 15 * time
        at = {0.0: left, 1.0: (left + right) / 2, 2.0: right}
        np.testing.assert_allclose(results.columns["T"].values[row], [at[x] for x in points[:, 0]])


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_cut_short_is_refused(name, tmp_path):
    path = FILES[name](tmp_path / name)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    with pytest.raises(FileFormatError):
        pp.read_results(path)


def test_a_case_without_one_of_its_files_is_refused(tmp_path):
    path = write_ensight(tmp_path / "bricks.case")
    (tmp_path / "bricks.0001.T").unlink()
    with pytest.raises(FileFormatError):
        pp.read_results(path)
