"""The ordinal model of ratings: special cases with a known answer, and simulated raters."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.experiment_plans import simulate_raters
from scipy.special import logit

from palpate.experiments.ratings import cumulative_logit


def test_two_ratings_of_many_equal_people_are_a_logistic_regression():
    """With two ratings used and people alike, the effect is the difference of log odds."""
    counts = np.zeros((40, 2, 7))
    counts[:, 0, [2, 4]], counts[:, 1, [2, 4]] = (14, 6), (8, 12)
    design = np.zeros((40, 2, 1))
    design[:, 1] = 1.0
    effects, _ = cumulative_logit(counts, design)
    assert effects[0, 1] == pytest.approx(logit(0.6) - logit(0.3), abs=0.03)
    deviation = np.sqrt((1 / 14 + 1 / 6 + 1 / 8 + 1 / 12) / 40)  # of a log odds ratio (Woolf 1955)
    assert (effects[0, 2] - effects[0, 0]) / 2.0 == pytest.approx(1.96 * deviation, rel=0.05)


def test_turned_scales_turn_the_sign():
    counts, design = simulate_raters(np.random.default_rng(1), people=8, ratings=4, effects=(0.7, -0.8, 0.4))
    effects, spread = cumulative_logit(counts, design, 2)
    turned, same = cumulative_logit(counts[:, :, ::-1], design, 2)
    assert turned[:, 1] == pytest.approx(-effects[:, 1], abs=0.02)
    assert same == pytest.approx(spread, rel=0.02)


def test_ratings_that_are_all_apart_have_a_finite_effect():
    counts = np.zeros((4, 2, 7))
    counts[:, 0, 0], counts[:, 1, 6] = 5, 5
    design = np.zeros((4, 2, 1))
    design[:, 1] = 1.0
    effects, _ = cumulative_logit(counts, design)
    assert np.isfinite(effects).all()
    assert effects[0, 0] > 0.0
