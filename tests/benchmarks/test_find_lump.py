"""The observer of hidden lumps: its threshold, its choice of presses and a hand's noise."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.find_lump import FALSE_ALARMS, Felt, Observer


def _observer(height: float) -> Observer:
    """An observer of 16 places, under each of which a lump may add a share of the force there."""
    force = 2.0 * np.vstack([np.ones(16), 1.0 + height * np.eye(16)])
    return Observer(Felt.of(force, np.zeros_like(force)))


def test_a_hand_is_fainter_below_one_newton_and_goes_astray():
    felt = Felt.of(np.array([2.0, 0.5, 2.0]), np.array([0.0, 0.0, 0.3]))
    np.testing.assert_allclose(felt.noise, [0.14, 0.05, np.hypot(0.14, 0.3)])


def test_one_examination_in_twenty_without_a_lump_is_above_the_threshold():
    observer = _observer(0.08)
    threshold = observer.threshold(600)
    none = observer.expected.row(0)
    alarms = observer.share_above(Felt(none.force[None], none.noise[None]), threshold, 400, 1)
    assert abs(alarms - FALSE_ALARMS) < 4 * np.sqrt(FALSE_ALARMS / 400 + FALSE_ALARMS / 600)


def test_the_log_is_that_of_the_likelihoods_of_one_press():
    """Without noise in the truth, of one lump and one place: (F − μ₀)²/2σ₀² − (F − μ₁)²/2σ₁² + ln σ₀/σ₁."""
    observer = Observer(Felt(np.array([[1.0], [1.2]]), np.array([[0.1], [0.2]])))
    log, weight = observer.examine(Felt(np.array([1.3]), np.zeros(1)), 1, np.random.default_rng(0))
    assert log == pytest.approx(0.3**2 / 0.02 - 0.1**2 / 0.08 + np.log(0.5))
    assert weight.tolist() == [1.0]


def test_chosen_presses_locate_a_lump_better_than_random_ones():
    observer, rng = _observer(0.25), np.random.default_rng(2)
    places = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    ways = (
        lambda truth: observer.examine(truth, 20, rng, places),
        lambda truth: observer.examine_at_random(truth, 20, rng),
    )
    chosen, random = (
        np.mean(
            [
                np.linalg.norm(way(observer.expected.row(1 + i % 16))[1] @ places - places[i % 16])
                for i in range(160)
            ]
        )
        for way in ways
    )
    assert chosen < 0.8 * random
