"""A study whose solves another program makes: every way to fail costs its case, and nothing else."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest

import palpate as pp
from palpate.errors import SolverError, StudyError, UsageError
from palpate.processes import helper_environment
from palpate.study import read_study
from palpate.study.solver_study import SolverStudy, read_solver_study
from palpate.study.solver_sweep import sweep_solver
from sweeps.heated_bars import STUDY, heated_bar

FAULTS = (
    ("hangs", 0.5, 1.5),
    ("exits", 1.5, 2.5),
    ("silent", 2.5, 3.5),
    ("nan", 3.5, 4.5),
    ("half", 5.5, 6.5),
    ("remeshed", 6.5, 7.5),
)


def run(path, limit=30.0):
    said = []
    study = read_solver_study(path)
    return sweep_solver(study, path.parent, limit=limit, progress=False, announce=said.append), said


def solver_of(path):
    problem = read_solver_study(path).problem(path.parent, 30.0)
    problem.check()
    return problem


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Solves of a bar at 1 to 20 W of which six go wrong, and the folder."""
    study = STUDY.replace('"0 W", "10 W"', '"0 W", "20 W"').replace("[test]", "workers = 2\n\n[test]")
    path = heated_bar(tmp_path_factory.mktemp("bar"), faults=FAULTS, samples=21, limit=5.0, study=study)
    solves, said = run(path)
    return path.parent, solves, said


def test_every_failure_costs_its_case_and_says_so(swept):
    folder, solves, said = swept
    data = solves.data
    assert len(said) == 1
    assert "heated_bar.py" in said[0]
    assert len(data) == 21
    power = data.X[:, 0].round(9)
    wrong = np.isin(power, [1, 2, 3, 4, 6, 7])
    np.testing.assert_array_equal(data.converged, ~wrong)
    # T = power · x / length, at the five nodes of a bar of 0.4 m
    np.testing.assert_allclose(data["temperature"][~wrong], np.outer(power[~wrong], np.linspace(0, 1, 5)))
    np.testing.assert_allclose(data.rest[:, 0], np.linspace(0, 0.4, 5))
    words = dict(zip(power, map(str, data.message), strict=True))
    assert "took longer than 5 s and was ended" in words[1]
    assert "exit code 1" in words[2]
    assert "ERROR: the matrix is singular" in words[2]
    assert "wrote no case-" in words[3]
    assert "temperature" in words[4]
    assert "can't be read" in words[6]
    assert "7 nodes have answers, 5 in the first case" in words[7]
    assert all("heated bar: power" in words[p] for p in (1, 2, 3, 4, 6, 7))
    # folders are kept where the case failed, and nothing else is
    kept = [path.name for path in (folder / "bar.cases").iterdir()]
    assert len(kept) == 6
    assert all(f"bar.cases/{name}" in " ".join(words.values()) for name in kept)


def test_a_program_that_hangs_is_ended_with_all_that_it_started(swept):
    folder, _, _ = swept
    (note,) = (folder / "bar.cases").glob("*/processes.txt")
    assert not psutil.pid_exists(int(note.read_text()))
    sleepers = [p for p in psutil.process_iter(["cwd"]) if (p.info["cwd"] or "").startswith(str(folder))]
    assert sleepers == []


def test_the_dataset_is_one_like_an_imported_one(swept, tmp_path):
    folder, _, _ = swept
    data = pp.Dataset.open(folder / "bar.zarr").ok
    points = np.stack([400 * np.linspace(0, 1, 5), np.zeros(5), np.zeros(5)], axis=1)
    arrays = {
        "points": points,
        "temperature": data["temperature"],
        "heat": data["heat"],
        "power": data.X[:, 0],
    }
    np.savez(tmp_path / "bar.npz", **arrays)
    mapping = read_solver_study(folder / "bar.toml").mapping
    imported = pp.import_results(
        tmp_path / "bar.npz", {**mapping, "inputs": [{"name": "power", "unit": "W"}]}
    ).dataset
    np.testing.assert_array_equal(imported["heat"], data["heat"])
    np.testing.assert_array_equal(imported.rest, data.rest)
    np.testing.assert_array_equal(imported["temperature"], data["temperature"])
    assert imported.provenance["problem"]["body"]["type"] == data.provenance["problem"]["body"]["type"]
    assert [str(r) for r in imported.ranges] == [str(r) for r in data.ranges]


@pytest.mark.full
def test_a_finished_sweep_starts_no_program_and_a_larger_one_only_what_is_new(tmp_path):
    log = tmp_path / "log.txt"
    path = heated_bar(tmp_path, samples=4, random=2, log=log, study=STUDY.replace('"grid"', '"sobol"'))
    solves, _ = run(path)
    assert len(solves.data) == 4
    assert len(solves.unseen) == 2
    begun = log.read_text().count("begin")
    assert begun == 4 + 2 + 1  # and the first case, which says what the others look like
    assert not (tmp_path / "bar.cases").exists()
    run(path)
    assert log.read_text().count("begin") == begun
    path.write_text(path.read_text().replace("samples = 4", "samples = 6"))
    more, _ = run(path)
    assert len(more.data) == 6
    assert log.read_text().count("begin") == begun + 2 + 1
    np.testing.assert_array_equal(more.data["temperature"][:4], solves.data["temperature"])


@pytest.mark.full
def test_twenty_kills_lose_nothing(tmp_path):
    log = tmp_path / "log.txt"
    path = heated_bar(tmp_path, samples=12, seconds=0.3, log=log)
    command = [sys.executable, "-m", "palpate", "sweep", str(path), "--workers", "2", "--json"]
    rng, kills, finished = np.random.default_rng(0), 0, False
    while not finished:
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=helper_environment()
        )
        before = log.read_text().count("begin") if log.exists() else 0
        try:
            # killed by turns while the run starts, and at some time after its first program has begun, of which there
            # is one each 0.15 s
            if kills < 20 and kills % 2:
                time.sleep(rng.uniform(0.0, 1.0))
            while kills < 20 and not kills % 2 and process.poll() is None:
                if log.exists() and log.read_text().count("begin") > before:
                    time.sleep(rng.uniform(0.0, 0.3))
                    break
                time.sleep(0.01)
            if kills < 20 and process.poll() is None:
                process.send_signal(signal.SIGKILL)
                kills += 1
        finally:
            out, _ = process.communicate(timeout=60)
        finished = process.returncode == 0
    assert json.loads(out)["failed"] == 0
    data = pp.Dataset.open(tmp_path / "bar.zarr")
    np.testing.assert_allclose(data["temperature"][:, -1], data.X[:, 0])
    # no case ended well more than once, but for one that was killed between its end and the file of its answers
    ends = [line for line in log.read_text().splitlines() if line.startswith("end")]
    assert len(set(ends)) == 12 + 1
    assert len(ends) <= len(set(ends)) + kills // 5
    assert not [p for p in psutil.process_iter(["cwd"]) if (p.info["cwd"] or "").startswith(str(tmp_path))]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{{ power | mW }}", "{{ force | mW }}", "names 'force', which has no value"),
        ("{{ power | mW }}", "{{ power }}", "the unit of 'power' is missing"),
        ("{{ power | mW }}", "{{ power | mm }}", "can't be written in mm"),
        ("{{ power | mW }}", "1", "No template in .* names the input 'power'"),
        ("{{ power | mW }}", "{{ power * 2 | mW }}", "has no value"),
        ("{{ power | mW }}", "{{ power | mW | 3 }}", "is no name with a unit"),
    ],
)
def test_templates_that_cannot_be_filled_are_refused_by_name_and_line(tmp_path, old, new, said):
    path = heated_bar(tmp_path)
    template = tmp_path / "templates" / "{case}.in"
    template.write_text(template.read_text().replace(old, new))
    with pytest.raises(UsageError, match=said) as refused:
        solver_of(path)
    assert "templates" in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"0 W", "10 W"', '"0 W", "10 mm"', "its ends are in W and m"),
        ('"0 W", "10 W"', '"3 W", "3 W"', "it does not vary"),
        ('"0 W", "10 W"', '"0 W", "10 flurbs"', "flurbs"),
        ('length = "40 cm"', 'power = "40 cm"', "two inputs or values are called 'power'"),
        ("[solver]", "[solver]\nshell = true", "shell"),
        ("limit =", "limit = 0 #", "no time"),
    ],
)
def test_studies_that_mean_nothing_are_refused(tmp_path, old, new, said):
    path = heated_bar(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(StudyError, match=said):
        read_solver_study(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"{python}", "{templates}', '"no-such-program", "{templates}', "no program 'no-such-program'"),
        ('"{case}"]\nraw', '"{row}"]\nraw', "{row} stands for nothing"),
        ('["{case}.npz"]', '["../{case}.npz"]', "do not lie in the folder"),
        ("[mapping.units]", "[[mapping.inputs]]\nname = 'x'\n[mapping.units]", "says 'inputs'"),
    ],
)
def test_commands_that_cannot_run_are_refused_before_anything_runs(tmp_path, old, new, said):
    path = heated_bar(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(UsageError, match=said):
        solver_of(path)


def test_a_solver_that_never_answers_is_refused_after_three_cases(tmp_path):
    problem = solver_of(heated_bar(tmp_path, faults=(("exits", 0, 11),)))
    with pytest.raises(SolverError, match="None of the first 3 cases") as refused:
        _ = problem.layout
    assert "the matrix is singular" in str(refused.value)


def test_output_that_means_failure_is_a_failure_in_spite_of_exit_code_0(tmp_path):
    study = STUDY.replace('limit = "LIMIT s"', 'limit = "LIMIT s"\nfailure = ["*ERROR"]')
    problem = solver_of(heated_bar(tmp_path, faults=(("says", 8, 11),), study=study))
    solver = problem.open()
    assert solver.solve(np.array([7.0])).converged
    answer = solver.solve(np.array([9.0]))
    assert not answer.converged
    assert "printed '*ERROR'" in answer.message


def test_no_shell_reads_the_command(tmp_path):
    study = STUDY.replace('"{case}"]\nraw', '"{case}", "; touch shell.txt; $(touch shell.txt)"]\nraw')
    problem = solver_of(heated_bar(tmp_path, study=study))
    assert problem.open().solve(np.array([2.0])).converged
    assert not list(tmp_path.rglob("shell.txt"))


def test_learn_and_validate_never_read_it_as_a_study(tmp_path):
    path = heated_bar(tmp_path)
    with pytest.raises(StudyError, match="Only `palpate sweep` starts that program"):
        read_study(path)
    assert sorted(os.listdir(tmp_path)) == ["bar.toml", "templates"]


def test_numbers_in_templates_fit_twenty_columns_and_lose_nothing_that_matters(tmp_path):
    path = heated_bar(tmp_path)
    problem = solver_of(path)
    for value in (-1.2345678901234567e-12, 9.876543210987654e11, 1 / 3):
        target = tmp_path / "written"
        shutil.rmtree(target, ignore_errors=True)
        problem.templates.write(target, "one", {"power": (value, "W"), "length": (0.4, "m")})
        said = json.loads((target / "one.in").read_text())
        np.testing.assert_allclose(said["power in mW"], 1000 * value, rtol=1e-11)
        assert max(map(len, (target / "one.in").read_text().split())) <= 20
        assert said["length in mm"] == 400


def test_a_mapping_may_stand_in_a_file(tmp_path):
    path = heated_bar(tmp_path)
    head, _, rest = path.read_text().partition("[mapping.units]")
    columns, _, tail = rest.partition("[sweep]")
    (tmp_path / "columns.toml").write_text("[units]" + columns.replace("[[mapping.", "[["))
    path.write_text('mapping = "columns.toml"\n' + head + "[sweep]" + tail)
    study = read_solver_study(path)
    assert isinstance(study, SolverStudy)
    assert [entry.name for entry in study.results_mapping(tmp_path).outputs] == ["temperature", "heat"]
