"""The psychometric function against its limits, and its posterior against one computed another way."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.stats import norm

from palpate.errors import UsageError
from palpate.experiments import JND, Answers, Psychometric


def test_limits_of_the_two_forms():
    far = np.array([-1e3, 0.0, 1e3])
    signed = Psychometric().probability(far, 0.0, 1.0, 0.04)
    assert signed == pytest.approx([0.02, 0.5, 0.98])
    correct = Psychometric("correct", guess=1 / 3).probability(far, 0.0, 1.0, 0.04, 1 / 3)
    assert correct == pytest.approx([1 / 3, 1 / 3 + (2 / 3 - 0.04) / 2, 0.96])
    # a JND is the difference that is told in three quarters of the trials
    assert Psychometric().probability(np.array(JND * 0.3), 0.0, 0.3, 0.0) == pytest.approx(0.75)


def test_the_posterior_is_the_one_of_a_much_finer_grid():
    x, total, yes = np.linspace(-0.5, 0.5, 5), np.full(5, 12.0), np.array([1.0, 3.0, 7.0, 10.0, 12.0])
    function = Psychometric(lapse=0.02, side=False, points=81)
    estimate = function.estimate(Answers(x, np.zeros(5), yes[None], total[None]))

    low, high = function.axes(x)[1][[0, -1]]
    mu, log_sigma = np.linspace(-0.5, 0.5, 801), np.linspace(low, high, 801)
    p = 0.01 + 0.98 * norm.cdf((x[:, None, None] - mu[:, None]) / np.exp(log_sigma))
    density = np.prod(p ** yes[:, None, None] * (1 - p) ** (12 - yes)[:, None, None], axis=0)
    for interval, nodes, axis in (
        (np.log(estimate.spread[0] / JND), log_sigma, 0),
        (estimate.location[0], mu, 1),
    ):
        below = cumulative_simpson(density.sum(axis=axis), x=nodes, initial=0.0)
        shares = np.interp(interval, nodes, below) / below[-1]
        assert shares == pytest.approx([0.025, 0.5, 0.975], abs=2e-3)


def test_a_side_preference_is_no_bias():
    """Perfectly balanced answers of a person with a side preference give their own μ and σ."""
    x = np.linspace(-0.6, 0.6, 9)
    level, order = np.tile(x, 2), np.repeat([-1.0, 1.0], 9)
    function = Psychometric(lapse=0.0)
    p = function.probability(level, 0.05, 0.2, 0.0, shift=0.08 * order)
    total = np.full((1, 18), 4000.0)
    own = function.estimate(Answers(level, order, np.round(p * 4000.0)[None], total))
    ignored = Psychometric(lapse=0.0, side=False).estimate(
        Answers(level, 0 * order, np.round(p * 4000.0)[None], total)
    )
    assert own.location[0, 1] == pytest.approx(0.05, abs=0.01)
    assert own.spread[0, 1] == pytest.approx(JND * 0.2, rel=0.02)
    assert own.side[0, 1] == pytest.approx(0.08, abs=0.01)
    assert ignored.spread[0, 1] > 1.05 * JND * 0.2  # left out, it would look like a larger JND


def test_goodness_tells_a_function_that_does_not_fit():
    x, total = np.linspace(-0.6, 0.6, 7), np.full((1, 7), 40.0)
    function = Psychometric(side=False)
    good = np.round(40.0 * function.probability(x, 0.0, 0.25, 0.02))[None]
    odd = np.array([[20.0, 2.0, 20.0, 20.0, 20.0, 38.0, 20.0]])
    fits = function.goodness(Answers(x, np.zeros(7), good, total))
    fails = function.goodness(Answers(x, np.zeros(7), odd, total))
    assert fits.p > 0.2
    assert fails.p < 0.01 < fits.p
    assert fails.deviance > fits.deviance >= 0.0


def test_wrong_counts_are_refused_in_words():
    with pytest.raises(UsageError, match="more answers of one kind"):
        Answers(np.zeros(2), np.zeros(2), np.array([[3.0, 0.0]]), np.array([[2.0, 1.0]]))
    with pytest.raises(UsageError, match="same level"):
        Psychometric().axes(np.zeros(3))
    with pytest.raises(UsageError, match="form"):
        Psychometric("logistic")  # type: ignore[arg-type]


def test_psignifit_agrees():
    """An oracle where it is installed: palpate doesn't depend on it."""
    psignifit = pytest.importorskip("psignifit")
    x, yes = np.linspace(-0.5, 0.5, 7), np.array([1, 2, 6, 10, 15, 18, 20])
    data = np.column_stack([x, yes, np.full(7, 20)])
    theirs = psignifit.psignifit(data, experiment_type="equal asymptote", sigmoid="norm")
    ours = Psychometric(side=False).estimate(
        Answers(x, np.zeros(7), yes[None].astype(float), np.full((1, 7), 20.0))
    )
    assert ours.location[0, 1] == pytest.approx(theirs.parameter_estimate_mean["threshold"], abs=0.05)
