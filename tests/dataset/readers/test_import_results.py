"""Results of other solvers made into datasets: mapping, units, energies, and what is refused."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import palpate as pp
from palpate.dataset.readers import read_mapping
from palpate.errors import FileFormatError, UsageError

LENGTH, STIFFNESS = 0.1, 2.0  # m; EI in N m²
LOADS = np.linspace(0.0, 5.0, 6)
PLACES = np.linspace(0.0, LENGTH, 5)


def deflection(load, x):
    """Deflection of a slender linear cantilever under a force at its tip, m."""
    return load * x**2 * (3 * LENGTH - x) / (6 * STIFFNESS)


def comsol_sheet(path, loads=LOADS, places=PLACES):
    """A spreadsheet of a bent line in mm and µm, one solution in each pair of columns."""
    names = "   ".join(f"u (um) @ F={load:g}   v (um) @ F={load:g}" for load in loads)
    rows = [
        "   ".join(
            [f"{float(1e3 * x)!r}", "0", *(f"0   {float(-1e6 * deflection(load, x))!r}" for load in loads)],
        )
        for x in places
    ]
    head = [f"% Dimension: 2\n% Nodes: {len(places)}\n% Expressions: 2\n% Length unit: mm\n% X   Y   {names}"]
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path


MAPPING = tomllib.loads(
    """
name = "line"
coordinates = ["X", "Y"]

[[inputs]]
name = "tip load"
from = "F"
unit = "N"
load = { at = ["100 mm", 0], direction = [0, -2] }

[[outputs]]
name = "displacement"
from = ["u", "v"]
"""
)


def changed(**keys):
    return {**MAPPING, **keys}


def test_a_line_with_loads_has_its_places_its_units_and_its_energies(tmp_path):
    data = pp.import_results(comsol_sheet(tmp_path / "line.txt"), MAPPING).dataset
    np.testing.assert_allclose(data.X[:, 0], LOADS)
    np.testing.assert_allclose(data.rest[:, 0], PLACES)
    np.testing.assert_allclose(data.displacement[:, :, 1], -deflection(LOADS[:, None], PLACES), rtol=1e-12)
    np.testing.assert_array_equal(data.load_nodes, [4])
    np.testing.assert_array_equal(data.load_directions, [[0, -1]])
    # linear: the body stores half of the work, and the potential energy is minus that
    work = LOADS * deflection(LOADS, LENGTH)
    np.testing.assert_allclose(data.strain_energy, work / 2, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(data.potential_energy, -work / 2, rtol=1e-9, atol=1e-15)
    assert [(r.name, r.unit) for r in data.ranges] == [("tip load", "N")]


def test_a_dataset_is_stored_like_any_other(tmp_path):
    imported = pp.import_results(comsol_sheet(tmp_path / "line.txt"), MAPPING)
    again = pp.Dataset.open(imported.dataset.save(tmp_path / "line.zarr"))
    assert again.hash == imported.dataset.hash
    origin = again.provenance["imported"]
    assert origin["files"][0]["name"] == "line.txt"
    assert origin["mapping"]["inputs"][0]["from"] == "F"
    assert "6 solves of line" in str(again)


def test_files_with_further_cases_are_joined_and_numbered_by_their_names(tmp_path):
    whole = pp.import_results(comsol_sheet(tmp_path / "line.txt"), MAPPING).dataset
    files = []
    for load in LOADS:
        sheet = comsol_sheet(tmp_path / f"bend-{load:g}N.txt", [load])
        sheet.write_text(sheet.read_text().replace(f" @ F={load:g}", ""))
        files.append(sheet)
    mapping = changed(file_pattern=r"-(?P<F>[0-9.]+)N\.txt")
    data = pp.import_results(files, mapping).dataset
    np.testing.assert_allclose(data.X, whole.X)
    np.testing.assert_allclose(data.displacement, whole.displacement)


def test_files_with_further_columns_are_joined(tmp_path):
    table = "\n".join(f"{float(load)!r},{float(500 * load * deflection(load, LENGTH))!r}" for load in LOADS)
    (tmp_path / "energy.csv").write_text(f"% Table,Table 1\n% P (N),W (mJ)\n{table}\n")
    mapping = changed(join="columns", outputs=[*MAPPING["outputs"], {"name": "strain_energy", "from": "W"}])
    imported = pp.import_results([comsol_sheet(tmp_path / "line.txt"), tmp_path / "energy.csv"], mapping)
    work = LOADS * deflection(LOADS, LENGTH)
    np.testing.assert_allclose(imported.dataset.potential_energy, -work / 2, rtol=1e-9, atol=1e-15)
    assert not any("Warning" in note for note in imported.notes)
    mapping["outputs"][1]["times"] = 1.1
    imported = pp.import_results([comsol_sheet(tmp_path / "line.txt"), tmp_path / "energy.csv"], mapping)
    assert any("differs by" in note for note in imported.notes)


def arrays(tmp_path, **further):
    np.savez(
        tmp_path / "a.npz",
        **{
            "P [mN]": 1e3 * LOADS,
            "u [mm]": np.stack([np.zeros((6, 5)), -1e3 * deflection(LOADS[:, None], PLACES)], axis=2),
            "points": 1e3 * np.stack([PLACES, np.zeros(5)], axis=1),
        }
        | further,
    )
    return tmp_path / "a.npz"


ARRAYS = {
    "units": {"length": "mm"},
    "inputs": [{"name": "P", "load": {"at": 4, "direction": [0, -1]}}],
    "outputs": [{"name": "displacement", "from": "u"}],
}


def test_arrays_give_the_same_dataset(tmp_path):
    data = pp.import_results(arrays(tmp_path), ARRAYS).dataset
    other = pp.import_results(comsol_sheet(tmp_path / "line.txt"), MAPPING).dataset
    for name in ("inputs", "displacement", "potential_energy", "rest"):
        np.testing.assert_allclose(data[name], other[name], rtol=1e-9, atol=1e-15)


def test_cases_without_numbers_are_marked_and_nodes_without_are_left_out(tmp_path):
    u = np.stack([np.zeros((6, 5)), -1e3 * deflection(LOADS[:, None], PLACES)], axis=2)
    u[:, 1] = np.nan
    u[2] = np.nan
    P = 1e3 * LOADS
    P[5] = np.nan
    imported = pp.import_results(arrays(tmp_path, **{"u [mm]": u, "P [mN]": P}), ARRAYS)
    data = imported.dataset
    assert len(data) == 5
    np.testing.assert_array_equal(data.converged, [True, True, False, True, True])
    assert len(data.rest) == 4
    assert len(data.ok) == 4
    text = " ".join(imported.notes)
    assert "Skipped 1 case whose inputs" in text
    assert "Skipped 1 node without displacement" in text
    assert "1 case without finite answers" in text


def test_nodes_are_chosen_and_sorted(tmp_path):
    points = 1e3 * np.stack([PLACES[::-1], np.array([0, 0, 0, 0, 0.01])], axis=1)
    mapping = {
        **ARRAYS,
        "nodes": {"near": {"y": "0 mm"}, "sort": "x"},
        "inputs": [{"name": "P", "load": {"at": ["100 mm", "0 mm"], "direction": [0, -1]}}],
    }
    imported = pp.import_results(arrays(tmp_path, points=points), mapping)
    np.testing.assert_allclose(imported.dataset.rest[:, 0], PLACES[1:])
    assert "4 of 5 nodes kept." in imported.notes


def test_a_quantity_reduced_over_places_and_one_at_a_place(tmp_path):
    mapping = {
        **ARRAYS,
        "inputs": [{"name": "P"}],
        "outputs": [
            {"name": "sag", "from": "u.y", "reduce": "min", "times": -1},
            {"name": "middle", "from": "u.y", "at": ["50 mm", 0]},
        ],
    }
    data = pp.import_results(arrays(tmp_path), mapping).dataset
    np.testing.assert_allclose(data["sag"], deflection(LOADS, LENGTH), atol=1e-15)
    np.testing.assert_allclose(data["middle"], -deflection(LOADS, LENGTH / 2), atol=1e-15)
    assert data.data["sag"].attrs["units"] == "m"


def test_the_von_mises_stress_of_a_tensor(tmp_path):
    stress = np.zeros((6, 5, 6))
    stress[..., 3] = 1.0  # shear alone: √3 τ
    names = ("xx", "yy", "zz", "xy", "yz", "xz")
    tensor = {f"s.{name} [MPa]": stress[..., i] for i, name in enumerate(names)}
    mapping = {
        **ARRAYS,
        "outputs": [*ARRAYS["outputs"], {"name": "von_mises", "from": "s", "invariant": "von Mises"}],
    }
    data = pp.import_results(arrays(tmp_path, **tensor), mapping).dataset
    np.testing.assert_allclose(data["von_mises"], np.sqrt(3) * 1e6)


def test_a_probe_with_forces_and_a_surface(tmp_path):
    """A dataset of positions of a probe: response, energy, surface and what acts on the body."""
    rng = np.random.default_rng(1)
    points = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]], dtype=float)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    place, force = rng.normal(size=(6, 3)), rng.normal(size=(6, 3))
    columns = {
        f"{name}{axis} [{unit}]": values[:, i]
        for name, unit, values in (("c", "mm", place), ("F", "N", force))
        for i, axis in enumerate("xyz")
    }
    np.savez(
        tmp_path / "p.npz",
        **columns,
        **{"U [mJ]": place[:, 0], "u [mm]": np.zeros((6, 4, 3)), "points": points, "triangles": triangles},
    )
    mapping = {
        "units": {"length": "mm"},
        "inputs": [{"name": f"c_{axis}", "from": f"c{axis}"} for axis in "xyz"],
        "outputs": [
            {"name": "displacement", "from": "u"},
            {"name": "response", "from": ["Fx", "Fy", "Fz"]},
            {"name": "potential_energy", "from": "U"},
        ],
        "surfaces": {"bottom": {"z": "0 mm"}},
        "interactions": [{"type": "SphereProbe", "radius": "5 mm", "touches": "surface"}],
    }
    data = pp.import_results(tmp_path / "p.npz", mapping).dataset
    np.testing.assert_allclose(data.force, force)
    np.testing.assert_allclose(data.X, 1e-3 * place)
    np.testing.assert_allclose(data.potential_energy, 1e-3 * place[:, 0])
    assert data["surface"].tolist() == ["bottom", "surface"]
    np.testing.assert_array_equal(data["surface_of"], [0, 1, 1, 1])
    assert data.provenance["problem"]["interactions"][0]["radius"] == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        pytest.param(changed(inputs=[]), "names no inputs", id="no inputs"),
        pytest.param(changed(outputs=[]), "names no outputs", id="no outputs"),
        pytest.param(changed(colour=1), "colour: there is no such key", id="unknown key"),
        pytest.param(changed(outputs=[{"name": "w"}]), "no column 'w'", id="no column"),
        pytest.param(
            changed(outputs=[{"name": "displacement", "from": "v"}]), "1 components for 2", id="components"
        ),
        pytest.param(
            changed(outputs=[{"name": "displacement", "from": ["u", "v"], "unit": "N"}]),
            "in m is needed",
            id="unit",
        ),
        pytest.param(
            changed(outputs=[{"name": "w", "from": "v", "unit": "furlong/"}]),
            "no unit that is known",
            id="bad unit",
        ),
        pytest.param(changed(inputs=[{"name": "F"}]), r"unit of 'F' is stated nowhere", id="unit missing"),
        pytest.param(changed(inputs=[{"name": "v"}]), "not one number for each case", id="input by place"),
        pytest.param(changed(coordinates=["X", "Z"]), "no coordinate 'Z'", id="coordinate"),
        pytest.param(changed(nodes={"near": {"Y": "3 mm"}}), "No node is where", id="no nodes"),
        pytest.param(changed(nodes={"sort": "q"}), "no coordinate 'q'", id="sort"),
        pytest.param(changed(file_pattern="(?P<F>[0-9]+)"), "does not fit file_pattern", id="pattern"),
        pytest.param(changed(file_pattern="l(?P<F>i)"), "no number", id="pattern's word"),
        pytest.param(changed(file_pattern="("), "no regular expression", id="pattern's syntax"),
        pytest.param(
            changed(inputs=[{"name": "F", "unit": "N", "load": {"at": [0.3, 0], "direction": [0, 1]}}]),
            "where no node is",
            id="load nowhere",
        ),
        pytest.param(
            changed(inputs=[{"name": "F", "unit": "N", "load": {"at": 77, "direction": [0, 1]}}]),
            "names node 77",
            id="no such node",
        ),
        pytest.param(
            changed(inputs=[{"name": "F", "unit": "N", "load": {"at": 5, "direction": [0, 0]}}]),
            "direction",
            id="no direction",
        ),
        pytest.param(
            changed(inputs=[{"name": "F", "unit": "mm", "load": {"at": 5, "direction": [0, 1]}}]),
            "in N is needed",
            id="load in mm",
        ),
        pytest.param(
            changed(inputs=[*MAPPING["inputs"], {"name": "tip load", "from": "F"}]),
            "two of the inputs",
            id="twice",
        ),
        pytest.param(
            changed(outputs=[*MAPPING["outputs"], {"name": "v", "from": "v", "invariant": "von Mises"}]),
            "six components",
            id="no tensor",
        ),
    ],
)
def test_a_mapping_that_does_not_fit_is_refused(tmp_path, mapping, message):
    with pytest.raises(UsageError, match=message):
        pp.import_results(comsol_sheet(tmp_path / "line.txt"), mapping)


def test_an_input_that_does_not_vary_is_refused(tmp_path):
    with pytest.raises(UsageError, match="'tip load' does not vary"):
        pp.import_results(comsol_sheet(tmp_path / "line.txt", [2.0]), MAPPING)


def test_files_of_different_meshes_are_refused(tmp_path):
    one, other = tmp_path / "a.txt", tmp_path / "b.txt"
    comsol_sheet(one), comsol_sheet(other, places=PLACES * 1.01)
    with pytest.raises(UsageError, match="another mesh"):
        pp.import_results([one, other], MAPPING)
    comsol_sheet(other, places=PLACES[:-1])
    with pytest.raises(UsageError, match="5 and 4 places"):
        pp.import_results([one, other], MAPPING)


def test_a_body_that_remembers_has_no_energy(tmp_path):
    u = np.stack([np.zeros((6, 5)), -1e3 * deflection(LOADS[:, None], PLACES)], axis=2)
    P = 1e3 * np.array([0, 1, 2, 3, 2, 1.0])
    imported = pp.import_results(arrays(tmp_path, **{"P [mN]": P, "u [mm]": u}), ARRAYS)
    assert "potential_energy" not in imported.dataset
    assert any("remembers" in note for note in imported.notes)


def test_a_mapping_is_read_from_a_file(tmp_path):
    path = tmp_path / "map.toml"
    path.write_text('name = "a"\n[[inputs]]\nname = "F"\n')
    assert read_mapping(path).inputs[0].columns == "F"
    path.write_text("name = ")
    with pytest.raises(UsageError, match="is not valid TOML"):
        read_mapping(path)


def test_a_file_that_is_no_result_names_itself(tmp_path):
    (tmp_path / "x.frd").write_text("nothing")
    with pytest.raises(FileFormatError, match=r"x\.frd, line 1"):
        pp.read_results(tmp_path / "x.frd")


LONG = {
    "coordinates": ["x", "y"],
    "inputs": [{"name": "P", "load": {"at": ["100 mm", 0], "direction": [0, -1]}}],
    "outputs": [{"name": "displacement", "from": ["u", "v"]}],
}


def long_table(path, rows):
    lines = [f"{1e3 * P!r},{1e3 * x!r},0,0,{-1e3 * deflection(P, x)!r}" for P, x in rows]
    path.write_text("\n".join(["P [mN],x [mm],y [mm],u [mm],v [mm]", *lines]) + "\n")
    return path


def test_a_table_with_a_row_for_each_place_of_each_case(tmp_path):
    rows = [(float(P), float(x)) for P in LOADS for x in PLACES[::-1]]
    data = pp.import_results(long_table(tmp_path / "long.csv", rows), LONG).dataset
    np.testing.assert_allclose(data.X[:, 0], LOADS)
    np.testing.assert_allclose(data.displacement[:, :, 1], -deflection(LOADS[:, None], PLACES), atol=1e-15)
    work = LOADS * deflection(LOADS, LENGTH)
    np.testing.assert_allclose(data.potential_energy, -work / 2, rtol=1e-9, atol=1e-15)
    with pytest.raises(UsageError, match="29 rows for 6 cases and 5 places"):
        pp.import_results(long_table(tmp_path / "lost.csv", rows[:-1]), LONG)
    with pytest.raises(UsageError, match="one row for each place"):
        pp.import_results(long_table(tmp_path / "twice.csv", [*rows[:-1], rows[0]]), LONG)


def test_inputs_that_do_not_vary_or_vary_together_are_refused_by_name(tmp_path):
    force = np.linspace(1.0, 5.0, 6)
    columns = {
        "force [N]": force,
        "heat [W]": 3 * force - 2,
        "width [mm]": np.full(6, 4.0),
        "sag [mm]": force**2,
    }
    path = tmp_path / "cases.npz"
    np.savez(path, **columns)
    mapping = {"outputs": [{"name": "sag"}]}
    with pytest.raises(UsageError, match="'force' and 'heat' always vary together"):
        pp.import_results(path, {**mapping, "inputs": [{"name": "force"}, {"name": "heat"}]})
    with pytest.raises(UsageError, match="'width' does not vary"):
        pp.import_results(path, {**mapping, "inputs": [{"name": "force"}, {"name": "width"}]})
