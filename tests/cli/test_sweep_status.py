"""`palpate sweep --status`: how far a sweep is, told from its files."""

from __future__ import annotations

import json

import pytest

import palpate as pp
from palpate.study import read_study
from palpate.study.study_lock import hold_study
from palpate.study.study_paths import Paths


@pytest.fixture
def study(palpate, tmp_path):
    path = tmp_path / "beam.toml"
    assert palpate("init", path, "--preset", "beam-nylon").code == 0
    return path


def test_status_of_a_sweep_that_is_interrupted_and_ends(palpate, study, tmp_path):
    assert "not begun" in palpate("sweep", study, "--status").out
    record = read_study(study).with_samples(16)
    paths = Paths(tmp_path, record.name)
    problem = record.problem()
    arguments = record.sweep.arguments(problem)

    def interrupt(done, total):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pp.sweep(problem, path=paths.data, workers=1, progress=interrupt, **arguments)
    with hold_study(paths, "palpate sweep"):
        said = json.loads(palpate("sweep", study, "--status", "--json").out)
        assert said["work"].startswith("palpate sweep, process")
    halfway = said["files"][str(paths.data)]
    assert 0 < halfway["solved"] < halfway["samples"] == 16
    assert halfway["failed"] == 0
    assert f"`palpate sweep {study}` goes on" in palpate("sweep", study, "--status").out
    pp.sweep(problem, path=paths.data, workers=1, progress=False, **arguments)
    assert "16 cases solved" in palpate("sweep", study, "--status").out


def test_a_study_without_solves_for_testing_lacks_none(palpate, study, tmp_path):
    text = study.read_text(encoding="utf-8")
    assert "random = 100" in text
    study.write_text(text.replace("random = 100", "random = 0"), encoding="utf-8")
    record = read_study(study).with_samples(9)
    data = Paths(tmp_path, record.name).data
    problem = record.problem()
    pp.sweep(problem, path=data, workers=1, progress=False, **record.sweep.arguments(problem))
    said = palpate("sweep", study, "--status").out
    assert "9 cases solved" in said
    assert "goes on" not in said


def test_one_cluster_at_a_time(palpate, study, tmp_path):
    answer = palpate("sweep", study, "--cluster", tmp_path / "none.toml", "--scheduler", "tcp://127.0.0.1:1")
    assert answer.code == 2
    assert "two clusters" in answer.err
    assert palpate("sweep", study, "--cluster", tmp_path / "none.toml").code == 2
