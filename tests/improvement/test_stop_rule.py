"""The rule that ends an improvement."""

from __future__ import annotations

import math

import pytest

from palpate.errors import UsageError
from palpate.improvement.stop_rule import StopRule


def reason(errors: list[float], *, complete: bool = True, solves: int = 20, seconds: float = 1.0) -> str:
    return StopRule(0.02, 60.0, 100).reason(errors, complete=complete, solves=solves, seconds=seconds)


@pytest.mark.parametrize(
    ("errors", "complete", "stops"),
    [
        ([0.01], True, True),  # one surrogate, judged once by solves that chose nothing
        ([0.01], False, False),
        ([0.05, 0.01], True, False),  # the first below may be luck
        ([0.05, 0.01, 0.015], True, True),
        ([0.05, 0.01, 0.015], False, False),
        ([0.01, 0.03], True, False),
        ([math.nan, 0.01], True, False),
        ([math.nan], True, False),
        ([], True, False),
    ],
)
def test_an_error_must_hold_twice_and_on_all_unseen_solves(errors, complete, stops):
    assert bool(reason(errors, complete=complete)) == stops


def test_limits_end_it_with_a_sentence():
    assert "60 s" in reason([0.5], seconds=60.0) or "1 min" in reason([0.5], seconds=60.0)
    assert "100 solves" in reason([0.5], solves=100)
    assert "1.5 % on unseen solves, 2 % were asked for" in reason([0.015])


@pytest.mark.parametrize(
    "wrong", [{"until": 0.0}, {"until": 2.0}, {"until": math.nan}, {"limit": -1.0}, {"most": 0}]
)
def test_a_rule_that_can_end_nothing_is_refused(wrong):
    with pytest.raises(UsageError):
        StopRule(**{"until": 0.02} | wrong)
