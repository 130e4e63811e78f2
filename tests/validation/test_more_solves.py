"""The number of solves that is advised after a miss, on errors that fall by a known law."""

from __future__ import annotations

import pytest

from palpate.validation import Validation
from palpate.validation.limits import CRITERIA, Check
from palpate.validation.more_solves import advice_on_solves, learning_curve
from palpate.validation.report.body_words import solid_words
from solved import solved

CRITERION = {c.key: c for c in CRITERIA}
COMMAND = "palpate sweep s.toml --samples"


def judged(**measured: float) -> Validation:
    """A body with these figures, of which each is asked to be 8 %."""
    checks = tuple(Check(CRITERION[key], value, 0.08) for key, value in measured.items())
    return Validation("body", 20, checks, ())


def test_without_a_curve_errors_are_taken_to_fall_as_one_over_the_number() -> None:
    words = advice_on_solves(judged(stiffness_p95=0.35, force_p95=0.09), 9, (), COMMAND)
    # 1.1 · 9 · 35/8 = 43.3, in fives; 35 % · 9/45 = 7 %
    assert words == (
        "Stiffness error from 9 solves is 35 %, 8 % is asked: 45 solves reach about 7 % if errors fall as one over "
        "the number of solves; palpate sweep s.toml --samples 45"
    )


@pytest.mark.parametrize("exponent", [0.7, 1.5])
def test_with_a_curve_its_own_fall_counts(exponent: float) -> None:
    def error(solves: int) -> float:
        return 0.3 * (solves / 20) ** -exponent

    curve = learning_curve((), 10, judged(force_p95=error(10)))
    curve = learning_curve(curve, 20, judged(force_p95=error(20)))
    assert [point["solves"] for point in curve] == [10, 20]
    words = advice_on_solves(judged(force_p95=error(20)), 20, curve, COMMAND)
    assert "by the curve so far" in words
    number = int(words.rpartition(" ")[2])
    assert error(number) <= 0.08 < error(int(number / 1.3))


def test_what_more_solves_do_not_help_is_not_advised() -> None:
    assert advice_on_solves(judged(force_p95=0.07), 20, (), COMMAND) == ""
    assert advice_on_solves(judged(loop_work=1.0), 20, (), COMMAND) == ""
    hopeless = advice_on_solves(judged(force_p95=8.0), 20, (), COMMAND)
    assert "more than 20 times as many solves" in hopeless
    assert COMMAND not in hopeless
    assert not hopeless.endswith("."), "reports put the full stop"


def test_a_point_of_as_many_solves_is_replaced() -> None:
    curve = learning_curve([{"solves": 10, "force_p95": 0.3}], 10, judged(force_p95=0.2))
    assert curve == [{"solves": 10, "force_p95": 0.2}]


def test_a_solid_is_told_in_one_sentence() -> None:
    assert solid_words(solved("block")) == (
        "Block 60 × 60 × 30 mm: 247 nodes; body neo-Hookean (E = 9 kPa); fixed at bottom; pressed at top by a ball of "
        "radius 10 mm, 0 to 6 mm deep."
    )
    assert solid_words(None) == ""
