"""Datasets of solids, schemas and layouts of one's own, and stores of earlier versions."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from palpate.dataset import Dataset, Field, Layout, assemble, beam_fields, solid_fields, with_bookkeeping
from palpate.dataset.store import CHUNK_BYTES
from palpate.errors import UsageError
from palpate.units import Range

POSITIONS = tuple(Range(name, 0.0, 0.1, "m") for name in ("c_x", "c_y", "c_z"))
REST = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def layout(rest=REST, **others):
    return Layout(rest, triangles=TRIANGLES, surfaces=("side", "top"), surface_of=[0, 0, 0, 1], **others)


def make(count=6, rest=REST, ranges=POSITIONS, seed=0):
    rng = np.random.default_rng(seed)
    schema = solid_fields(len(rest), ranges)
    answers = {field.name: rng.random((count, *field.shape)) for field in schema}
    said = {"converged": True, "iterations": 3, "residual": 0.0, "message": "", "solve_seconds": 1.0}
    answers |= {name: np.full(count, value) for name, value in said.items()}
    origin = {"problem": {"body": {"type": "Body"}}}
    return assemble(ranges, layout(rest), rng.random((count, len(ranges))), answers, origin, schema=schema)


def test_a_solid_comes_back_from_its_store(tmp_path):
    data = make()
    data.save(tmp_path / "a.zarr")
    there = Dataset.open(tmp_path / "a.zarr")
    assert there.hash == data.hash
    assert there.data.identical(data.data)
    assert there.displacement.shape == (6, 5, 3)
    assert there.force.shape == (6, 3)
    assert there.force_gradient.shape == (6, 3, 3)
    np.testing.assert_array_equal(there.triangles, TRIANGLES)
    np.testing.assert_array_equal(there["surface_of"], [0, 0, 0, 1])
    assert list(there["surface"]) == ["side", "top"]
    # the node inside is no part of the surface
    np.testing.assert_array_equal(there.nodes_of_interest, [0, 1, 2, 3])


def test_units_and_names_stand_with_the_numbers():
    data = make().data
    assert data["response"].attrs["units"] == "N, N, N"
    assert data["response_gradient"].attrs["units"] == "N/m"
    assert data["displacement"].attrs["units"] == "m"
    assert list(data["component"].values) == ["u_x", "u_y", "u_z"]
    assert list(data["axis"].values) == ["x", "y", "z"]
    stiff = data["response_gradient"].sel(input="c_z", along="c_x")
    np.testing.assert_array_equal(stiff, data["response_gradient"].values[:, 2, 0])


def test_the_response_to_forces_is_no_force():
    loads = (Range("P", 0.0, 1.0, "N"), Range("T", 0.0, 1.0, "Pa"))
    data = make(ranges=loads)
    assert data.data["response"].attrs["units"] == "m, m³"
    assert "per unit" in data.data["response_gradient"].attrs["units"]
    assert data.response.shape == (6, 2)
    for name in ("force", "force_gradient"):
        with pytest.raises(UsageError, match="no force"):
            getattr(data, name)


def test_what_a_body_does_not_answer_is_named():
    with pytest.raises(UsageError, match="no 'root_reaction'") as caught:
        _ = make().root_reaction
    assert "response_gradient" in caught.value.why


@pytest.mark.parametrize("name", ["load_nodes", "load_directions"])
def test_positions_are_no_loads(name):
    with pytest.raises(UsageError, match="no loads at nodes") as caught:
        getattr(make(), name)
    assert "c_x, c_y, c_z" in caught.value.why


def test_a_solid_in_words():
    text = str(make())
    assert "6 solves of Body" in text
    assert "5 nodes (4 of interest)" in text
    assert "response gradient" in text
    assert "largest strain" in text
    assert "root" not in text


def test_rows_keep_their_body():
    data = make()
    train, test = data.split(0.5)
    for part in (data.take([1, 2]), train, test, Dataset.concat([train, test])):
        np.testing.assert_array_equal(part.triangles, TRIANGLES)
        np.testing.assert_array_equal(part.rest, REST)
    assert len(Dataset.concat([train, test])) == 6


def test_two_meshes_are_not_joined():
    with pytest.raises(UsageError, match="different meshes"):
        Dataset.concat([make(), make(rest=REST * 1.001)])


@pytest.mark.full
def test_large_fields_are_stored_by_whole_samples(tmp_path):
    import zarr

    nodes = 20_000
    data = make(20, rest=np.random.default_rng(0).random((nodes, 3)))
    data.save(tmp_path / "a.zarr")
    chunks = zarr.open_group(tmp_path / "a.zarr", mode="r")["displacement"].chunks
    assert chunks[1:] == (nodes, 3)
    assert 1 <= chunks[0] <= CHUNK_BYTES / (nodes * 24)
    assert Dataset.open(tmp_path / "a.zarr").hash == data.hash
    # a part of what was read is stored as well
    few = Dataset.open(tmp_path / "a.zarr").take([3, 7])
    few.save(tmp_path / "b.zarr")
    assert Dataset.open(tmp_path / "b.zarr").hash == few.hash


@pytest.fixture
def version_1(tmp_path):
    """A sweep of a cantilever of 1 m under P at its tip and Q at its middle, stored in format version 1."""
    with zipfile.ZipFile(Path(__file__).parent / "stores" / "beam-version-1.zip") as archive:
        archive.extractall(tmp_path / "beam.zarr")
    return Dataset.open(tmp_path / "beam.zarr")


@pytest.mark.full
def test_stores_of_version_1_open(version_1, tmp_path):
    data = version_1
    assert data.data.attrs["format_version"] == 1
    assert [r.name for r in data.ranges] == ["P", "Q"]
    np.testing.assert_array_equal(data.converged, [True] * 4 + [False])
    good = data.ok
    # the clamp holds the loads: P down at the tip, Q along the beam
    np.testing.assert_allclose(good.root_reaction[:, :2], good.X[:, [1, 0]] * (-1, 1), atol=1e-8)
    np.testing.assert_array_equal(good.load_nodes, [4, 2])
    assert "fibre strain" in str(good)
    good.save(tmp_path / "again.zarr")
    assert Dataset.open(tmp_path / "again.zarr").hash == good.hash
    with pytest.raises(UsageError, match="no force"):
        _ = good.force


def test_rows_of_both_versions_are_joined(version_1):
    old = version_1.ok
    schema = beam_fields(len(old.rest))
    names = [field.name for field in with_bookkeeping(schema)]
    plan = Layout(old.rest, old["of_interest"], old.load_nodes, old.load_directions)
    new = assemble(old.ranges, plan, old.X, {n: old[n] for n in names}, old.provenance)
    assert new.data.attrs["format_version"] > 1
    ends = {"sample", "input_low", "input_high"}  # given as integers here, as floats there
    assert new.fingerprint(exclude=ends) == old.fingerprint(exclude=ends)
    assert len(Dataset.concat([old, new])) == len(Dataset.concat([new, old])) == 8


@pytest.mark.parametrize(
    "schema",
    [
        (Field("energy"), Field("energy")),
        (Field("converged"),),
        (Field("inputs"),),
        (Field("rest"),),
    ],
)
def test_names_are_given_once(schema):
    with pytest.raises(UsageError, match="more than one"):
        with_bookkeeping(schema)


def test_each_dimension_has_a_size():
    with pytest.raises(UsageError):
        Field("stress", ("node",), ())


@pytest.mark.parametrize(
    "arguments",
    [
        {"rest": np.zeros((3, 4))},
        {"rest": np.zeros(3)},
        {"rest": REST, "of_interest": [True]},
        {"rest": REST, "triangles": [[0, 1, 5]]},
        {"rest": REST, "triangles": [[0, 1]]},
        {"rest": REST, "triangles": TRIANGLES, "surface_of": [0]},
        {"rest": REST, "triangles": TRIANGLES, "surface_of": [0, 0, 0, 0]},
        {"rest": REST, "surface_of": [0]},
        {"rest": REST, "load_nodes": (1,)},
        {"rest": REST, "axes": ("x", "y")},
    ],
)
def test_layouts_that_do_not_fit(arguments):
    with pytest.raises(UsageError, match="don't fit"):
        Layout(**arguments)


def test_a_missing_answer_is_named():
    data = make()
    answers = {str(name): data[str(name)] for name in data.data.data_vars if name != "strain_energy"}
    schema = solid_fields(5, POSITIONS)
    with pytest.raises(UsageError, match="'strain_energy'"):
        assemble(POSITIONS, layout(), data.X, answers, {}, schema=schema)
