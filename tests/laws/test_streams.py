"""Sequential learning on the common data sets: it does not regress, and with refinement it ends where batch does."""

from __future__ import annotations

import pytest
from benchmarks.cases import case
from benchmarks.online import RATIO, at_once, streamed, streams
from benchmarks.stability import REGRESSION, run

pytestmark = [pytest.mark.full, pytest.mark.timeout(600)]


# three and six inputs take longer: `python -m benchmarks.online` has them, and claims the same
@pytest.mark.parametrize("name", ["copper", "nylon"])
def test_bounded_refinement_ends_within_three_times_the_batch_error_at_equal_units(name):
    stream = next(s for s in streams() if s.name == name)
    error, units, _, _ = streamed(stream, seed=0)
    batch, _ = at_once(stream, units, [0])
    assert error < RATIO * batch[0]


# orders in which the filter regressed while it remembered 50 observations, judged each step by itself, or gave
# every new unit its weight at once
@pytest.mark.parametrize(
    ("beam", "factor", "seed"),
    [
        ("nylon", 0.1, 4),
        ("nylon", 0.1, 22),
        ("nylon", 0.1, 30),
        ("nylon", 0.1, 48),
        ("nylon", 1.0, 30),
        ("copper", 0.1, 16),
    ],
)
def test_the_pure_filter_does_not_regress(beam, factor, seed):
    assert run(case(beam), factor, seed).regression < REGRESSION
