"""A body held by a glued pad goes through every stage of a study, and through the commands that take a file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.cli import main
from palpate.study import preset_study, to_toml
from palpate.study.run import Paths, carry_out, report_study

pytestmark = [pytest.mark.full, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the files of a small grasp, and its study file."""
    where = tmp_path_factory.mktemp("grasp")
    study = preset_study("grasp", quick=True)
    few = {
        "sweep": {"samples": 8, "workers": 1},
        "test": {"samples": 4},
        "learning": {"effort": 0.1, "workers": 1},
    }
    study = study.model_copy(
        update={part: getattr(study, part).model_copy(update=new) for part, new in few.items()}
    )
    outcome = carry_out(study, Paths(where, study.name), progress=False)
    assert (len(outcome.train), len(outcome.test)) == (8, 4), "every solve converged"
    assert outcome.validation.force.median < 0.1
    assert outcome.validation.border_loops.max < 1e-9
    (where / "validation.json").write_text(json.dumps(outcome.validation.as_dict()), encoding="utf-8")
    report_study(where / "page.html", [outcome])
    (where / "study.toml").write_text(to_toml(study), encoding="utf-8")
    return where


def answered(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    capsys.readouterr()
    with pytest.raises(SystemExit) as stop:
        main([str(w) for w in words])
    return int(stop.value.code or 0), capsys.readouterr().out


def test_the_report_draws_the_force_against_the_displacement(folder: Path) -> None:
    page = (folder / "page.html").read_text(encoding="utf-8")
    for heading in ("Force against displacement", "Force error as a hand feels it", "Worst cases"):
        assert page.count(f">{heading}<") == 1


def test_study_and_file_are_validated_alike(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    by_study = json.loads((folder / "validation.json").read_text(encoding="utf-8"))
    by_file = json.loads(
        answered(capsys, "validate", folder / "grasp-quick.palpate", "--no-report", "--json")[1]
    )
    assert by_study["samples"] == by_file["samples"] == 4
    assert by_study["force"] == by_file["force"]


def test_a_pad_at_rest_feels_nothing_and_a_displaced_one_a_pull_back(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = folder / "grasp-quick.palpate"
    code, text = answered(capsys, "ask", file, "--at", "0.002,0,0,0.03,0.03", "--json")
    assert code == 0
    assert json.loads(text)["answers"][0]["force"][0] < 0
    at_rest = json.loads(answered(capsys, "ask", file, "--at", "0,0,0,0.03,0.03", "--json")[1])
    np.testing.assert_array_equal(at_rest["answers"][0]["force"], 0.0)
    assert pp.load(file).meta["name"] == "grasp-quick"


def test_the_loop_runs_on_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, text = answered(capsys, "run", folder / "grasp-quick.palpate", "--seconds", "0.5", "--json")
    assert code == 0
    assert json.loads(text)["largest_force"] > 0
