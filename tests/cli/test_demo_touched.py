"""`palpate demo block --quick` and its commands one by one: a body from finite elements to a file that is felt."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from palpate.dataset import Dataset
from palpate.surrogates import Surrogate

# a minute on two free cores; a busy machine is no failure
pytestmark = [pytest.mark.full, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("demo")


def test_quick_demos_keep_their_limits_and_leave_everything_behind(palpate, folder):
    """The outcome is read, not the exit code alone."""
    names = ("block",)
    answer = palpate("demo", *names, "--quick", "--no-view", "--json", "--folder", folder)
    assert answer.code == 0, answer.out + answer.err
    told = json.loads(answer.out)
    for name in names:
        quick = f"{name}-quick"
        judged = told["studies"][quick]
        assert judged["passed"]
        assert judged["samples"] == 12
        grades = {check["name"]: check for check in judged["checks"]}
        assert grades["force_median"]["measured"] < 0.035
        assert grades["border_loop_work"]["measured"] < 1e-9
        assert "displacement_mean" in grades
        body = Surrogate.load(folder / f"{quick}.palpate")
        test = Dataset.open(folder / f"{quick}-random.zarr").ok
        # the file answers what was judged: without the command's own figures
        off = np.linalg.norm(body.energy.force(test.X) - test.force, axis=1)
        felt = np.linalg.norm(test.force, axis=1) > 0.05
        assert np.median(off[felt] / np.linalg.norm(test.force[felt], axis=1)) < 0.035
        assert body.meta["validation"]["limits kept"] is True
    page = (folder / "block-quick.html").read_text(encoding="utf-8")
    for heading in (
        "Force against depth",
        "Error on the touched surface",
        "Where to trust it",
        "Worst cases",
    ):
        assert page.count(f">{heading}<") == 1


def test_the_commands_take_what_the_demo_left(palpate, folder, tmp_path):
    """A study file of the same preset judges the same body; a changed one is refused."""
    from palpate.study import preset_study, to_toml

    study = preset_study("block", quick=True)
    for path in folder.glob("block-quick*"):
        (shutil.copytree if path.is_dir() else shutil.copy)(path, tmp_path / path.name)
    file = tmp_path / "study.toml"
    file.write_text(to_toml(study), encoding="utf-8")
    assert palpate("sweep", file).code == 0  # read, not solved again
    judged = palpate("validate", file, "--no-report")  # which the demo has written
    assert judged.code == 0, judged.out + judged.err
    assert "every limit kept" in judged.out
    assert "Shape, mean distance of nodes" in judged.out
    text = to_toml(study)
    assert text.count('"9 kPa"') == 1
    file.write_text(text.replace('"9 kPa"', '"8 kPa"'), encoding="utf-8")
    refused = palpate("validate", file)
    assert refused.code == 2
    assert "not of this study" in refused.err
