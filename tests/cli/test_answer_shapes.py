"""Shapes of a surrogate without touch: colours and displacements of glTF against its own answers, read by trimesh."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from answering import RANGES, answering, plate_mesh, quantities
from palpate.errors import UsageError
from palpate.export.answer_shapes import series_of_answers
from palpate.surrogates import MeshPlaces, ModalField, Surrogate


def bent_plate() -> Surrogate:
    """The plate with a temperature, and a displacement upwards that grows with the first coefficient."""
    body, (points, _) = answering(), plate_mesh()
    places = body.fields["temperature"].places
    modes = np.zeros((2, len(points), 3))
    modes[0, :, 2] = 1e-3
    moved = ModalField(
        "displacement",
        "m",
        places,
        quantities(("a", "b"), "m"),
        np.zeros((len(points), 3)),
        modes,
        np.zeros((len(points), 3)),
        components=("x", "y", "z"),
    )
    return replace(body, fields={**body.fields, "displacement": moved})


def read_glb(path: Path) -> tuple[dict[str, Any], list[np.ndarray]]:
    """Return the scene of a GLB file and its accessors' numbers (ISO/IEC 12113)."""
    data = path.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    scene, binary = json.loads(data[20 : 20 + size]), data[28 + size :]
    arrays = []
    for accessor in scene["accessors"]:
        view = scene["bufferViews"][accessor["bufferView"]]
        kind, width = ("<u4" if accessor["componentType"] == 5125 else "<f4"), {"SCALAR": 1, "VEC3": 3}
        count = accessor["count"] * width[accessor["type"]]
        arrays.append(np.frombuffer(binary, kind, count, view["byteOffset"]).reshape(accessor["count"], -1))
    return scene, arrays


def test_an_animation_runs_from_the_first_to_the_last_input(palpate, tmp_path):
    body = bent_plate()
    file = body.save(tmp_path / "plate.palpate")
    answer = palpate("export", "gltf", file, "--over", "heat", "--steps", "5")
    assert answer.code == 0, answer.err
    scene, arrays = read_glb(tmp_path / "plate.glb")
    (primitive,) = scene["meshes"][0]["primitives"]
    assert len(primitive["targets"]) == 5
    middle = (RANGES[1].low + RANGES[1].high) / 2.0
    X = np.array([[RANGES[0].low, middle], [RANGES[0].high, middle]])
    # y is up in glTF
    lifts = body.fields["displacement"].values(X)[..., 2]
    first, move = arrays[primitive["attributes"]["POSITION"]], arrays[primitive["targets"][-1]["POSITION"]]
    np.testing.assert_allclose(first[:, 1], lifts[0], atol=1e-9)
    np.testing.assert_allclose(move[:, 1], lifts[1] - lifts[0], atol=1e-9)
    start, change = arrays[primitive["attributes"]["COLOR_0"]], arrays[primitive["targets"][-1]["COLOR_0"]]
    assert not np.allclose(change, 0.0)
    for colours in (start, start + change):
        assert colours.min() > -1e-6
        assert colours.max() < 1.0 + 1e-6


def test_the_hottest_place_is_dark_and_the_coldest_bright():
    body = answering()
    X = np.array([[RANGES[0].high, RANGES[1].low]])
    series, values = series_of_answers(body, X, "temperature"), body.fields["temperature"].values(X)[0, :, 0]
    light = series.colours[0] @ [0.2126, 0.7152, 0.0722]  # relative luminance, ITU-R BT.709
    order = np.argsort(values)
    assert (np.diff(light[order]) <= 1e-12).all()
    assert light[order[0]] > 5.0 * light[order[-1]]
    np.testing.assert_array_equal(series.fields["temperature (K)"][0], values)


def test_a_field_in_cells_colours_each_triangle_evenly():
    points, triangles = plate_mesh()
    points = np.hstack([points, np.zeros((len(points), 1))])
    cells = len(triangles)
    places = MeshPlaces(points, triangles, "cells", points[triangles].mean(axis=1), np.arange(cells))
    modes = np.random.default_rng(0).normal(size=(2, cells, 1))
    shown = ModalField(
        "flux", "W/m²", places, quantities(("a", "b")), np.zeros((cells, 1)), modes, np.zeros((cells, 1))
    )
    X = np.array([[3e5, 20.0]])
    series = series_of_answers(Surrogate(fields={"flux": shown}), X)
    expected = np.repeat(shown.values(X)[0, :, 0], 3)
    np.testing.assert_array_equal(series.fields["flux (W/m²)"][0], expected)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--over", "colour"), "no input 'colour'"),
        (("--at", "1,2,3"), "3 numbers"),
        (("--field", "rise"), "no field 'rise'"),
        (("--depth", "1mm"), "no depth"),
    ],
)
def test_what_is_not_there_is_refused_by_name(palpate, tmp_path, words, said):
    file = answering().save(tmp_path / "rod.palpate")
    answer = palpate("export", "gltf", file, *words)
    assert answer.code != 0
    assert said in answer.err
    assert not (tmp_path / "rod.glb").exists()


def test_numbers_alone_have_no_shape():
    with pytest.raises(UsageError, match="no surface"):
        series_of_answers(answering(fields=False), np.array([[3e5, 20.0]]))
