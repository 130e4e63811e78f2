"""`palpate sweep --until` of a study with `[solver]`: cases are chosen until the error of its answers is kept."""

from __future__ import annotations

import json

import pytest

import palpate as pp
from sweeps.heated_bars import STUDY, heated_bar

SOBOL = STUDY.replace('"grid"', '"sobol"')


def test_what_nobody_judges_has_no_error_to_keep(palpate, tmp_path):
    answer = palpate("sweep", heated_bar(tmp_path, random=0), "--until", "2%")
    assert answer.code == 2
    assert "random = 20" in answer.err
    answer = palpate("sweep", heated_bar(tmp_path), "--minutes", "3")
    assert answer.code == 2
    assert "Give --until" in answer.err


@pytest.mark.full
def test_cases_are_chosen_until_the_error_is_kept_and_an_earlier_sweep_is_taken_up(palpate, tmp_path):
    path = heated_bar(tmp_path, random=8, study=SOBOL, faults=[("exits", 9.9, 9.95)])
    done = palpate("sweep", path, "--until", "0.1%", "--workers", 2, "--json")
    assert done.code == 0, done.err
    said = json.loads(done.out)
    assert said["reached"] is True
    assert "heated_bar.py" in done.err
    assert len(pp.Dataset.open(tmp_path / "bar.zarr").ok) == said["steps"][-1]["solves"] >= 20
    model = pp.load(tmp_path / "bar.palpate")
    assert abs(model.predict([[5.0]])[0, 0] - 5.0) < 1e-2, "the heat is the power"
    plain = palpate("sweep", path, "--samples", said["steps"][-1]["solves"], "--workers", 2)
    assert plain.code == 0, "its unseen solves are those of a plain sweep"
    missed = palpate("sweep", path, "--until", "1e-15", "--samples", 24, "--workers", 2)
    assert missed.code == 1
    assert "The limit of 24 solves is reached. Everything is kept." in missed.err
    assert len(pp.Dataset.open(tmp_path / "bar.zarr")) == 24
    assert not (tmp_path / "bar.zarr.batch").exists()
