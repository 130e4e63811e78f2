"""What a course says of simulated people, beside what is true; the large tables are in benchmarks/."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.experiments import (
    Adaptive,
    Constant,
    Course,
    Observer,
    Population,
    Psychometric,
    Staircase,
    equivalence,
    group_mean,
    power_curve,
    simulate_course,
)

FUNCTION = Psychometric()
PERSON = Observer(location=0.05, spread=0.2, lapse=0.02, side=0.04)


def courses():
    return {
        "constant": Course(Constant(np.linspace(-0.45, 0.45, 7), 140), FUNCTION, 140),
        "adaptive": Course(Adaptive(np.linspace(-0.6, 0.6, 25), FUNCTION), FUNCTION, 100, 4),
    }


@pytest.mark.parametrize("name", courses())
def test_intervals_hold_the_truth(name):
    people = 150
    result = simulate_course(courses()[name], PERSON, people, seed=7)
    chance = 3.0 * math.sqrt(0.05 * 0.95 / people)  # of a share that is 0.95
    assert result.spread_coverage == pytest.approx(0.95, abs=chance)
    assert result.location_coverage == pytest.approx(0.95, abs=chance)
    assert abs(result.bias) < 0.03 + 3.0 * result.scatter / math.sqrt(people)


def test_the_bias_of_a_staircase_is_told():
    course = Course(Staircase(np.geomspace(0.02, 0.6, 16)), FUNCTION, 80)
    result = simulate_course(course, Observer(lapse=0.02), 40, seed=1)
    assert result.reversals_bias is not None
    assert f"{result.reversals_bias:+.1%}" in str(result)


def test_fatigue_makes_a_jnd_larger_than_at_rest():
    course = Course(Constant(np.linspace(-0.6, 0.6, 7), 140), FUNCTION, 140)
    tired = simulate_course(course, Observer(fatigue=1.0), 100, seed=2)
    assert tired.bias > 0.2  # σ grows from 1 to 2 times: its mean is 1.5 times


def test_a_group_of_equal_people_has_the_mean_of_least_variance():
    """Without differences between people the weights are those of the errors, and τ is zero."""
    deviation = np.array([0.1, 0.2, 0.4])
    result = group_mean(np.array([1.0, 1.0, 1.0]), deviation)
    assert result.between == 0.0
    assert result.mean == pytest.approx(1.0)
    y = np.array([0.95, 1.1, 1.05])
    weights = deviation**-2 / (deviation**-2).sum()
    assert group_mean(y, deviation).mean == pytest.approx(weights @ y)


def test_the_interval_of_a_group_covers():
    rng, inside = np.random.default_rng(3), 0
    for _ in range(400):
        deviation = rng.uniform(0.05, 0.2, 8)
        y = 0.3 + rng.normal(0.0, 0.15, 8) + rng.normal(0.0, deviation)
        result = group_mean(y, deviation)
        inside += result.low <= 0.3 <= result.high
    assert inside / 400 == pytest.approx(0.95, abs=3.0 * math.sqrt(0.05 * 0.95 / 400))


def test_equivalence_keeps_its_level_and_is_shown_where_it_is_true():
    rng, at_margin, at_zero = np.random.default_rng(4), 0, 0
    for _ in range(800):
        jnd = 0.13 * np.exp(0.2 * rng.standard_normal(12))
        shift = rng.normal(0.0, 0.05, 12)
        at_margin += equivalence(shift + 0.5 * 0.13 * math.exp(0.02), jnd, 0.5).holds()
        at_zero += equivalence(shift, jnd, 0.5).holds()
    assert at_margin / 800 < 0.05 + 3.0 * math.sqrt(0.05 * 0.95 / 800)
    assert at_zero / 800 > 0.8


def test_power_grows_with_people_and_falls_with_the_shift():
    course = Course(Constant(np.linspace(-0.5, 0.5, 7), 56), FUNCTION, 56)
    same = power_curve(course, Population(Observer()), np.array([4, 16]), people=80)
    apart = power_curve(course, Population(Observer(location=0.13)), np.array([16]), people=80)
    assert same[0] < same[1]
    assert apart[0] < 0.05 < same[1]


def test_bad_input_is_refused_in_words():
    with pytest.raises(UsageError, match="two people"):
        group_mean(np.array([1.0]), np.array([0.1]))
    with pytest.raises(UsageError, match="margin"):
        equivalence(np.zeros(3), np.ones(3), 0.0)
    with pytest.raises(UsageError, match="spread"):
        Observer(spread=0.0)
