"""`palpate learn` prints the steps of its search, with a guess of the time that is left."""

from __future__ import annotations

import pytest

from palpate.cli.console import Console
from palpate.cli.learning_steps import LearningSteps
from palpate.learning.energy.energy_search import STEPS


def test_each_step_is_told_with_what_is_left_in_proportion_to_what_has_passed(capsys):
    """A machine that is twice as slow has twice as long to go."""
    told = []
    for slowness in (1.0, 2.0):
        times = iter(slowness * second for second in (100.0, 112.0, 140.0, 153.0))
        steps = LearningSteps(Console(), lambda times=times: next(times))
        for step in STEPS:
            steps.begin(step)
        told.append(capsys.readouterr().err.replace("\N{NO-BREAK SPACE}", " ").splitlines())
    assert [line.strip().partition(",")[0].removesuffix(" …") for line in told[0]] == list(STEPS)
    assert ["about" in line for line in told[0]] == [False, False, True, True]
    assert "about 80 s left" in told[0][2]
    assert told[0][0] == told[1][0]
    assert "about 2.7 min left" in told[1][2]


def test_a_short_search_needs_no_guess(capsys):
    times = iter((0.0, 0.1, 0.3, 0.5))
    steps = LearningSteps(Console(), lambda: next(times))
    for step in STEPS:
        steps.begin(step)
    assert "left" not in capsys.readouterr().err


@pytest.mark.full
def test_learning_a_dataset_tells_the_steps(palpate, tmp_path):
    from solved import unpack

    answer = palpate("learn", unpack("block", tmp_path / "block.zarr"), "--effort", "0.02")
    assert answer.code == 0, answer.err
    told = [line.strip().removesuffix(" …").partition(",")[0] for line in answer.err.splitlines()]
    assert [line for line in told if line in STEPS] in (list(STEPS), [*STEPS[:2], STEPS[3]])
