"""Following a stream as a learner does by itself: outliers, jumps, drift, noise by place; the algebra of the bank."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning import Following, Learner, Observation, default
from palpate.learning.stream.refining import Refining
from palpate.learning.stream.scales import Scales, search_scales
from palpate.learning.stream.tracker import Tracker
from palpate.learning.stream.tracker_kernels import measure, mix
from palpate.units import Quantity, Range

PLACE = (Range("x", -1.0, 1.0, "m"),)
FORCE = (Range("F", -1.5, 1.5, "N"),)
GRID = np.linspace(-0.95, 0.95, 101)[:, None]
NOISE = 0.02


def bend(X):
    return np.sin(3.0 * X)


def steps(X):
    return np.cos(2.0 * X) - 0.3


def follow(truth, N=400, *, outliers=0.0, noise=lambda x: NOISE, seed=0, learner=None):
    """A learner after N readings of truth(x, t), and its events."""
    rng = np.random.default_rng(seed)
    learner = learner or Learner(PLACE, FORCE)
    events = []
    for t in range(N):
        x = rng.uniform(-1.0, 1.0, 1)
        y = truth(x, t) + noise(x) * rng.normal(size=1)
        if rng.uniform() < outliers:
            y = y + 20.0 * NOISE * rng.choice([-1.0, 1.0])
        events.append(learner.observe(x, y))
    return learner, events


@functools.cache
def followed():
    """A learner of the still map, and its events; several tests compare with it."""
    return follow(lambda x, t: bend(x))


def rms(learner, truth):
    return float(np.sqrt(((learner.network.predict(GRID) - truth(GRID)) ** 2).mean()))


def test_outliers_are_named_and_leave_the_network_as_it_would_be_without_them():
    clean, _ = followed()
    dirty, events = follow(lambda x, t: bend(x), outliers=0.05)
    assert rms(dirty, bend) < 2.0 * rms(clean, bend) < 0.5 * NOISE
    assert 10 <= sum(e.outlier for e in events) <= 30
    assert not any(e.changed for e in events)
    assert dirty.expected == pytest.approx(NOISE / 1.5, rel=0.4)  # in scaled outputs


def test_a_jump_is_told_where_it_was_and_followed():
    learner, events = follow(lambda x, t: bend(x) if t < 300 else steps(x), N=420)
    noticed = [t for t, e in enumerate(events) if e.changed]
    assert len(noticed) == 1
    assert 300 <= noticed[0] < 315
    assert 300 <= learner.state.changed_at <= 310  # the 301st reading is the first of the new map
    fresh, _ = follow(lambda x, t: steps(x), N=120)
    assert rms(learner, steps) < 2.0 * rms(fresh, steps)


def test_drift_is_told_and_followed():
    still, _ = followed()
    moving, events = follow(lambda x, t: (1.0 - t / 600.0) * bend(x), N=600)
    assert moving.state.drifts > 0.8 > 0.5 > still.state.drifts
    assert not any(e.changed for e in events)
    assert rms(moving, lambda X: 0.0 * X) < 2.0 * NOISE


def test_noise_is_learnt_by_place():
    learner, events = follow(lambda x, t: bend(x), N=600, noise=lambda x: 0.02 * 10.0 ** (0.5 + 0.5 * x[0]))
    tracker = learner._follower._tracker
    for x, said in ((-0.8, 0.025), (0.0, 0.063), (0.8, 0.16)):
        assert 1.5 * np.sqrt(tracker.noise_at(np.array([x]))) == pytest.approx(said, rel=0.35)
    assert sum(e.outlier for e in events) < 15


@pytest.mark.grid
@pytest.mark.parametrize("settings", [Following(), default()], ids=["following", "refined"])
@pytest.mark.parametrize("declared", [True, False])
def test_an_early_spike_is_survived(settings, declared):
    """A sweep of a force sensor, whose fourth reading is a hundred times too large."""
    output = Range("F", 0.0, 0.7, "N") if declared else Quantity("F", "N")
    learner = Learner([Range("d", 0.0, 10.0, "mm")], [output], settings=settings)
    depth, rng = 5.0 + 4.8 * np.sin(0.084 * np.arange(300)), np.random.default_rng(1)
    for t, d in enumerate(depth):
        force = 80.0 if t == 3 else 0.02 * d**1.5 + rng.normal(0.0, 0.002)
        learner.observe(np.array([d]), np.array([force]))
    asked = np.linspace(0.3, 9.7, 100)[:, None]
    assert np.abs(learner.network.predict(asked) - 0.02 * asked**1.5).max() < 0.01


def test_asking_for_a_filter_or_a_refinement_gives_the_sequential_one():
    assert Learner(PLACE, FORCE).following == Following()
    assert Learner(PLACE, FORCE, refining=None).following is None
    assert Learner(PLACE, FORCE, refining=Refining(every=5)).following is None
    assert Learner(PLACE, FORCE, settings=default()).following is None
    with pytest.raises(UsageError, match="units_max"):
        Following(units_max=0)


def streams(rng, t, n):
    """Readings that are hard on a filter, in turns of a hundred."""
    kinds = (
        lambda: (np.zeros(n), np.ones(3)),
        lambda: (np.full(n, float(t % 2)), np.full(3, t % 2)),
        lambda: (rng.uniform(-1, 1, n), np.full(3, 0.25)),
        lambda: (rng.uniform(-1, 1, n), rng.normal(size=3)),
        lambda: (rng.uniform(-1, 1, n), np.full(3, 1e5 if t % 17 == 16 else 0.1)),
        lambda: (1e-9 * rng.uniform(-1, 1, n), 1e-9 * rng.normal(size=3)),
        lambda: (1.9 * rng.uniform(-1, 1, n), rng.normal(size=3)),
    )
    return kinds[(t // 100) % len(kinds)]()


@pytest.mark.full
@pytest.mark.parametrize("n", [1, 6])
def test_no_stream_of_numbers_stops_the_loop(n):
    rng = np.random.default_rng(0)
    learner = Learner(
        [Range(f"x{i}", -1.0, 1.0) for i in range(n)], [Range(f"y{j}", -1, 1) for j in range(3)]
    )
    for t in range(700):
        learner.observe(*streams(rng, t, n))
    assert np.isfinite(learner.network.predict(rng.uniform(-1, 1, (50, n)))).all()
    assert learner.state.units <= 50
    values = np.linalg.eigvalsh(learner.state.covariance.matrix)
    assert values.min() > -1e-9 * values.max()


def test_slopes_and_curvatures_are_learnt():
    """Of a parabola in two inputs: few values with derivatives beat as many without them."""
    inputs = (Range("a", -1.0, 1.0), Range("b", 0.0, 4.0, "N"))
    rng, errors = np.random.default_rng(0), []
    X = np.column_stack([rng.uniform(-1, 1, 300), rng.uniform(0, 4, 300)])

    def truth(X):
        return X[:, :1] * X[:, 1:] / 2.0 + 0.5 * X[:, :1] ** 2

    for derivatives in (False, True):
        learner = Learner(inputs, [Range("y", -3.0, 3.0)])
        for x in X[:15]:
            more = {
                "slopes": np.array([[x[1] / 2.0 + x[0], x[0] / 2.0]]),
                "curvatures": np.array([[1.0, 0.5, 0.0]]),
            }
            learner.observe(x, truth(x[None])[0], **(more if derivatives else {}))
        errors.append(np.sqrt(((learner.network.predict(X) - truth(X)) ** 2).mean()))
    assert errors[1] < 0.3 * errors[0]


def test_the_network_is_the_mixture_of_the_bank():
    learner, _ = follow(lambda x, t: bend(x), N=60)
    tracker = learner._follower._tracker
    np.testing.assert_allclose(learner.network.predict(GRID), 1.5 * tracker.predict(GRID), atol=1e-9)
    assert learner.numbers < 7 * (learner.state.units + 2) ** 2 + 60 * 4 + 400


def test_a_new_unit_changes_no_prediction():
    learner, _ = follow(lambda x, t: bend(x), N=30)
    tracker = learner._follower._tracker
    before, deviation = tracker.predict(GRID), tracker.covariance[0, 0]
    x = np.array([1.7])
    phi = tracker.activations(x)
    lever = tracker.inverse @ phi
    tracker._add(x, phi, lever, tracker.scales.variance * (1.0 - phi @ lever))
    np.testing.assert_allclose(tracker.predict(GRID), before, atol=1e-7)
    assert tracker.covariance[0, 0] == pytest.approx(deviation)


def test_readings_one_by_one_are_least_squares_of_all_of_them():
    """A filter that doubts nothing and forgets nothing: ridge regression with the prior as its penalty."""
    rng = np.random.default_rng(0)
    A, Y, r = rng.normal(size=(40, 7)), rng.normal(size=(40, 2)), 0.3
    prior = np.diag(rng.uniform(0.5, 2.0, 7))
    means, covariances = np.zeros((1, 7, 2)), prior[None].copy()
    for a, y in zip(A, Y, strict=True):
        measure(a, 0.0, r, y, np.ones(2), 0.0, 10.0, np.ones(1), means, covariances)
    P = np.linalg.inv(np.linalg.inv(prior) + A.T @ A / r)
    np.testing.assert_allclose(means[0], P @ A.T @ Y / r, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(covariances[0], P, rtol=1e-9, atol=1e-12)


def test_the_mixture_keeps_mean_and_spread():
    """Of filters that turn into one another at random: the moments of the mixture distribution."""
    rng = np.random.default_rng(0)
    B, p = 3, 4
    T, chances = rng.dirichlet(np.ones(B), B), rng.dirichlet(np.ones(B))
    means, roots = rng.normal(size=(B, p, 1)), rng.normal(size=(B, p, p))
    P = roots @ roots.transpose(0, 2, 1)
    ahead, mixed, new = mix(T, chances, means, P, 9.0 * np.eye(p), np.zeros(B))
    np.testing.assert_allclose(ahead, chances @ T)
    for j in range(B):
        share = T[:, j] * chances / ahead[j]
        mean = np.einsum("i,ipm->pm", share, means)
        sources = [9.0 * np.eye(p) if j == B - 1 and i != j else P[i] for i in range(B)]
        second = sum(s * (S + m @ m.T) for s, S, m in zip(share, sources, means, strict=True))
        np.testing.assert_allclose(mixed[j], mean)
        np.testing.assert_allclose(new[j], second - mean @ mean.T, atol=1e-12)


def test_the_search_finds_the_lengths_of_a_process_drawn_at_random():
    rng = np.random.default_rng(3)
    X, lengths = rng.uniform(-1, 1, (100, 2)), np.array([0.4, 2.0])
    Z = X / lengths
    K = np.exp(-((Z[:, None] - Z) ** 2).sum(axis=2))
    Y = (np.linalg.cholesky(K + 1e-9 * np.eye(100)) @ rng.normal(size=100))[:, None]
    Y += 0.05 * rng.normal(size=Y.shape)
    Y[::17] += 5.0
    search, portions = search_scales(X, Y, np.ones(100), Scales.vague(2, 1)), 0
    while True:
        try:
            next(search)
        except StopIteration as done:
            found, gain = done.value
            break
        portions += 1
    assert 10 < portions <= 210
    assert gain > 20.0
    np.testing.assert_allclose(np.log(found.lengths), np.log(lengths), atol=0.5)
    assert np.sqrt(found.noise) == pytest.approx(0.05, rel=0.4)


def test_a_tracker_that_may_have_no_more_units_goes_on():
    rng, tracker = np.random.default_rng(0), Tracker(Scales.vague(2, 1), 2, 1, 5)
    for x in rng.uniform(-1, 1, (200, 2)):
        tracker.update(Observation(x, np.array([x[0] - x[1]])))
    assert tracker.units == 5
    X = rng.uniform(-1, 1, (50, 2))
    np.testing.assert_allclose(tracker.predict(X)[:, 0], X[:, 0] - X[:, 1], atol=0.1)
