"""Datasets and shapes read back by pandas, PyArrow, xarray, meshio and trimesh; and the model card."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
import struct
import sys
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import trimesh
import xarray as xr

import palpate
from bent import body as bent_body
from exported_bodies import body as held_body
from palpate.cli.drawn_stroke import reservations_about, stroke_of
from palpate.dataset.dataset_tables import write_fields_csv, write_table
from palpate.errors import UsageError
from palpate.export.gltf import ShapeSeries, write_glb
from palpate.export.shape_files import series_of_dataset, series_of_surrogate, write_shapes
from palpate.learning import Fitted
from palpate.network import TrainedRegion
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.surrogates.model_card import NOT_STATED, card_of
from solved import solved

sys.path.append(str(Path(__file__).parents[1] / "surrogates"))
from field_made import field
from touch_made import ball, touch_energy


@pytest.fixture(scope="module")
def block():
    return solved("block").take(range(6))


def test_a_csv_file_gives_the_numbers_back(block, tmp_path):
    table = pd.read_csv(write_table(block, tmp_path / "block.csv"))
    assert len(table) == len(block)
    names = [f"{r.name} [{r.unit}]" for r in block.ranges]
    np.testing.assert_array_equal(table[names].to_numpy(), block.X)
    np.testing.assert_array_equal(table["potential_energy [J]"], block.potential_energy)
    forces = table[[f"response_{k} [N]" for k in (1, 2, 3)]]
    np.testing.assert_array_equal(forces.to_numpy(), block.response)
    np.testing.assert_array_equal(table["response_gradient_13 [N/m]"], block.response_gradient[:, 0, 2])
    assert set(table["converged"]) <= {0, 1}


def test_fields_go_into_a_table_of_nodes(block, tmp_path):
    table = pd.read_csv(write_fields_csv(block, tmp_path / "block-fields.csv"))
    nodes = len(block.rest)
    assert len(table) == nodes * int(block.converged.sum())
    second = table[table["sample"] == int(np.flatnonzero(block.converged)[1])]
    np.testing.assert_array_equal(second[["x [m]", "y [m]", "z [m]"]].to_numpy(), block.rest)
    moved = second[[f"displacement_{k} [m]" for k in (1, 2, 3)]].to_numpy()
    np.testing.assert_array_equal(moved, block.displacement[np.flatnonzero(block.converged)[1]])


def test_a_parquet_file_has_units_and_provenance(block, tmp_path):
    table = pq.read_table(write_table(block, tmp_path / "block.parquet"))
    name = block.ranges[0].name
    assert table.schema.field(name).metadata[b"unit"] == b"m"
    np.testing.assert_array_equal(table[name].to_numpy(), block.X[:, 0])
    assert table.schema.metadata[b"palpate hash"].decode() == block.hash
    assert json.loads(table.schema.metadata[b"palpate provenance"]) == block.provenance
    assert pd.read_parquet(tmp_path / "block.parquet")["message"].tolist() == block.message.tolist()


def test_a_netcdf_file_holds_everything(block, tmp_path):
    with xr.open_dataset(write_table(block, tmp_path / "block.nc"), engine="scipy") as read:
        np.testing.assert_array_equal(read["displacement"], block.displacement)
        np.testing.assert_array_equal(read["response_gradient"], block.response_gradient)
        np.testing.assert_array_equal(read["rest"], block.rest)
        assert read["potential_energy"].attrs["units"] == "J"
        assert read.attrs["palpate_hash"] == block.hash
        assert [str(w) for w in read["input"].values] == [r.name for r in block.ranges]


def test_a_series_for_paraview_is_read_by_meshio(block, tmp_path):
    series = series_of_dataset(block, [0, 2, 3])
    path = write_shapes(series, tmp_path / "block.pvd")
    entries = ElementTree.parse(path).getroot().findall("Collection/DataSet")
    assert [float(e.attrib["timestep"]) for e in entries] == [0, 1, 2]
    for row, entry in zip([0, 2, 3], entries, strict=True):
        grid = meshio.read(tmp_path / entry.attrib["file"])
        np.testing.assert_array_equal(grid.points, block.rest)
        np.testing.assert_array_equal(grid.cells_dict["triangle"], block.triangles)
        np.testing.assert_array_equal(grid.point_data["displacement"], block.displacement[row])


def test_a_series_replaces_its_own_states_and_nobodys_folder(block, tmp_path):
    series = series_of_dataset(block, [0])
    write_shapes(series, tmp_path / "block.pvd")
    write_shapes(series, tmp_path / "block.pvd")
    (tmp_path / "block" / "block.c").write_text("int x;")
    with pytest.raises(UsageError, match=r"holds block\.c"):
        write_shapes(series, tmp_path / "block.pvd")
    assert (tmp_path / "block" / "block.c").read_text() == "int x;"


def parts_of(path):
    """Scene and accessors of a GLB file, read by the specification."""
    raw = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", raw)
    assert (magic, version, length) == (b"glTF", 2, len(raw))
    size, kind = struct.unpack_from("<I4s", raw, 12)
    assert kind == b"JSON"
    scene = json.loads(raw[20 : 20 + size])
    binary, kind = struct.unpack_from("<I4s", raw, 20 + size)
    assert kind == b"BIN\0"
    assert size % 4 == binary % 4 == 0
    data = raw[28 + size :]
    wide = {"SCALAR": 1, "VEC3": 3}

    def array(number):
        accessor = scene["accessors"][number]
        view = scene["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        dtype = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        count = accessor["count"] * wide[accessor["type"]]
        values = np.frombuffer(data, dtype, count, view["byteOffset"]).reshape(accessor["count"], -1)
        if "min" in accessor:
            np.testing.assert_array_equal(values.min(axis=0), np.float32(accessor["min"]))
            np.testing.assert_array_equal(values.max(axis=0), np.float32(accessor["max"]))
        return values

    return scene, array


def turned(vectors):
    return np.stack([vectors[..., 0], vectors[..., 2], -vectors[..., 1]], axis=-1)


def test_gltf_has_the_deformation_as_morph_targets(block, tmp_path):
    series = series_of_dataset(block)
    path = write_glb(series, tmp_path / "block.glb", card={"name": "block"})
    scene, array = parts_of(path)
    primitive = scene["meshes"][0]["primitives"][0]
    np.testing.assert_allclose(array(primitive["attributes"]["POSITION"]), turned(block.rest), atol=1e-8)
    assert len(primitive["targets"]) == len(series.values) == len(scene["meshes"][0]["weights"])
    normals = array(primitive["attributes"]["NORMAL"])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    for state, target in zip(series.displacement, primitive["targets"], strict=True):
        np.testing.assert_allclose(array(target["POSITION"]), turned(state), atol=1e-8)
        # normals of the moved surface, as trimesh has them
        moved = trimesh.Trimesh(turned(block.rest + state), block.triangles, process=False)
        used = np.unique(block.triangles)
        sums = np.zeros((len(block.rest), 3))
        for k in range(3):
            np.add.at(sums, block.triangles[:, k], moved.face_normals * moved.area_faces[:, None])
        wanted = sums[used] / np.linalg.norm(sums[used], axis=1, keepdims=True)
        np.testing.assert_allclose((normals + array(target["NORMAL"]))[used], wanted, atol=2e-5)
    animation = scene["animations"][0]
    times = array(animation["samplers"][0]["input"])[:, 0]
    weights = array(animation["samplers"][0]["output"]).reshape(len(times), -1)
    assert times[0] == 0
    assert (np.diff(times) > 0).all()
    np.testing.assert_array_equal(weights[[0, -1]], 0)
    np.testing.assert_array_equal(weights[1 : 1 + len(series.values)], np.eye(len(series.values)))
    assert scene["extras"]["model card"]["name"] == "block"


def test_gltf_is_read_by_trimesh_upright_and_in_metres(block, tmp_path):
    path = write_glb(series_of_dataset(block, [1]), tmp_path / "block.glb")
    mesh = trimesh.load(path, force="mesh")
    whole = trimesh.Trimesh(turned(block.rest), block.triangles, process=False)
    np.testing.assert_allclose(mesh.bounds, whole.bounds, atol=1e-7)
    assert mesh.volume == pytest.approx(whole.volume, rel=1e-5)
    assert mesh.volume > 0  # turned, not mirrored
    height = np.ptp(block.rest[:, 2])
    assert np.ptp(mesh.vertices[:, 1]) == pytest.approx(height, rel=1e-6)


def test_a_long_series_is_thinned_to_what_viewers_show(tmp_path):
    points, cells = np.eye(3), np.array([[0, 1, 2]])
    states = np.linspace(0, 1, 30)[:, None, None] * np.ones((30, 3, 3))
    series = ShapeSeries(points, cells, states, np.arange(30))
    scene, array = parts_of(write_glb(series, tmp_path / "long.glb", targets=8))
    targets = scene["meshes"][0]["primitives"][0]["targets"]
    assert len(targets) == 8
    assert array(targets[-1]["POSITION"])[0, 0] == 1
    assert scene["meshes"][0]["extras"]["targetNames"][0] == "0"


def test_cells_that_are_no_triangles_are_refused_in_words():
    with pytest.raises(UsageError, match="no triangles") as raised:
        ShapeSeries(np.eye(3), np.array([[0, 1, 3]]), np.zeros((1, 3, 3)), np.zeros(1))
    assert raised.value.why
    assert raised.value.fix


def test_a_learnt_bodys_stroke_goes_out(tmp_path):
    body = Surrogate(touch_energy(), {"displacement": field()}, meta={"name": "slab"})
    X = stroke_of(body, 5)
    assert X.shape == (5, 3)
    depth = body.energy.depth(X)
    assert (np.diff(depth) > 0).all()
    series = series_of_surrogate(body, X)
    np.testing.assert_array_equal(series.displacement, body.fields["displacement"].values(X))
    assert trimesh.load(write_shapes(series, tmp_path / "slab.glb"), force="mesh").faces.shape[1] == 3
    grid = meshio.read(write_shapes(series, tmp_path / "slab.vtu"))
    np.testing.assert_array_equal(grid.point_data["displacement"], series.displacement[-1])
    shifted = stroke_of(body, 2, at="0.01,0.0,0.0", depth=0.002)
    np.testing.assert_allclose(shifted[-1, 0], 0.01, atol=1e-9)
    assert body.energy.depth(shifted)[-1] == pytest.approx(0.002, rel=1e-6)


def test_a_stroke_touches_where_it_is_told_to_and_along_the_normal():
    body = Surrogate(touch_energy(surface=ball()), {"displacement": field(curved=True)}, meta={"name": "cap"})
    centre = np.array([0.0, 0.0, -0.03])  # of the ball whose cap is pressed
    place = centre + 0.03 * np.array([0.28, 0.0, 0.96])
    X = stroke_of(body, 4, at=",".join(map(str, place)), depth=0.004)
    np.testing.assert_allclose(np.cross(X - centre, place - centre), 0.0, atol=2e-6)  # the normal of a ball
    np.testing.assert_allclose(body.energy.depth(X), [0.001, 0.002, 0.003, 0.004], atol=1e-4)
    assert reservations_about(body, X) == []
    assert "deeper than the 12 mm" in reservations_about(body, stroke_of(body, 4, depth=0.0125))[0]
    for at, depth, said in (
        ("0,0,0.02", None, r"No contact at 0,0,0\.02"),
        ("0,0,0.01", 0.002, r"nearest place of the surface is --at 0,0,0\.$"),
        ("0.5,0,0", None, "nearest place of the surface is --at"),
        ("nan,0,0", None, "'nan' is no number"),
        (None, 0.06, "leaves the surface"),
    ):
        with pytest.raises(UsageError) as error:
            stroke_of(body, 4, at=at, depth=depth)
        assert re.search(said, str(error.value) + str(error.value.fix))


def trained_at(low, high):
    """The slab, trained within a box of its scaled inputs alone: 12 mm deep at −1, in the air at 1."""
    energy = touch_energy()
    points = np.random.default_rng(0).uniform(low, high, (200, 3))
    return Surrogate(
        dataclasses.replace(energy, region=TrainedRegion.of(points)),
        {"displacement": field()},
        meta={"name": "slab"},
    )


@pytest.mark.parametrize(
    ("low", "high"),
    [([-1, -1, -1], [1, 1, 1]), ([-0.3, -0.3, -0.2], [0.3, 0.3, 1.0]), ([0.4, 0.4, -1.0], [1.0, 1.0, 1.0])],
    ids=["throughout", "not so deep", "not in the middle"],
)
def test_the_stroke_by_default_lies_within_what_was_trained(low, high):
    body = trained_at(low, high)
    X = stroke_of(body, 8)
    assert body.energy.inside(X).all()
    assert reservations_about(body, X) == []
    depth = body.energy.depth(X)
    assert (np.diff(depth) > 0.0).all()
    assert depth[-1] > 0.25 * touchable(body).deepest


@pytest.mark.parametrize("name", ["pad", "constant", "iwan"])
def test_the_pull_by_default_lies_within_what_was_trained(name):
    """The farthest corner of the ranges is farther than any axis goes."""
    thing = held_body(name)
    X = stroke_of(thing, 8)
    assert thing.energy.inside(X).all()
    assert np.ptp(X[:, : len(thing.energy.baseline.directions)], axis=0).max() > 0.0


def test_what_can_not_go_out_is_refused(block, tmp_path):
    with pytest.raises(UsageError, match=r"none of .csv"):
        write_table(block, tmp_path / "block.xls")
    with pytest.raises(UsageError, match=r"none of .pvd"):
        write_shapes(series_of_dataset(block), tmp_path / "block.obj")
    with pytest.raises(UsageError, match="counted from 0"):
        series_of_dataset(block, [99])
    with pytest.raises(UsageError, match="has no shape"):
        series_of_surrogate(Surrogate(touch_energy()), np.zeros((1, 3)))
    with pytest.raises(UsageError, match="what came before"):
        stroke_of(bent_body(), 3)
    with pytest.raises(UsageError, match="make no stroke"):
        write_glb(series_of_dataset(block), tmp_path / "block.glb", targets=0)


META = {
    "name": "my_body | *bold*",
    "solves": 12,
    "left_out": {"median": 0.01, "p95": 0.05},
    "validation": {"unseen solves": 8, "force error, median": 0.012, "limits kept": False},
    "dataset": {
        "hash": "ab" * 32,
        "provenance": {"config_hash": "cd" * 32, "seed": 7, "created": "2026-01-01"},
    },
    "runtime": {"max_force": 3.0, "rate": 1000.0},
}


def test_the_card_says_what_the_file_says(tmp_path):
    body = Surrogate(touch_energy(), {"displacement": field()}, meta=META)
    path = body.save(tmp_path / "body.palpate")
    card = body.card(path)
    assert (card.author, card.licence) == (NOT_STATED, NOT_STATED)
    assert card.hashes["file"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert card.hashes["dataset"] == "ab" * 32
    found = json.loads(card.to_json())
    assert found == card.as_dict()
    assert [i["name"] for i in found["answers"]["inputs"]] == [r.name for r in body.inputs]
    assert found["errors"]["unseen solves"]["force error, median"] == 0.012
    assert found["trained_on"]["seed"] == 7
    text = card.to_markdown()
    for words in (
        "misses a limit",
        "1.2 %",
        "limited to 3 N",
        r"my\_body \| \*bold\*",
    ):
        assert words in text
    signed = body.signed("A. Nobody, Example Institute", "CC-BY-4.0")
    assert (signed.card().author, signed.card().licence) == ("A. Nobody, Example Institute", "CC-BY-4.0")
    assert Surrogate.load(signed.save(tmp_path / "signed.palpate")).card().licence == "CC-BY-4.0"


def test_the_card_says_where_the_body_lets_go():
    energy = touch_energy()
    surface, radius = energy.baseline.surface, energy.baseline.radius
    end = surface.inner + radius
    limits = " ".join(Surrogate(energy).card().limits)
    assert f"deepest trained press is {1e3 * energy.going.deepest:g} mm" in limits
    assert f"lets go, without force, at a depth of {1e3 * end:g} mm" in limits
    # the loop lets go there, and no earlier
    body = touchable(Surrogate(energy))
    loop, no_more = body.evaluator(), np.zeros(0)
    top = np.array([0.0, 0.0, radius])  # touches the face z = 0
    for depth, gone in ((0.98 * end, False), (1.02 * end, True)):
        loop(body.away, no_more)
        loop(top - [0.0, 0.0, depth], no_more)
        assert loop.let_go is gone


def test_the_card_reads_without_raw_data():
    body = {
        "type": "Body",
        "material": {"skin": {"law": "NeoHookean", "young": 9e3, "form": None}},
        "fixed": ["bottom"],
    }
    ball = {"type": "SphereProbe", "depth": [0.0, 0.006], "over": [[0.05, 0.05], [0.07, 0.07]], "stop": None}
    provenance = {"problem": {"body": body, "interactions": [ball]}}
    lines = str(
        Surrogate(touch_energy(), meta={**META, "dataset": {"provenance": provenance}}).card()
    ).splitlines()
    for line in (
        "- body: Body",
        "    - skin: NeoHookean",
        "      - young: 9000 Pa",
        "  - fixed: bottom",
        "- acting on it: SphereProbe",
        "  - depth: 0 to 0.006 m",
        "  - over: (0.05, 0.05), (0.07, 0.07) m",
        "- unseen solves: 8",
        "  - force error, median: 1.2 %",
    ):
        assert line in lines
    assert not any(mark in line for line in lines for mark in ('{"', "null", "\\"))


def test_a_network_has_a_card_too():
    network = touch_energy().network
    card = card_of(palpate.Surrogate.of(network))
    assert card.answers["outputs"]
    assert "extrapolated" in " ".join(card.limits)
    assert "not checked" in " ".join(card.warnings)


@pytest.mark.full
def test_the_card_of_a_fit_says_what_its_file_says(tmp_path):
    X = np.linspace(-1.0, 1.0, 60)
    fitted = Fitted.load(palpate.fit(X, np.sin(2 * X), effort=0.01).save(tmp_path / "sine.palpate"))
    card = fitted.card(tmp_path / "sine.palpate")
    assert card.trained_on["samples"] == 60
    assert card.errors["error on samples held out, relative to the outputs' spread"] == fitted.heldout
    assert card.warnings == fitted.notes
    assert "samples that it was learnt from" in " ".join(card.limits)
    assert not {"finite-element", "solves", NOT_STATED} & set(" ".join(card.limits + card.warnings).split())
