"""Each command on a real study: what it writes, what it prints, where."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest

from palpate import __version__
from palpate.cli.console import Console
from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.loading import load
from palpate.physics.advice import advise
from palpate.processes import end_by_sigterm
from palpate.runtime import LoopReport
from palpate.study import Study, preset_names, preset_study, read_study
from programs import one_core
from small_study import SMALL, carry_out


def test_version_and_help(palpate):
    assert palpate("--version").out == f"palpate {__version__}\n"
    answer = palpate("--help")
    for command in ("demo", "init", "sweep", "learn", "validate", "view", "run", "doctor", "schema"):
        assert command in answer.out


@pytest.mark.full
def test_python_m_palpate_is_palpate():
    done = subprocess.run(
        [sys.executable, "-m", "palpate", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"palpate {__version__}\n"


@pytest.mark.grid
@pytest.mark.parametrize("name", preset_names())
def test_init_writes_a_study_that_reads_back_as_the_preset(palpate, tmp_path, name):
    path = tmp_path / "mine.toml"
    assert palpate("init", path, "--preset", name).code == 0
    assert read_study(path) == preset_study(name).model_copy(update={"name": "mine"})
    path.write_text(palpate("init", "--print", "--preset", name).out, encoding="utf-8")
    assert read_study(path) == preset_study(name)


def test_a_file_name_that_can_not_name_a_study_is_refused(palpate, tmp_path):
    assert palpate("init", tmp_path / "-x y.toml").code == 2


def test_init_replaces_a_study_where_that_is_asked_and_nothing_else(palpate, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("mine = 1\n", encoding="utf-8")
    for more in ((), ("--force",)):
        answer = palpate("init", path, *more)
        assert answer.code == 2
        assert "palpate did not write it" in answer.err
        assert path.read_text(encoding="utf-8") == "mine = 1\n"
    path.unlink()
    assert palpate("init", path).code == 0
    path.write_text(path.read_text(encoding="utf-8") + "a line that breaks it\n", encoding="utf-8")
    answer = palpate("init", path)
    assert answer.code == 2
    assert "exists already" in answer.err
    assert "--force" in answer.err
    assert palpate("init", path, "--force").code == 0
    assert read_study(path).name == "study"


@pytest.mark.grid
@pytest.mark.parametrize("name", ["scan.xyz", "notes.txt", "model.palpate", "data.zarr", "scan", "scan.gz"])
def test_only_a_toml_file_is_a_target_of_init(palpate, tmp_path, name):
    path = tmp_path / name
    for content in (None, b"mine"):
        if content is not None:
            path.write_bytes(content)
        for more in ((), ("--force",)):
            answer = palpate("init", path, *more)
            assert answer.code == 2
            assert "NAME.toml" in answer.err
    assert path.read_bytes() == b"mine"


FIELD = Path(__file__).parents[1] / "data" / "field"


def test_a_sample_that_does_not_exist_says_which_do(palpate, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = palpate("init", "--sample", "livr.stl")
    assert answer.code == 2
    assert "kidney, liver, heart, prostate" in answer.err
    assert "Did you mean liver?" in answer.err
    answer = palpate("init", "--sample")
    assert answer.code == 0
    assert "palpate touch kidney.stl" in answer.out
    assert palpate("init", "--sample", "kidney").code == 2
    assert palpate("init", "--sample", "kidney", "--force").code == 0
    Path("kidney.stl").write_bytes(b"a scan")
    assert palpate("init", "--sample", "--force").code == 2
    assert Path("kidney.stl").read_bytes() == b"a scan"


def test_a_parts_study_takes_its_options_and_another_name(palpate, tmp_path):
    part = Path(shutil.copy(FIELD / "surface" / "quad_cube.obj", tmp_path / "cube.obj"))
    answer = palpate(
        "init", part, "--young", "4 kPa", "--poisson", "0.4", "--depth", "2 mm", "--name", "soft"
    )
    assert answer.code == 0
    assert f"palpate touch {part} --name soft" in answer.out
    assert not (tmp_path / "cube.toml").exists()
    study = read_study(tmp_path / "soft.toml")
    assert (study.name, study.body.material.young, study.body.material.poisson) == ("soft", 4e3, 0.4)
    assert study.interaction.depth[1] == pytest.approx(2e-3)
    assert palpate("init", part, "--name", "soft").code == 2
    assert palpate("init", part, "--tissue", "liver").code == 0
    assert read_study(tmp_path / "cube.toml").body.material == "liver"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("cube.obj", "mystudy.txt"), "palpate init cube.obj --name mystudy"),
        (("one.toml", "two.toml"), "two.toml is one file too many"),
        (("cube.obj", "--name", "a/b"), "Its files are named after it"),
        (("cube.obj", "--material", "liver", "--young", "4 kPa"), "of its own"),
        (("cube.obj", "--tissue", "livr"), "'liver'"),
        (("cube.obj", "--preset", "block"), "Leave out --preset"),
        (("one.toml", "--depth", "2 mm"), "--depth belongs to a part"),
    ],
)
def test_what_init_can_not_do_it_says(palpate, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    shutil.copy(FIELD / "surface" / "quad_cube.obj", "cube.obj")
    answer = palpate("init", *arguments)
    assert answer.code == 2
    assert words in answer.err
    assert [path.name for path in Path().iterdir()] == ["cube.obj"], "nothing is written"


def test_a_scan_gets_its_study_beside_it_and_stays_as_it_is(palpate, tmp_path):
    scan = Path(shutil.copy(FIELD / "surface" / "quad_cube.obj", tmp_path / "Cube.OBJ"))
    before = scan.read_bytes()
    for more in ((), ("--force",)):
        answer = palpate("init", scan, *more)
        assert answer.code == 0
        assert "numbers taken as mm: 40 × 40 × 40 mm" in answer.out
    assert scan.read_bytes() == before
    assert read_study(tmp_path / "Cube.toml").name == "Cube"


def test_the_unit_is_asked_for_where_two_are_possible(palpate, tmp_path):
    part = Path(shutil.copy(FIELD / "stl" / "cube4mm.stl", tmp_path))
    for words in (("init", part), ("touch", part, "--no-view")):
        answer = palpate(*words)
        assert answer.code == 2
        assert "4 mm and 4 m are both possible" in answer.err
        assert "--unit mm" in answer.err
    assert "numbers taken as mm: 4 × 4 × 4 mm" in palpate("init", part, "--unit", "mm").out


def test_a_part_does_not_go_on_with_the_study_of_another(palpate, tmp_path):
    scan = Path(shutil.copy(FIELD / "surface" / "quad_cube.obj", tmp_path))
    assert palpate("init", scan).code == 0
    answer = palpate("touch", scan.with_suffix(".stl"), "--no-view")
    assert answer.code == 2
    assert "is no study of quad_cube.stl" in answer.err


def test_what_takes_long_is_told(monkeypatch):
    lines, heard = [], threading.Event()
    monkeypatch.setattr("palpate.cli.console.PATIENCE", 0.0)
    monkeypatch.setattr(Console, "say", lambda console, text: (lines.append(text), heard.set()))
    with Console().patience("Reading part.step"):
        assert heard.wait(60)
    assert lines == ["Reading part.step …"]


def test_schema_describes_every_key(palpate):
    schema = json.loads(palpate("schema").out)
    assert set(schema["properties"]) == set(Study.model_fields)
    assert schema["additionalProperties"] is False


def test_sweep_and_learn_write_what_they_say_and_what_is_shipped(carried_out, tmp_path):
    """A body that loads move, from solves to a file; the shipped folder that other tests begin with is the same."""
    carry_out(tmp_path)
    data, random = Dataset.open(tmp_path / "small.zarr"), Dataset.open(tmp_path / "small-random.zarr")
    assert (len(data), len(random)) == (33, 8)
    assert data.converged.all()
    model = load(tmp_path / "small.palpate")
    assert model.name == "small"
    force = model.energy.force(-data.displacement[:, -1, 1:2])
    np.testing.assert_allclose(force, data.X * [0.0, 1.0, 0.0], atol=1e-4)
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in carried_out.iterdir()}
    shipped = load(carried_out / "small.palpate").energy.force(-data.displacement[:, -1, 1:2])
    np.testing.assert_allclose(shipped, force, atol=1e-4)


@pytest.mark.full
def test_a_finished_sweep_is_not_solved_again(palpate, carried_out):
    before = Dataset.open(carried_out / "small.zarr").provenance["created"]
    assert palpate("sweep", carried_out / "study.toml").code == 0
    assert Dataset.open(carried_out / "small.zarr").provenance["created"] == before


def test_validate_keeps_its_limits_and_writes_the_report(palpate, carried_out, tmp_path):
    """With the full model under a recorded hand: a beam, whose load is found for each place."""
    trace, model = tmp_path / "beam.trace", carried_out / "small.palpate"
    assert (
        palpate("run", model, "--seconds", "0.4", "--device", "stroke:frequency=2", "--record", trace).code
        == 0
    )
    answer = palpate("validate", carried_out / "study.toml", "--trace", trace, "--json")
    assert answer.code == 0
    content = json.loads(answer.out)
    assert content["passed"] is True
    assert content["traces"][0]["jnd_max"] < 0.5
    page = (carried_out / "small.html").read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert "A recorded touch: small beside finite elements" in page
    assert palpate("validate", model, "--trace", trace).code == UsageError.exit_code


def test_a_model_file_is_judged_by_the_test_set_beside_it(palpate, carried_out):
    answer = palpate("validate", carried_out / "small.palpate", "--no-report")
    assert answer.code == 0, answer.err
    assert "small on 8 unseen solves: every limit kept" in answer.out


@pytest.mark.full
def test_learning_again_gives_the_same_model_bit_for_bit_and_results_for_machines(
    palpate, carried_out, tmp_path
):
    """Progress goes to stderr, and nowhere beside results for machines."""
    for (
        name
    ) in "ab":  # what is shipped was learnt on another processor, whose sums may differ in the last bits
        shutil.copytree(carried_out, tmp_path / name)
        answer = palpate("learn", tmp_path / name / "study.toml", "--json")
        assert answer.err == ""
        assert set(json.loads(answer.out)) == {"model", "passed", "measured", "left_out", "suspects"}
    assert "Learning from" in (carried_out / "learn.err").read_text(encoding="utf-8")
    assert "Learning from" not in (carried_out / "learn.out").read_text(encoding="utf-8")
    first, again = (load(tmp_path / name / "small.palpate") for name in "ab")
    pairs = [(first.energy, again.energy), *((first.fields[k], again.fields[k]) for k in first.fields)]
    for made, same in pairs:
        np.testing.assert_array_equal(same.network.factors, made.network.factors)
        np.testing.assert_array_equal(same.network.weights, made.network.weights)


@pytest.mark.full
def test_run_reports_the_loop(palpate, carried_out):
    answer = palpate("run", carried_out / "small.palpate", "--seconds", "0.5", "--json")
    assert answer.code == 0
    report = json.loads(answer.out)
    assert report["ticks"] > 50
    assert report["largest_force"] > 0
    still = palpate(
        "run", carried_out / "small.palpate", "--seconds", "0.3", "--device", "stroke:amplitude=0"
    )
    assert "did not reach the body" in still.out


def test_doctor_has_a_remedy_for_each_miss(palpate):
    answer = json.loads(palpate("doctor", "--json", "--seconds", "0").out)
    assert {"Python", "NGSolve", "chromium", "load"} <= {c["name"] for c in answer["checks"]}
    assert all(c["ok"] or c["remedy"] for c in answer["checks"])
    assert all(d["state"] == "ready" or d["remedy"] for d in answer["devices"])
    assert answer["timing"] is None


def test_doctor_gives_a_verdict_on_the_loop(palpate, monkeypatch):
    figures = dict.fromkeys(("lateness_p50", "lateness_p99", "lateness_p999", "work_p50", "work_p99"), 2e-5)
    run = LoopReport(4000, 1000.0, **figures, lateness_max=3e-5, clamped=0.0, faults={}, obtained={})
    monkeypatch.setattr("palpate.cli.doctor.run_timing_test", lambda seconds, rate: run)
    answer = palpate("doctor", "--seconds", "4")
    assert "✓ good: this machine can drive a device at 1000 Hz" in answer.out
    answer = palpate("doctor", "--seconds", "5", "--json")  # for which there are too few ticks
    assert json.loads(answer.out)["timing"]["grade"] == "not fit"


def test_doctor_outlives_a_timing_test_that_fails(palpate, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    answer = palpate("doctor", "--seconds", "0.1")
    assert answer.code == 0
    assert "did not run to its end" in answer.out


def test_devices_lists_by_default(palpate):
    answer = palpate("devices", "--json")
    assert answer.code == 0
    assert {"page", "stroke"} <= {d["device"] for d in json.loads(answer.out)["devices"]}
    assert palpate("devices", "list", "--json").out == answer.out


def test_a_simulated_device_says_where_it_listens(palpate):
    answer = palpate("devices", "simulate", "haply", "--port", 0, "--events", 0, "--seconds", 0.1, "--json")
    assert answer.code == 0, answer.err
    assert json.loads(answer.out)["device"].startswith("haply:ws://localhost:")
    answer = palpate("devices", "simulate", "crtk", "--port", 0, "--seconds", 0.1, "--json")
    assert answer.code == 0, answer.err
    assert json.loads(answer.out)["device"].startswith("crtk:ws://localhost:")
    assert palpate("devices", "simulate", "omega").code == 2


@pytest.mark.full
def test_the_double_of_a_library_says_how_it_is_used(palpate, c_compiler, tmp_path):
    answer = palpate(
        "devices", "simulate", "forcedimension", "--folder", tmp_path / "new", "--type", "falcon", "--json"
    )
    assert answer.code == 0, answer.err
    content = json.loads(answer.out)
    assert Path(content["library"]).is_file()
    assert content["device"] == f"forcedimension:library={content['library']}"
    answer = palpate(
        "devices", "simulate", "openhaptics", "--folder", tmp_path / "new", "--type", "omni", "--json"
    )
    assert answer.code == 0, answer.err
    assert Path(json.loads(answer.out)["library"]).is_file()
    answer = palpate("devices", "simulate", "forcedimension", "--folder", tmp_path, "--type", "omega.9")
    assert answer.code == 2
    assert "omega.3" in answer.err


@pytest.mark.full
def test_demo_runs_a_founding_beam(tmp_path):
    """In a process of its own; the other beam's solves and networks are measured in `tests/laws`."""
    command = [
        sys.executable,
        "-m",
        "palpate",
        "demo",
        "beam-nylon",
        "--folder",
        str(tmp_path / "d"),
        "--json",
    ]
    with one_core():
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=280)
    assert done.returncode == 0, done.stderr
    content = json.loads(done.stdout)
    assert set(content["studies"]) == {"beam-nylon"}
    assert content["studies"]["beam-nylon"]["passed"]
    assert (tmp_path / "d" / "beam-nylon.html").stat().st_size < 3_000_000
    assert len(Dataset.open(tmp_path / "d" / "beam-nylon.zarr")) == 501


def test_small_study_is_the_one_of_the_fixture(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(SMALL, encoding="utf-8")
    assert read_study(path).sweep.samples == 33


def test_ctrl_c_says_what_is_kept(palpate, carried_out, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("palpate.study.Study.with_workers", interrupted)
    answer = palpate("sweep", carried_out / "study.toml")
    assert answer.code == 130
    assert "Interrupted. What is solved is kept: the same command goes on." in answer.err


def test_sigterm_says_what_is_kept(palpate, carried_out, monkeypatch):
    monkeypatch.setattr("palpate.study.Study.with_workers", lambda *_: end_by_sigterm(signal.SIGTERM, None))
    answer = palpate("sweep", carried_out / "study.toml")
    assert answer.code == 128 + signal.SIGTERM
    assert "Ended from outside (SIGTERM). What is solved is kept: the same command goes on." in answer.err


def test_advice_is_told_once_and_without_the_line_of_code(palpate, carried_out, monkeypatch):
    def advising(study, _):
        for _ in range(3):
            advise("The pad is soft.", why="It takes most of the depth.", fix="Take a stiffer one.")
        return study

    monkeypatch.setattr("palpate.study.Study.with_workers", advising)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        answer = palpate("sweep", carried_out / "study.toml")
    assert (
        answer.err.count("warning: The pad is soft.\nIt takes most of the depth.\nTake a stiffer one.") == 1
    )
    assert "ModelWarning" not in answer.err
    assert ".py" not in answer.err


def test_a_poisson_ratio_of_zero_is_an_option_too(palpate, tmp_path):
    (tmp_path / "part.toml").write_text("", encoding="utf-8")
    answer = palpate("touch", tmp_path / "part.stl", "--poisson", "0")
    assert answer.code == 2
    assert "--poisson" in answer.err


@pytest.mark.full
def test_learning_is_watched(palpate, carried_out, tmp_path):
    folder = tmp_path / "watched"
    shutil.copytree(carried_out, folder)
    answer = palpate("learn", folder / "study.toml", "--watch", "--json")
    assert answer.code == 0, answer.err
    page = Path(json.loads(answer.out)["growth"])
    assert page.name == "small.growth.html"
    assert "How the network of small grew" in page.read_text(encoding="utf-8")
    refused = palpate("learn", folder / "small.zarr", "--watch")
    assert refused.code == 2
    assert "watched of a study" in refused.err
