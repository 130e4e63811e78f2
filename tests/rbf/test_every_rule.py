"""What must hold of every rule of the family: one checklist."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from laws.beams import INPUT, OUTPUTS, stiffening
from laws.filters import COVARIANT, FORMS, RULES, exact, frozen_shapes, populated
from palpate.learning import PRESETS, Observation, initial, learn, observe, step
from palpate.rbf.filter.covariance import Full, Shared
from palpate.rbf.filter.growth import add_unit, remove_unit
from palpate.rbf.filter.prediction import value
from palpate.rbf.filter.updates import predict_observation, update_state

# priors far above the noise, and thresholds at which units come and go
RECKLESS = {
    "prior": 100.0,
    "width_prior": 100.0,
    "tail_prior": 100.0,
    "noise": 1e-4,
    "error_min": 1e-2,
    "error_rms_min": 1e-2,
    "distance_min": 0.2,
    "prune_below": 0.1,
    "prune_after": 20,
    "units_max": 5,
}
every_rule = pytest.mark.parametrize("rule", RULES)


def shown(state, x, y, settings):
    """The state after an update alone: no growth, no pruning, no memory."""
    seen = Observation(x, y)
    return update_state(state, seen, predict_observation(state, seen, settings), settings)


def eager(rule):
    """A preset whose thresholds let it grow and prune on a few observations."""
    settings = PRESETS[rule]()
    return replace(
        settings,
        error_min=min(settings.error_min, 1e-3),
        distance_min=0.2,
        window=10,
        prune_below=0.05,
        prune_after=settings.prune_after and 5,
        units_max=8,
    )


def wave(x):
    return np.array([np.sin(3 * x[0]) + 0.3 * np.sign(x[0]), np.cos(2 * x[0])])


@pytest.mark.grid
@every_rule
def test_learns_a_smooth_map_better_than_its_mean(rule):
    X, Y = stiffening(120)
    settings = PRESETS[rule]()
    if settings.growth == "significance":
        settings = replace(settings, error_min=1e-3)
    learned = learn(X[::2], Y[::2], INPUT, OUTPUTS, settings=settings, heldout=(X[1::2], Y[1::2]), passes=4)
    spread = np.sqrt(((Y - Y.mean(axis=0)) ** 2).mean()) / Y.max()
    assert learned.history.heldout[-1] < 0.2 * spread


@pytest.mark.grid
@every_rule
def test_the_old_state_is_untouched_and_a_donated_one_gives_the_same_bits(rule):
    settings = eager(rule)
    rng = np.random.default_rng(0)
    kept = given = initial(1, 2, settings)
    for _ in range(60):
        x = rng.uniform(-1, 1, 1)
        before = kept.vector().copy(), kept.covariance.matrix.copy()
        after, event = step(kept, x, wave(x), settings)
        np.testing.assert_array_equal(kept.vector(), before[0])
        np.testing.assert_array_equal(kept.covariance.matrix, before[1])
        kept = after
        given, _ = step(given, x, wave(x), settings, donate=True)
        np.testing.assert_array_equal(given.vector(), kept.vector())
        np.testing.assert_array_equal(given.covariance.matrix, kept.covariance.matrix)
        assert event.units == kept.units == len(kept.silent) == len(kept.places)
    assert kept.units > 0


@every_rule
def test_an_observation_that_is_not_finite_is_skipped_and_says_so(rule):
    settings = eager(rule)
    state = populated(1, 2, 2, settings)
    after, event = step(state, np.array([np.nan]), np.zeros(2), settings)
    assert after is state
    assert event.why == "not finite"


@pytest.mark.grid
@every_rule
def test_seed_decides_every_bit(rule):
    X, Y = stiffening(40)
    runs = [learn(X, Y, INPUT, OUTPUTS, settings=eager(rule), passes=2, seed=s) for s in (4, 4, 5)]
    np.testing.assert_array_equal(runs[0].state.vector(), runs[1].state.vector())
    np.testing.assert_array_equal(runs[0].state.covariance.matrix, runs[1].state.covariance.matrix)
    assert not np.array_equal(runs[0].history.error, runs[2].history.error)


@every_rule
def test_a_new_unit_meets_its_observation(rule):
    settings = PRESETS[rule]()
    state = populated(2, 3, 2, settings)
    x, y = np.array([0.9, -0.9]), np.array([1.0, 2.0, 3.0])
    after = add_unit(state, x, y - value(state, x, settings), settings)
    np.testing.assert_allclose(value(after, x, settings), y, rtol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize("update", COVARIANT)
def test_covariance_stays_symmetric_positive_definite(update):
    """20,000 random steps at P₀ = 100 and R = 1e-4, with growth and pruning, no guard; 5,000 for parts of P."""
    settings = exact(update=update, **RECKLESS)
    rng = np.random.default_rng(0)
    state, grew, pruned = initial(1, 1, settings), 0, 0
    for t in range(20_000 if update == "full" else 5_000):
        x = rng.uniform(-1, 1, 1)
        y = np.sin(3 * x) + 0.3 * np.sign(x) + 0.1 * rng.normal(size=1)
        state, event = step(state, x, y, settings, donate=True)
        grew, pruned = grew + event.grew, pruned + event.pruned
        if t % 50 == 0 or event.grew or event.pruned:
            P = state.covariance.matrix
            np.testing.assert_array_equal(P, P.T)
            np.linalg.cholesky(P)
    assert grew >= 10
    assert pruned >= 10


@pytest.mark.full
@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("update", COVARIANT)
def test_covariance_stays_positive_definite_for_every_form(name, update):
    """The same for two inputs and outputs and every form, through fewer steps."""
    settings = exact(form=name, update=update, **RECKLESS)
    rng = np.random.default_rng(0)
    state, changed = initial(2, 2, settings), 0
    for _ in range(500):
        x = rng.uniform(-1, 1, 2)
        state, event = step(state, x, wave(x) + 0.1 * rng.normal(size=2), settings, donate=True)
        changed += event.grew + event.pruned
        P = state.covariance.matrix
        np.testing.assert_array_equal(P, P.T)
        np.linalg.cholesky(P)
    assert changed >= 5


def test_a_refused_step_makes_nothing_surer():
    """Where the memory forbids any step, the estimate rests, and so does the covariance."""
    for update in ("full", "decoupled", "winner", "shared"):
        settings = exact(update=update, regression_limit=1e-12, noise=1e-6)
        state = populated(1, 1, 2, settings, seed=3)
        # remembered observations that the network meets exactly: any step spoils them
        X = np.linspace(-1, 1, 9)[:, None]
        state = replace(
            state, memory=np.hstack([X, value(state, X, settings)]), memory_times=np.arange(1, 10), count=9
        )
        after = shown(state, np.array([0.3]), np.array([5.0]), settings)
        np.testing.assert_array_equal(after.vector(), state.vector())
        np.testing.assert_array_equal(after.covariance.matrix, state.covariance.matrix)


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("update", ["decoupled", "winner"])
def test_with_one_unit_and_no_tail_block_filters_are_the_full_one(name, update):
    settings = exact(form=name, tail="none")
    partial = replace(settings, update=update)
    full, blocks = (populated(3, 2, 1, s, seed=5) for s in (settings, partial))
    blocks = replace(blocks, covariance=replace(blocks.covariance, units=full.covariance.matrix[None]))
    rng = np.random.default_rng(6)
    for _ in range(20):
        x, y = rng.uniform(-1, 1, 3), rng.normal(size=2)
        full, blocks = shown(full, x, y, settings), shown(blocks, x, y, partial)
    np.testing.assert_allclose(blocks.vector(), full.vector(), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(blocks.covariance.matrix, full.covariance.matrix, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("update", ["decoupled", "winner"])
def test_with_units_that_do_not_meet_block_filters_are_the_full_one(update):
    """Narrow Gaussians far apart are exactly zero at each other's samples, so no correlation arises."""
    settings = exact(tail="none", overlap=0.01, distance_max=1.0, prior=1e-6, width_prior=1e-2, noise=1e-4)
    states = []
    for s in (settings, replace(settings, update=update)):
        state = initial(1, 2, s)
        for place in (-0.9, 0.0, 0.9):
            state = add_unit(state, np.array([place]), np.array([1.0, -0.5]), s)
        states.append((state, s))
    rng = np.random.default_rng(6)
    for _ in range(30):
        x, y = rng.choice([-0.9, 0.0, 0.9], 1) + rng.uniform(-0.01, 0.01, 1), rng.normal(size=2)
        states = [(shown(state, x, y, s), s) for state, s in states]
    (full, _), (blocks, _) = states
    np.testing.assert_allclose(blocks.vector(), full.vector(), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(blocks.covariance.matrix, full.covariance.matrix, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("modes", [False, True])
def test_with_resting_shapes_the_shared_filter_is_the_full_one(name, modes):
    settings = exact(form=name)
    V = np.linalg.qr(np.random.default_rng(3).normal(size=(5, 2)))[0] if modes else None
    sharing = replace(settings, update="shared")
    full = frozen_shapes(populated(3, 5, 4, settings, seed=5))
    shared = frozen_shapes(populated(3, 5, 4, sharing, seed=5, modes=V))
    rng = np.random.default_rng(6)
    for _ in range(30):
        x, y = rng.uniform(-1, 1, 3), rng.normal(size=5)
        full, shared = shown(full, x, y, settings), shown(shared, x, y, sharing)
    np.testing.assert_allclose(shared.coefficients, full.coefficients, rtol=1e-10, atol=1e-11)
    np.testing.assert_array_equal(shared.theta, full.theta)
    if V is not None:
        np.testing.assert_allclose(shared.mode_coefficients, shared.coefficients @ V, atol=1e-12)
    one = Shared(shared.covariance.regressors, np.zeros((0, 0))).matrix
    p_t = full.tail.shape[1]
    np.testing.assert_allclose(
        full.covariance.matrix[: 5 * p_t, : 5 * p_t], np.kron(np.eye(5), one[:p_t, :p_t]), atol=1e-12
    )


def test_modes_that_span_all_outputs_change_nothing():
    """With r = m the modes only turn the outputs, and least squares does not see that."""
    settings = exact(update="shared", form="rotated")
    V = np.linalg.qr(np.random.default_rng(3).normal(size=(4, 4)))[0]
    plain, turned = populated(2, 4, 3, settings, seed=2), populated(2, 4, 3, settings, seed=2, modes=V)
    turned = replace(turned, covariance=plain.covariance)
    rng = np.random.default_rng(6)
    for _ in range(20):
        x, y = rng.uniform(-1, 1, 2), rng.normal(size=4)
        plain, turned = shown(plain, x, y, settings), shown(turned, x, y, settings)
    np.testing.assert_allclose(turned.vector(), plain.vector(), rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("name", FORMS)
def test_relinearising_a_linear_model_changes_neither_estimate_nor_covariance(name):
    """Resting shapes leave a linear model, units and all."""
    settings = exact(form=name)
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-1, 1, 3), rng.normal(size=2)
    start = frozen_shapes(populated(3, 2, 3, settings, seed=4))
    once = shown(start, x, y, settings)
    often = shown(start, x, y, replace(settings, iterations=7))
    np.testing.assert_allclose(often.vector(), once.vector(), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(often.covariance.matrix, once.covariance.matrix, rtol=1e-12, atol=1e-16)


def test_more_linearisations_come_closer_to_the_posterior_mode():
    settings = exact(noise=1e-4)
    state = populated(1, 2, 3, settings, seed=8)
    x = np.array([0.4])
    y = value(state, x, settings) + np.array([0.3, -0.2])

    def cost(z):
        d, e = z - state.vector(), y - value(state.with_parameters(z), x, settings)
        return d @ np.linalg.solve(state.covariance.matrix, d) + e @ e / settings.noise

    costs = [cost(shown(state, x, y, replace(settings, iterations=k)).vector()) for k in (1, 10)]
    assert costs[1] < costs[0]


@pytest.mark.parametrize("update", ["full", "shared"])
def test_a_weight_counts_as_so_many_observations(update):
    settings = exact(update=update)
    state = frozen_shapes(populated(2, 3, 3, settings, seed=8))
    x, y = np.array([0.4, -0.2]), np.array([1.0, 0.5, -1.0])
    heavy, _ = observe(state, Observation(x, y, weight=3.0), settings)
    for _ in range(3):
        state, _ = step(state, x, y, settings)
    np.testing.assert_allclose(heavy.coefficients, state.coefficients, rtol=1e-10)
    np.testing.assert_allclose(heavy.covariance.matrix, state.covariance.matrix, rtol=1e-8, atol=1e-13)


@pytest.mark.parametrize("update", ["full", "shared"])
def test_a_forgetting_factor_fades_observations_geometrically(update):
    """Recursive least squares with λ: the i-th of N observations weighs λ^(N−i), the prior as the first."""
    fade = 0.95
    settings = exact(update=update, tail="affine", noise=0.04, forgetting_factor=fade)
    rng = np.random.default_rng(1)
    X, Y = rng.uniform(-1, 1, (50, 2)), rng.normal(size=(50, 3))
    state = initial(2, 3, settings)
    for x, y in zip(X, Y, strict=True):
        state, _ = step(state, x, y, settings)
    A, w = np.hstack([np.ones((50, 1)), X]), fade ** np.arange(49, -1, -1)
    left = A.T @ (w[:, None] * A) + fade**49 * settings.noise * np.eye(3)
    np.testing.assert_allclose(state.tail.T, np.linalg.solve(left, A.T @ (w[:, None] * Y)), rtol=1e-9)


@pytest.mark.parametrize("update", ["full", "decoupled", "shared"])
def test_process_noise_widens_every_variance(update):
    settings = exact(update=update)
    state = populated(2, 2, 3, settings, seed=8)
    x, y = np.array([0.4, -0.2]), np.array([1.0, 0.5])
    plain = shown(state, x, y, settings).covariance.matrix
    noisy = shown(state, x, y, replace(settings, process_noise=0.25)).covariance.matrix
    np.testing.assert_allclose(noisy - plain, 0.25 * np.eye(len(plain)), atol=1e-12)


@pytest.mark.parametrize("update", COVARIANT)
def test_pruning_takes_the_units_own_rows_of_the_covariance(update):
    settings = exact(update=update)
    state = populated(2, 3, 4, settings)
    fewer = remove_unit(state, 1)
    P, kept = state.covariance.matrix, np.delete(np.arange(4), 1)
    if update == "shared":
        p_t, p = 3, state.theta.shape[1]
        rows = np.r_[np.delete(np.arange(p_t + 4), p_t + 1), p_t + 4 + np.r_[0:p, 2 * p : 4 * p]]
    else:
        rows = np.r_[0 : state.block(1).start, state.block(1).stop : len(P)]
    np.testing.assert_array_equal(fewer.covariance.matrix, P[np.ix_(rows, rows)])
    np.testing.assert_array_equal(fewer.theta, state.theta[kept])
    np.testing.assert_array_equal(fewer.weights, state.weights[kept])


def test_covariance_of_a_linear_model_is_the_batch_posterior():
    settings = exact(noise=0.04, tail_prior=2.0)
    rng = np.random.default_rng(4)
    X, Y = rng.uniform(-1, 1, (40, 2)), rng.normal(size=(40, 2))
    state = initial(2, 2, settings)
    for x, y in zip(X, Y, strict=True):
        state, _ = step(state, x, y, settings)
    A = np.hstack([np.ones((len(X), 1)), X])
    one = np.linalg.inv(A.T @ A / settings.noise + np.eye(3) / settings.tail_prior)
    assert isinstance(state.covariance, Full)
    np.testing.assert_allclose(state.covariance.matrix, np.kron(np.eye(2), one), rtol=1e-9, atol=1e-14)


def test_memory_follows_the_declared_law():
    """full (m p_t + h (m + p))², blocks (m p_t)² + h (m + p)², shared (p_t + h)² + (h p)²."""
    n, m, h = 3, 4, 6
    p, p_t = 2 * n, 1 + n
    laws = {
        "full": (m * p_t + h * (m + p)) ** 2,
        "decoupled": (m * p_t) ** 2 + h * (m + p) ** 2,
        "winner": (m * p_t) ** 2 + h * (m + p) ** 2,
        "shared": (p_t + h) ** 2 + (h * p) ** 2,
        "gradient": 0,
    }
    for update, law in laws.items():
        assert populated(n, m, h, exact(update=update)).covariance.numbers == law
