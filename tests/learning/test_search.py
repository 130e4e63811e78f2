"""The structure search on problems whose answers are known beforehand."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning.search import Budget, Candidate, Search, sizes
from palpate.rbf.forms import unit_form
from palpate.rbf.regressors import Regressors

REGRESSORS = Regressors(unit_form("axis-aligned", 1))


@dataclass
class Known:
    """Errors by the number of units, halved by every ten iterations; each evaluation takes so long."""

    errors: dict[int, float]
    seconds: float = 0.0

    def evaluate(self, candidate, iterations, seconds=None):
        time.sleep(self.seconds)
        done = candidate.iterations + iterations
        return replace(
            candidate, error=self.errors[len(candidate.theta)] * 0.5 ** (done / 10), iterations=done
        )


def units(count, start="test"):
    return Candidate(REGRESSORS, np.zeros((count, 2)), start)


def test_halving_gives_the_iterations_to_the_best():
    search = Search(Known({h: float(h) for h in range(1, 9)}))
    left = search.halve([units(h) for h in range(8, 0, -1)], [10, 20, 40])
    assert [len(one.theta) for one in left] == [1, 2]
    assert [one.iterations for one in left] == [70, 70]
    spent = {len(one.theta): one.iterations for one in search.tried}
    assert spent == {8: 10, 7: 10, 6: 10, 5: 10, 4: 30, 3: 30, 2: 70, 1: 70}
    assert len(search.best.theta) == 1


def test_growth_stops_at_the_target_or_where_more_units_gain_nothing():
    errors = {1: 5.0, 2: 4.0, 3: 4.5, 4: 4.2, 5: 1.0}
    search = Search(Known(errors))
    starts = lambda h, last: [units(h)]  # noqa: E731
    assert len(search.grow(starts, range(1, 6), 0).theta) == 5
    assert len(search.grow(starts, range(1, 6), 0, patience=2).theta) == 2
    search = Search(Known(errors))
    assert len(search.grow(starts, range(1, 6), 0, target=4.0).theta) == 2
    assert [trial.units for trial in search.trials] == [1, 2]


def test_growth_begins_with_the_best_so_far_and_sizes_are_judged():
    search, seen = Search(Known({h: 10.0 - h for h in range(1, 5)})), []

    def starts(h, last):
        seen.append(None if last is None else len(last.theta))
        return [units(h, "worse"), units(h)]

    judged = search.grow(starts, range(1, 5), 0, judge=lambda one: replace(one, error=float(len(one.theta))))
    assert seen == [None, 1, 1, 1]
    assert (len(judged.theta), judged.error) == (1, 1.0)
    assert [trial.error for trial in search.trials] == [1.0, 2.0, 3.0, 4.0]


def test_a_limit_on_time_ends_a_search_that_has_found_something():
    search = Search(Known({1: 1.0}, seconds=0.05), Budget.of(seconds=0.2))
    found = search.try_all([units(1) for _ in range(100)], 0)
    assert 1 <= len(found) < 50
    assert not search.try_all([units(1)], 0)
    late = Search(Known({1: 1.0}), Budget(deadline=time.monotonic() - 1.0))
    assert len(late.try_all([units(1), units(1)], 0)) == 1


def test_effort_multiplies_counts_and_is_checked():
    budget = Budget.of(0.25)
    assert (budget.count(16), budget.count(1), budget.count(16, 10)) == (4, 1, 10)
    assert budget.part(0.1) == budget
    assert not budget.over
    assert Budget.of(seconds=10.0).part(0.1).left == pytest.approx(1.0, abs=0.2)
    for wrong in (0.0, -1.0, np.nan, np.inf, "long", True):
        with pytest.raises(UsageError, match="The option"):
            Budget.of(wrong)
        with pytest.raises(UsageError, match="The option"):
            Budget.of(seconds=wrong)


def test_sizes_grow_by_a_third():
    assert sizes(1, 64) == [1, 2, 3, 4, 5, 6, 8, 11, 15, 20, 27, 36, 48, 64]
    assert sizes(6, 10) == [6, 8, 10]
    assert sizes(3, 2) == []
