"""Import of fields at nodes and in cells and of curves along time: the values and places that the files have."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

import palpate as pp
from answering import LENGTH, TAU, answers, plate_mesh
from palpate.errors import UsageError
from palpate.learning.dataset_answers import DatasetAnswers

CASES = [(1e5, 10.0), (2e5, 30.0), (5e5, 20.0), (3e5, 40.0)]
MAPPING = {
    "name": "rod",
    "join": "cases",
    "file_pattern": r"q(?P<heat>[0-9.]+)-k(?P<conductivity>[0-9.]+)\.vtu",
    "units": {
        "length": "mm",
        "heat": "W/m³",
        "conductivity": "W/(m K)",
        "T": "°C",
        "Tc": "°C",
    },
    "inputs": [{"name": "heat"}, {"name": "conductivity"}],
    "outputs": [
        {"name": "temperature", "from": "T"},
        {"name": "flux", "unit": "W/m²"},
        {"name": "in_cells", "from": "Tc"},
        {"name": "largest", "from": "T", "reduce": "max"},
    ],
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A VTU file of each case, its mesh in mm and its temperatures in °C."""
    folder = tmp_path_factory.mktemp("rod")
    points, triangles = plate_mesh()
    truth, paths = answers(np.array(CASES)), []
    for i, (heat, conductivity) in enumerate(CASES):
        mesh = meshio.Mesh(
            np.hstack([1e3 * points, np.zeros((len(points), 1))]),
            [("triangle", triangles)],
            point_data={"T": truth["temperature"][i], "flux": truth["flux"][i]},
            cell_data={"Tc": [truth["in_cells"][i]]},
        )
        paths.append(folder / f"q{heat:.0f}-k{conductivity:g}.vtu")
        mesh.write(paths[-1])
    return paths


def test_nodes_cells_and_numbers_come_in_with_their_places(files, tmp_path):
    pytest.importorskip("pyvista")
    data = pp.import_results(files, MAPPING).dataset
    again = pp.Dataset.open(data.save(tmp_path / "rod.zarr"))
    found = DatasetAnswers.of(again)
    truth = answers(np.array(CASES))
    points, triangles = plate_mesh()
    np.testing.assert_allclose(found.X, CASES)
    np.testing.assert_allclose(found.fields["temperature"].values[..., 0], truth["temperature"] + 273.15)
    np.testing.assert_allclose(found.fields["flux"].values, truth["flux"], atol=1e-9)
    np.testing.assert_allclose(found.fields["in_cells"].values[..., 0], truth["in_cells"] + 273.15)
    np.testing.assert_allclose(
        found.numbers["largest"].values[:, 0], truth["temperature"].max(axis=1) + 273.15
    )
    mesh, cells = found.fields["temperature"].places, found.fields["in_cells"].places
    np.testing.assert_allclose(mesh.points[:, :2], points, atol=1e-12)
    np.testing.assert_allclose(cells.centres[:, :2], points[triangles].mean(axis=1), atol=1e-12)
    for triangle, cell in zip(cells.triangles, cells.cell_of, strict=True):
        assert set(triangle) == set(triangles[cell])


def test_rows_of_equal_inputs_are_a_curve(tmp_path):
    times = np.array([0.0, 0.5, 1.0, 2.0])
    rows = ["heat [W/m³],conductivity [W/(m K)],time [ms],T [mK]"]
    for heat, conductivity in CASES:
        size = heat * LENGTH**2 / 8.0 / conductivity
        rows += [
            f"{heat},{conductivity},{1e3 * t},{1e3 * size * (1.0 - np.exp(-t / TAU)):.17g}"
            for t in times[::-1]
        ]
    file = tmp_path / "rod.csv"
    file.write_text("\n".join([*rows, ""]), encoding="utf-8")
    mapping = {
        "inputs": [{"name": "heat"}, {"name": "conductivity"}],
        "outputs": [{"name": "rise", "from": "T"}],
        "axis": "time",
    }
    found = DatasetAnswers.of(pp.import_results(file, mapping).dataset)
    curve = found.fields["rise"]
    assert (curve.places.name, curve.places.unit, curve.unit) == ("time", "s", "K")
    np.testing.assert_allclose(curve.places.values, times)
    X = np.array(CASES)
    wanted = (X[:, :1] * LENGTH**2 / 8.0 / X[:, 1:]) * (1.0 - np.exp(-times / TAU))
    np.testing.assert_allclose(curve.values[..., 0], wanted, atol=1e-12)
    file.write_text("\n".join([*rows[:-1], ""]), encoding="utf-8")
    with pytest.raises(UsageError, match="Case 4 has other points of 'time'"):
        pp.import_results(file, mapping)
