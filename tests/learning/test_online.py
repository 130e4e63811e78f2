"""Learning a stream: the fold of `step`, what is retained, what is skipped, drift, and readers elsewhere."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from laws.beams import INPUT, OUTPUTS, stiffening
from palpate.errors import UsageError
from palpate.learning import Observation, default, initial, refine, step
from palpate.learning.stream.learner import Learner
from palpate.learning.stream.refining import Refining
from palpate.learning.stream.reservoir import Reservoir
from palpate.network import Publisher, Scaling
from palpate.rbf.filter.settings import shared
from palpate.rbf.refinement.rows import Rows
from palpate.units import Quantity, Range

SQUARE = (Range("a", -1.0, 1.0), Range("b", 0.0, 4.0, "N"))


def shuffled(N=200, seed=0):
    X, Y = stiffening(N)
    order = np.random.default_rng(seed).permutation(N)
    return X[order], Y[order]


def streamed(learner, X, Y):
    """Events of all samples, handed over in the same two buffers each time."""
    x, y, events = np.empty(X.shape[1]), np.empty(Y.shape[1]), []
    for i in range(len(X)):
        x[:], y[:] = X[i], Y[i]
        events.append(learner.observe(x, y))
    return events


def misses(learner):
    X, Y = stiffening(333)
    return float(np.sqrt(((learner.network.predict(X) - Y) ** 2).mean()))


@pytest.mark.parametrize("settings", [default(), shared()], ids=["full", "shared"])
def test_without_refinement_it_is_the_fold_of_step_bit_by_bit(settings):
    X, Y = shuffled()
    scaling = Scaling.of(INPUT, Y)
    learner = Learner(INPUT, OUTPUTS, settings=settings, refining=None, scaling=scaling)
    events = streamed(learner, X, Y)
    state, xs, ys = initial(1, 3, settings), scaling.scale_inputs(X), scaling.scale_outputs(Y)
    for x, y, event in zip(xs, ys, events, strict=True):
        state, other = step(state, x, y, settings)
        assert event == other
    np.testing.assert_array_equal(learner.state.vector(), state.vector())
    np.testing.assert_array_equal(learner.state.covariance.matrix, state.covariance.matrix)


def test_scaling_from_the_first_observations_and_from_declared_ranges():
    X, Y = shuffled()
    learner = Learner(INPUT, OUTPUTS, refining=None, settle=20)
    first = streamed(learner, X[:19], Y[:19])
    assert {event.why for event in first} == {"settling the scaling"}
    np.testing.assert_allclose(learner.network.predict(X[:1])[0], Y[:19].mean(axis=0))
    with pytest.raises(UsageError, match="20 observations"):
        _ = learner.state
    learner.observe(X[19], Y[19])
    told = Learner(INPUT, OUTPUTS, refining=None, scaling=Scaling.of(INPUT, Y[:20]))
    streamed(told, X[:20], Y[:20])
    np.testing.assert_array_equal(learner.state.vector(), told.state.vector())

    ranges = [Range(q.name, -1.0, 3.0 + j, q.unit) for j, q in enumerate(OUTPUTS)]
    declared = Learner(INPUT, ranges, refining=None).network.scaling
    np.testing.assert_allclose(declared.output_centre, [1.0, 1.5, 2.0])
    np.testing.assert_allclose(declared.output_scale, 3.0)


@pytest.mark.full
def test_refinement_continues_the_filter_far_below_its_own_error():
    X, Y = shuffled()
    settings = replace(default(), units_max=4, error_rms_min=1e-8)
    plain = Learner(INPUT, OUTPUTS, settings=settings, refining=None)
    better = Learner(INPUT, OUTPUTS, settings=settings, refining=Refining(samples=200, every=5))
    streamed(plain, X, Y)
    events = streamed(better, X, Y)
    assert [k for k, e in enumerate(events, 1) if e.refined] == list(range(50, 201, 5))  # 50 settle
    assert better.state.units <= 4
    assert misses(better) < 0.02 * misses(plain)
    # a covariance, still
    np.linalg.cholesky(better.state.covariance.matrix)


@pytest.mark.full
@pytest.mark.parametrize("update", ["full", "decoupled", "shared"])
def test_ends_within_three_times_the_batch_error_at_equal_units(update):
    X, Y = shuffled()
    settings = replace(default(), update=update, units_max=3, error_rms_min=1e-9)
    learner = Learner(INPUT, OUTPUTS, settings=settings, refining=Refining(samples=200, every=2))
    streamed(learner, np.vstack([X, X]), np.vstack([Y, Y]))
    scaling, of = Scaling.of(INPUT, Y), settings.regressors(1)
    x, y = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    h = learner.state.units
    starts = [np.array([of.form.unit(p, w) for p in np.linspace(-1, 1, h)[:, None]]) for w in (0.7, 1.0, 1.5)]
    best = min((refine(x, y, s, of) for s in starts), key=lambda r: r.loo)
    X, Y = stiffening(333)
    batch = best.predict(scaling.scale_inputs(X)) * scaling.output_scale + scaling.output_centre
    assert misses(learner) < 3.0 * np.sqrt(((batch - Y) ** 2).mean())


@pytest.mark.full
def test_seed_decides_every_bit():
    X, Y = shuffled(150)
    refining = Refining(samples=40, every=5)

    def run(seed):
        learner = Learner(INPUT, OUTPUTS, refining=refining, seed=seed)
        streamed(learner, X, Y)
        return learner.state.vector()

    np.testing.assert_array_equal(run(1), run(1))
    assert not np.array_equal(run(1), run(2))


def test_bad_numbers_are_skipped_and_nothing_else_changes():
    X, Y = shuffled(80)
    clean, dirty = (Learner(INPUT, OUTPUTS, scaling=Scaling.of(INPUT, Y)) for _ in range(2))
    bad = [
        (np.array([np.nan]), Y[0], "not finite"),
        (X[0], np.array([0.0, np.inf, 0.0]), "not finite"),
        (np.array([1e300]), Y[0], "far outside"),
        (X[0], np.full(3, -1e300), "far outside"),
    ]
    for k, (x, y) in enumerate(zip(X, Y, strict=True)):
        clean.observe(x, y)
        dirty.observe(x, y)
        event = dirty.observe(*bad[k % 4][:2])
        assert bad[k % 4][2] in event.why
        assert (event.updated, event.grew, event.refined) == (False, False, False)
        assert event.units == dirty.state.units
    assert dirty.observe(X[0], Y[0], weight=-1.0).why == "its weight is not positive and finite"
    np.testing.assert_array_equal(dirty.state.vector(), clean.state.vector())
    np.testing.assert_array_equal(dirty.state.covariance.matrix, clean.state.covariance.matrix)
    assert dirty.count == 2 * clean.count + 1


STREAMS = {
    "one point": lambda rng, t: (np.zeros(2), np.ones(3)),
    "two points": lambda rng, t: (np.full(2, float(t % 2)), np.full(3, t % 2)),
    "constant": lambda rng, t: (rng.uniform(-1, 1, 2), np.full(3, 0.25)),
    "a line": lambda rng, t: (rng.uniform(-1, 1) * np.array([1.0, 1.0]), rng.normal(size=3)),
    "noise": lambda rng, t: (rng.uniform(-1, 1, 2), rng.normal(size=3)),
    "outliers": lambda rng, t: (rng.uniform(-1, 1, 2), np.full(3, 1e5 if t % 17 == 16 else 0.1)),
    "tiny": lambda rng, t: (1e-9 * rng.uniform(-1, 1, 2), 1e-9 * rng.normal(size=3)),
    "far": lambda rng, t: (9.0 * rng.uniform(-1, 1, 2), rng.normal(size=3)),
}


@pytest.mark.grid
@pytest.mark.parametrize("update", ["full", "decoupled", "winner", "shared", "gradient"])
@pytest.mark.parametrize("name", STREAMS)
def test_no_stream_of_numbers_stops_the_loop(name, update):
    rng = np.random.default_rng(0)
    settings = replace(default(), update=update, form="rotated", units_max=5, forgetting_factor=0.97)
    scaling = Scaling(np.zeros(2), np.ones(2), np.zeros(3), np.ones(3))
    inputs = (Range("a", -1.0, 1.0), Range("b", -1.0, 1.0))
    learner = Learner(
        *(inputs, OUTPUTS), settings=settings, scaling=scaling, refining=Refining(samples=20, every=3)
    )
    for t in range(100):
        learner.observe(*STREAMS[name](rng, t))
    assert np.isfinite(learner.network.predict(rng.uniform(-1, 1, (50, 2)))).all()


def test_a_wrong_shape_is_the_programs_mistake():
    learner = Learner(SQUARE, OUTPUTS)
    with pytest.raises(UsageError, match="2 inputs and 3 outputs"):
        learner.observe(np.zeros(3), np.zeros(3))
    with pytest.raises(UsageError, match="slopes"):
        learner.observe(np.zeros(2), np.zeros(3), slopes=np.zeros((2, 3)))
    with pytest.raises(UsageError, match="declare the scaling"):
        _ = learner.network
    for wrong in ({"settle": 0}, {"basis": 0}):
        with pytest.raises(UsageError):
            Learner(SQUARE, OUTPUTS, **wrong)
    with pytest.raises(UsageError):
        Refining(samples=0)


def test_slopes_in_si_units_are_learnt():
    """Of a plane: three values and their slopes at one point each say all there is."""
    T = np.array([[3.0, 2.0, -0.5], [0.0, 1.0, 4.0], [1.0, 0.0, 0.25]])
    settings = replace(default(), noise=1e-12, noise_share=0.0, gate=0.0, edge_weight=1.0, units_max=0)
    scaling = Scaling(np.array([0.0, 2.0]), np.array([1.0, 2.0]), np.ones(3), np.full(3, 5.0))
    learner = Learner(
        SQUARE, OUTPUTS, settings=settings, refining=Refining(samples=4, every=2), scaling=scaling
    )
    for x in (np.array([0.3, 1.0]), np.array([-0.2, 3.0])):
        learner.observe(x, T @ np.r_[1.0, x], slopes=T[:, 1:])
    probe = np.array([[0.9, 0.1], [-0.9, 3.9]])
    np.testing.assert_allclose(
        learner.network.predict(probe), np.hstack([[[1], [1]], probe]) @ T.T, rtol=1e-6
    )


def test_many_outputs_are_learnt_in_their_modes():
    rng = np.random.default_rng(0)
    directions, X = rng.normal(size=(2, 40)), rng.uniform(-1, 1, (300, 1))
    outputs = [Quantity(f"y{j}") for j in range(40)]

    def truth(X):
        return 2.0 + np.hstack([np.sin(3 * X), np.cosh(X)]) @ directions

    learner = Learner(
        *([Range("x", -1.0, 1.0)], outputs),
        settings=replace(shared(), units_max=6, error_rms_min=1e-7),
        basis=5,
        refining=Refining(every=5),
    )
    streamed(learner, X, truth(X))
    assert learner.network.basis.shape == (40, 5)
    grid = np.linspace(-1, 1, 101)[:, None]
    error = learner.network.predict(grid) - truth(grid)
    assert np.sqrt((error**2).mean()) < 1e-4 * truth(grid).std()


@pytest.mark.full
def test_reservoir_is_a_uniform_sample():
    """Each of 200 samples is kept with probability R/t: over 500 seeds the counts are binomial."""
    R, t, runs = 20, 200, 500
    counts = np.zeros(t)
    for seed in range(runs):
        kept = Reservoir(R, 1, 1, seed=seed)
        for i in range(t):
            kept.add(Observation(np.array([float(i)]), np.array([-float(i)])))
        assert len(kept) == R
        np.testing.assert_array_equal(kept.Y, -kept.X)
        np.testing.assert_array_equal(kept.ages, t - 1 - kept.X[:, 0])
        counts[kept.X[:, 0].astype(int)] += 1
    p = R / t
    z = (counts - runs * p) / np.sqrt(runs * p * (1 - p))
    assert abs((z**2).sum() - t) < 5 * np.sqrt(2 * t)  # χ² with about t degrees of freedom
    assert np.abs(z).max() < 5.0


def test_other_reservoirs_keep_the_recent_past():
    latest, fading = Reservoir(10, 1, 1, keeping="latest"), Reservoir(10, 1, 1, keeping="fading", seed=3)
    ages = []
    for i in range(3000):
        for kept in (latest, fading):
            assert kept.add(Observation(np.array([float(i)]), np.zeros(1)))
        if i > 200:
            ages.append(fading.ages.mean())
    np.testing.assert_array_equal(np.sort(latest.ages), np.arange(10))
    # geometric with P(age > k) = (1 - 1/R)^k: mean R - 1
    assert np.mean(ages) == pytest.approx(9.0, rel=0.05)


def test_a_second_sight_of_a_sample_takes_the_place_of_the_first():
    kept = Reservoir(5, 2, 1)
    for y in range(4):
        kept.add(Observation(np.array([0.1, 0.2]), np.array([float(y)])))
        kept.add(Observation(np.array([0.1, 0.3 + y]), np.array([9.0])))
    assert len(kept) == 5
    assert kept.Y[(kept.X == [0.1, 0.2]).all(axis=1)].ravel().tolist() == [3.0]


@pytest.mark.full
@pytest.mark.parametrize(
    "refining", [None, Refining(samples=60, keeping="latest", every=5)], ids=["filter", "refined"]
)
def test_drift_is_followed(refining):
    """A spring whose stiffness falls by 30 %: the network stays near it, a frozen one does not."""
    left = [drifted(refining, seed) for seed in range(5)]
    assert np.median(left) < 0.1
    assert max(left) < 1.0, "nothing learnt is worse than not to learn"


def drifted(refining, seed):
    """Error of a network that saw the drift, over that of one that did not."""
    rng = np.random.default_rng(seed)
    settings = replace(default(), process_noise=1e-3, regression_limit=0.0)
    learner = Learner(
        [Range("P", 0.0, 5.0, "N")], [Range("u", 0.0, 1.0, "m")], settings=settings, refining=refining
    )

    def deflection(P, t):
        return np.tanh(0.3 * P / (1.0 - 0.3 * np.clip((t - 150) / 300, 0.0, 1.0)))

    for t in range(500):
        P = rng.uniform(0.0, 5.0, 1)
        learner.observe(P, deflection(P, t))
        if t == 150:
            frozen = learner.network
    grid = np.linspace(0.0, 5.0, 101)[:, None]

    def rms(network):
        return np.sqrt(((network.predict(grid) - deflection(grid, 500)) ** 2).mean())

    return rms(learner.network) / rms(frozen)


@pytest.mark.full
def test_memory_does_not_grow_with_the_stream():
    X, Y = shuffled(120)
    learner = Learner(INPUT, OUTPUTS, refining=Refining(samples=30, every=10), remember=50)
    for _ in range(3):
        streamed(learner, X, Y)
    assert learner.count == 360
    assert learner.history.units.size == 50
    assert learner.history.error.size == 50
    assert len(learner.state.memory) <= max(learner.settings.window, learner.settings.memory)
    assert len(learner.state.errors) == learner.settings.window
    h, d = learner.state.units, learner.state.vector().size
    assert d == 3 * 2 + h * (3 + 2)
    declared = d * d + 30 * (1 + 3 + 3) + learner.settings.memory * (1 + 3)
    assert declared - 200 < learner.numbers < declared + 200
    assert learner.expected > 0


READER = """
import sys, time
import numpy as np
from palpate.network import Subscriber

x, seen, deadline = np.array([2.0]), 0, time.monotonic() + 60
with Subscriber.attach(sys.argv[1]) as subscriber:
    print("ready", flush=True)
    while time.monotonic() < deadline:
        if subscriber.fetch():
            seen += 1
            whole = subscriber.network
            # after the learnt one the writer says in each how many units it has: a mixture of two would disagree
            assert subscriber.serial == 1 or whole.tail[0, 0] == whole.units == len(whole.factors), whole
            if whole.units == 7:
                break
print(seen)
"""


@pytest.mark.full
def test_a_reader_in_another_process_sees_whole_snapshots():
    X, Y = shuffled(60)
    learner = Learner(INPUT, OUTPUTS, scaling=Scaling.of(INPUT, Y), refining=None)
    with Publisher.create(INPUT, learner.outputs, units=60) as publisher:
        reader = subprocess.Popen(
            [sys.executable, "-c", READER, publisher.name],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert reader.stdout.readline().strip() == "ready"
        streamed(learner, X, Y)
        assert learner.publish(publisher) == 1
        network = learner.network
        rng = np.random.default_rng(0)
        for k in [*rng.integers(8, 61, 400), 7]:
            tail = network.tail.copy()
            tail[0, 0] = k
            publisher.publish(
                replace(
                    network,
                    factors=np.ones((k, 1, 1)),
                    shifts=np.zeros((k, 1)),
                    weights=np.full((3, k), 1.0 / k),
                    tail=tail,
                )
            )
        out, errors = reader.communicate(timeout=60)
    assert reader.returncode == 0, errors
    assert int(out) >= 1


@pytest.mark.full
def test_an_idle_sensor_does_not_settle_the_scaling():
    """Fifty zeros say nothing of the outputs' size; nor do samples from one corner of the range."""
    inputs, outputs = (Range("x", -1.0, 1.0, "m"),), (Quantity("y", "N"),)
    rng = np.random.default_rng(0)
    for idle in (np.zeros(60), -1.0 + 1e-6 * rng.uniform(size=60)):
        learner = Learner(inputs, outputs, refining=None)
        for x in idle:
            why = learner.observe(np.array([x]), np.array([1e-3 * np.sin(3 * x) if idle.any() else 0.0])).why
        assert why == "settling the scaling"
        for x in rng.uniform(-1, 1, 600):
            learner.observe(np.array([x]), np.array([1e-3 * np.sin(3 * x)]))
        grid = np.linspace(-1, 1, 50)[:, None]
        error = learner.network.predict(grid) - 1e-3 * np.sin(3 * grid)
        assert np.abs(error).max() < 2e-4  # of 1e-3: what was learnt while idle is still remembered


def test_a_retained_sample_counts_in_the_refinement_what_it_counts_in_the_filter():
    inputs, outputs = (Range("x", -1.0, 1.0, "m"),), (Range("y", -1.0, 1.0, "N"),)
    learner = Learner(inputs, outputs, refining=Refining(samples=50, every=1000))
    learner.observe(np.array([0.5]), np.array([0.25]), weight=4.0, slopes=np.array([[1.0]]), slope_weight=0.5)
    kept = learner._reservoir
    seen = Observation(np.array([0.5]), np.array([0.25]), 4.0, np.array([[1.0]]), 0.5)
    rows = Rows.of(
        default().regressors(1),
        kept.X,
        kept.Y,
        weights=kept.weights,
        slopes=kept.slopes,
        slope_weight=kept.slope_weights,
    )
    np.testing.assert_allclose(rows.scale**2, 1.0 / seen.variances(1.0)[:1])
    np.testing.assert_allclose(kept.weights * kept.slope_weights[:, 0], 1.0 / seen.variances(1.0)[1:])


def test_what_is_declared_wrongly_is_refused_at_once():
    inputs, outputs = (Range("x", -1.0, 1.0, "m"),), (Quantity("y", "N"),)
    with pytest.raises(UsageError, match="Settings record"):
        Learner(inputs, outputs, settings="emran")
    with pytest.raises(UsageError, match="ranges"):
        Learner(["x"], outputs)
    with pytest.raises(UsageError, match="quantities"):
        Learner(inputs, ["y"])
    with pytest.raises(UsageError, match="newest"):
        Refining(keeping="newest")


def test_a_reading_far_outside_the_declared_range_changes_nothing():
    inputs, outputs = (Range("x", -1.0, 1.0, "m"),), (Range("y", -1.0, 1.0, "N"),)
    learner = Learner(inputs, outputs, refining=None)
    for x in np.random.default_rng(0).uniform(-1, 1, 100):
        learner.observe(np.array([x]), np.array([np.sin(x)]))
    before = learner.state
    assert "far outside" in learner.observe(np.array([5.0]), np.array([1.0])).why
    assert learner.state is before
