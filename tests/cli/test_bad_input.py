"""Bad input: one clear message, the right exit code, nothing lost."""

from __future__ import annotations

import json
import shutil
import socket

import numpy as np
import pytest

import palpate as pp
from small_study import SMALL


def broken(folder, old: str, new: str):
    path = folder / "study.toml"
    assert old in SMALL
    path.write_text(SMALL.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.grid
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("samples = 33", "sampels = 33", ["sweep.sampels", "did you mean 'samples'"]),
        ('high = "2 N"', 'high = "2 kg"', ["loads.0.high", "not a quantity in N"]),
        ('high = "2 N"', 'high = "two"', ["loads.0.high"]),
        ('high = "2 N"', "high = nan", ["loads.0.high"]),
        ("elements = 10", "elements = 0", ["body.elements"]),
        ("[sweep]", "[sweeep]", ["sweeep", "did you mean 'sweep'"]),
        ("[sweep]", "[sweep", ["not valid TOML", "line"]),
        ('name = "small"', 'name = "../up"', ["name"]),
        ("random = 8", "random = 8\n[filter]\nsettings = { nois = 1.0 }", ["no setting 'nois'"]),
        ("random = 8", 'random = 8\n[filter]\nsettings = { tail = "cubic" }', ["tail", "'cubic'"]),
    ],
)
def test_a_study_that_can_not_be_meant(palpate, tmp_path, old, new, words):
    answer = palpate("sweep", broken(tmp_path, old, new))
    assert answer.code == 2
    assert answer.out == ""
    for word in ["study.toml", *words]:
        assert word in answer.err
    assert "Traceback" not in answer.err


def test_all_mistakes_of_a_study_are_listed_at_once(palpate, tmp_path):
    path = broken(tmp_path, "samples = 33", "sampels = 33")
    path.write_text(path.read_text().replace("elements = 10", "elements = 0"))
    answer = palpate("sweep", path)
    assert "sweep.sampels" in answer.err
    assert "body.elements" in answer.err


def test_missing_study(palpate, tmp_path):
    answer = palpate("sweep", tmp_path / "no.toml")
    assert answer.code == 2
    assert "palpate init" in answer.err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('material = "nylon"', 'material = "nylonn"', ["nylonn", "copper"]),
        ('high = "2 N"', 'high = "-2 N"', ["range"]),
        ('high = "2 N"', 'high = "2 N"\ndirection = [0, 0]', ["direction"]),
        ('high = "2 N"', 'high = "2 N"\nat = "3 m"', ["beam"]),
    ],
)
def test_a_body_that_can_not_be(palpate, tmp_path, old, new, words):
    answer = palpate("sweep", broken(tmp_path, old, new))
    assert answer.code == 2
    for word in words:
        assert word in answer.err


@pytest.mark.full
def test_loads_outside_the_solvers_reach(palpate, tmp_path):
    path = broken(tmp_path, 'high = "2 N"', 'high = "1e9 N"')
    path.write_text(path.read_text().replace("samples = 33", "samples = 8"))
    answer = palpate("sweep", path)
    assert answer.code == 3
    assert "7 of 8 solves failed" in answer.err  # no load is no trouble
    assert "e+08 N" in answer.err
    assert "Traceback" not in answer.err


def test_errors_as_json(palpate, tmp_path):
    answer = palpate("sweep", tmp_path / "no.toml", "--json")
    error = json.loads(answer.out)["error"]
    assert error["kind"] == "StudyError"
    assert "no.toml" in error["what"]


@pytest.fixture
def copy(carried_out, tmp_path):
    return shutil.copytree(carried_out, tmp_path / "copy")


@pytest.mark.full
def test_missing_and_corrupt_dataset(palpate, copy):
    metadata = copy / "small.zarr" / "zarr.json"
    metadata.write_bytes(metadata.read_bytes()[:-50])
    answer = palpate("learn", copy / "study.toml")
    assert answer.code == 2
    assert "small.zarr" in answer.err
    shutil.rmtree(copy / "small.zarr")
    answer = palpate("learn", copy / "study.toml")
    assert answer.code == 2
    assert "small.zarr" in answer.err


def test_the_dataset_of_another_study_is_not_overwritten(palpate, copy):
    path = copy / "study.toml"
    path.write_text(SMALL.replace('high = "2 N"', 'high = "3 N"'), encoding="utf-8")
    answer = palpate("sweep", path)
    assert answer.code == 2
    assert "small.zarr" in answer.err


@pytest.mark.parametrize("command", [("view",), ("run",)])
def test_corrupt_model(palpate, copy, command):
    model = copy / "small.palpate"
    content = bytearray(model.read_bytes())
    content[-5] ^= 1
    model.write_bytes(content)
    answer = palpate(*command, model)
    assert answer.code == 2
    assert "checksum" in answer.err


def test_validate_names_a_corrupt_model(palpate, copy):
    model = copy / "small.palpate"
    model.write_bytes(model.read_bytes()[:1000])
    answer = palpate("validate", copy / "study.toml")
    assert answer.code == 2
    assert "small.palpate" in answer.err


@pytest.mark.full
def test_a_missed_target_is_exit_code_one_after_the_report_is_written(palpate, copy):
    path = copy / "study.toml"
    path.write_text(SMALL + "\n[target]\nrmse = 1e-14\n", encoding="utf-8")
    answer = palpate("validate", path, "--json")
    assert answer.code == 1
    assert json.loads(answer.out)["passed"] is False
    assert (copy / "small.html").exists()
    assert "misses 1 of 10 limits" in answer.err


@pytest.mark.full
def test_a_busy_port(palpate, copy):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        answer = palpate("view", copy / "small.palpate", "--port", port, "--strict-port", "--no-browser")
    assert answer.code == 2
    assert str(port) in answer.err


def test_unknown_device(palpate, copy):
    answer = palpate("run", copy / "small.palpate", "--device", "phantom")
    assert answer.code == 2
    assert "stroke" in answer.err


@pytest.mark.parametrize(
    "words", [["nonsense"], ["run"], ["sweep", "--workers", "0"], ["demo", "no-such-study"]]
)
def test_usage(palpate, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert palpate(*words).code == 2


def test_mistakes_of_ranges_materials_and_places_are_told_at_once(palpate, tmp_path):
    path = broken(tmp_path, 'material = "nylon"', 'material = "nylonn"')
    path.write_text(
        path.read_text().replace('low = "0 N"', 'low = "3 N"').replace("samples = 33", "samples = 3")
    )
    answer = palpate("sweep", path)
    assert answer.code == 2
    assert "body.material" in answer.err
    assert "loads.0: its range is empty" in answer.err
    assert "sweep.samples" in answer.err


def test_a_mistake_in_a_part_is_told_once(palpate, tmp_path):
    answer = palpate("sweep", broken(tmp_path, 'high = "2 N"', 'high = "2 kg"'))
    assert answer.err.count("loads") == 1


def test_text_without_a_unit_is_a_question(palpate, tmp_path):
    answer = palpate("sweep", broken(tmp_path, 'high = "2 N"', 'high = "2"'))
    assert answer.code == 2
    assert '"2 N"' in answer.err


def test_a_study_changed_after_its_sweep_is_not_learnt(palpate, copy):
    path = copy / "study.toml"
    path.write_text(SMALL.replace("elements = 10", 'elements = 10\nlength = "0.5 m"'), encoding="utf-8")
    for command in ("learn", "validate"):
        answer = palpate(command, path)
        assert answer.code == 2
        assert "not of this study's body" in answer.err


@pytest.mark.full
def test_solves_that_were_trained_with_do_not_pass_for_unseen(palpate, copy):
    path = copy / "study.toml"
    path.write_text(SMALL.replace("random = 8", "random = 8\nevery = 5"), encoding="utf-8")
    assert palpate("learn", path).code == 0
    path.write_text(SMALL, encoding="utf-8")
    answer = palpate("validate", path)
    assert answer.code == 2
    assert "learnt from other solves" in answer.err


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with files that are not what a command takes, and a network of data."""
    folder = tmp_path_factory.mktemp("files")
    x = np.linspace(-1.0, 1.0, 30)
    network = pp.fit(x, np.sin(x), effort=0.01).save(folder / "net.palpate")
    (folder / "t.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    (folder / "empty.palpate").write_bytes(b"")
    (folder / "cut.palpate").write_bytes(network.read_bytes()[:1500])
    (folder / "text.palpate").write_text("these are words", encoding="utf-8")
    return folder


@pytest.mark.full
@pytest.mark.grid
@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("learn none.zarr", ["does not exist", "palpate sweep"]),
        ("run net.palpate", ["holds a network of data", "palpate ask"]),
        ("export gltf net.palpate -o net.glb", ["holds a network of data"]),
        ("ask t.csv", ["is not a .palpate file: it is a file of data", "palpate fit"]),
        ("ask empty.palpate", ["is empty", "Copy the file again"]),
        ("ask cut.palpate", ["is cut off", "Copy the file again"]),
        ("ask text.palpate", ["is not a .palpate file, or its beginning is lost"]),
        ("ask net.palpate --at 1,2", ["It has 1 input:", "Give 1 number"]),
        ("material fit none.csv", ["none.csv: no such file"]),
        ("init t.csv", ["can't be called", "a file of data", "palpate fit"]),
        ("init net.palpate", ["the name of a model file"]),
        ("sweep net.palpate", ["is a model file, not a study file", "palpate view"]),
        ("learn net.palpate", ["is a model file"]),
        ("learn t.csv", ["is a file of data, not a study file"]),
        ("touch t.csv", ["none of the formats of parts and meshes", "STL", "palpate fit"]),
    ],
)
def test_a_file_in_a_wrong_place_is_named_with_a_way_forward(palpate, files, monkeypatch, command, words):
    monkeypatch.chdir(files)
    answer = palpate(*command.split())
    assert answer.code in {1, 2, 4}
    text = " ".join(answer.err.split())
    for word in words:
        assert word in text
    assert not any(jargon in text for jargon in ("header", "codec", "Traceback", "--force", "Error("))


def test_a_folder_is_no_study(palpate, tmp_path):
    answer = palpate("sweep", tmp_path)
    assert answer.code == 2
    assert "palpate init" in answer.err
