"""`palpate demo block --quick`: a body from finite elements to a file that is felt."""

from __future__ import annotations

import json

import numpy as np
import pytest

from palpate.dataset import Dataset
from palpate.surrogates import Surrogate

# a minute on two free cores; a busy machine is no failure
pytestmark = [pytest.mark.full, pytest.mark.timeout(900)]


def test_quick_demos_keep_their_limits_and_leave_everything_behind(palpate, tmp_path):
    """The outcome is read, not the exit code alone."""
    words = ("demo", "block", "--quick", "--no-view", "--folder", tmp_path)
    answer = palpate(*words, "--json")
    assert answer.code == 0, answer.out + answer.err
    told = json.loads(answer.out)
    quick = "block-quick"
    judged = told["studies"][quick]
    assert judged["passed"]
    assert judged["samples"] == 12
    grades = {check["name"]: check for check in judged["checks"]}
    assert grades["force_median"]["measured"] < 0.035
    assert grades["border_loop_work"]["measured"] < 1e-9
    assert "displacement_mean" in grades
    body = Surrogate.load(tmp_path / f"{quick}.palpate")
    test = Dataset.open(tmp_path / f"{quick}-random.zarr").ok
    # the file answers what was judged: without the command's own figures
    off = np.linalg.norm(body.energy.force(test.X) - test.force, axis=1)
    felt = np.linalg.norm(test.force, axis=1) > 0.05
    assert np.median(off[felt] / np.linalg.norm(test.force[felt], axis=1)) < 0.035
    assert body.meta["validation"]["limits kept"] is True
    page = (tmp_path / "block-quick.html").read_text(encoding="utf-8")
    for heading in (
        "Force against depth",
        "Error on the touched surface",
        "Where to trust it",
        "Worst cases",
    ):
        assert page.count(f">{heading}<") == 1
    lines = palpate(*words).out.splitlines()
    assert 5 <= len(lines) <= 8
    assert lines[0] == "block-quick on 12 unseen solves: every limit kept"
    assert "than a person notices" in lines[1]
    assert "of it the mesh" in lines[1]
    assert lines[-1].endswith("palpate init --sample kidney.stl, palpate touch kidney.stl")
