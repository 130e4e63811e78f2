"""`palpate sweep` of a study with `[solver]`: the command is printed, and no other command runs it."""

from __future__ import annotations

import json

import pytest

import palpate as pp
from sweeps.heated_bars import STUDY, heated_bar


def test_no_other_command_runs_the_program(palpate, tmp_path):
    path = heated_bar(tmp_path)
    for command in ("learn", "validate"):
        answer = palpate(command, path)
        assert answer.code == 2
        assert "Only `palpate sweep` starts that program" in answer.err
    assert sorted(file.name for file in tmp_path.iterdir()) == ["bar.toml", "templates"]


@pytest.mark.full
def test_the_command_is_printed_and_its_dataset_is_learnt(palpate, tmp_path):
    path = heated_bar(tmp_path, samples=2, random=4, study=STUDY.replace('"grid"', '"sobol"'))
    swept = palpate("sweep", path, "--samples", 24, "--workers", 2, "--json")
    assert swept.code == 0
    assert "heated_bar.py" in swept.err  # also beside --json
    said = json.loads(swept.out)
    assert (said["rows"], said["failed"]) == (28, 0)
    assert palpate("learn", tmp_path / "bar.zarr").code == 0
    model = pp.load(tmp_path / "bar.palpate")
    # temperature and heat are linear in the power
    assert palpate("validate", tmp_path / "bar.palpate", "--json").code in {0, 1}
    assert abs(model.predict([[5.0]])[0, 0] - 5.0) < 1e-3
