"""The growth and pruning rules, the guards, and the run as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laws.beams import INPUT, OUTPUTS, exact, stiffening
from palpate.errors import FileFormatError, UsageError
from palpate.learning import History, Observation, Settings, default, founding, initial, learn, step
from palpate.rbf.filter.growth import add_unit, contributions, nearest_unit, prune_units, wants_growth
from palpate.rbf.filter.kalman import edge_factor, measurement_variance
from palpate.rbf.filter.prediction import value
from palpate.rbf.filter.updates import predict_observation, update_state


def shown(state, x, y, settings):
    """The state after an update alone: no growth, no pruning, no memory."""
    seen = Observation(x, y)
    return update_state(state, seen, predict_observation(state, seen, settings), settings)


def with_errors(settings: Settings, *errors: float, count: int = 1000):
    return replace(initial(1, 1, settings), errors=np.array(errors) ** 2, count=count)


@pytest.mark.parametrize(
    ("errors", "error", "centre", "expected"),
    [
        ([1.0, 1.0], 1.0, None, True),
        ([1.0, 1.0], 0.05, None, False),  # this error is small
        ([0.01, 0.01], 1.0, None, False),  # the window's is
        ([1.0, 1.0], 1.0, 0.5, False),  # a centre is near
        ([1.0, 1.0], 1.0, -0.5, True),  # it is far enough
    ],
)
def test_all_three_criteria_must_hold(errors, error, centre, expected):
    settings = exact(error_min=0.1, error_rms_min=0.1, distance_min=0.3)
    state = with_errors(settings, *errors)
    if centre is not None:
        state = add_unit(state, np.array([centre]), np.array([1.0]), settings)
    assert wants_growth(state, np.array([0.6]), np.array([error]), settings) is expected


def test_distance_threshold_shrinks_with_the_observations_of_all_passes():
    settings = exact(error_min=0.0, error_rms_min=0.0, distance_max=1.0, distance_decay=0.9, distance_min=0.1)
    late = add_unit(with_errors(settings, 1.0, count=100), np.array([0.0]), np.array([1.0]), settings)
    early = replace(late, count=1)
    x, e = np.array([0.5]), np.array([1.0])
    assert not wants_growth(early, x, e, settings)
    assert wants_growth(late, x, e, settings)


def test_founding_form_waits_for_its_window():
    settings = founding()
    state = with_errors(settings, *[1.0] * (settings.window - 1))
    x, e = np.array([0.0]), np.array([1.0])
    assert not wants_growth(state, x, e, settings)
    assert wants_growth(with_errors(settings, *[1.0] * settings.window), x, e, settings)


def test_new_width_is_the_overlap_times_the_nearest_distance():
    settings = exact(overlap=0.7)
    first = add_unit(initial(1, 1, settings), np.array([-0.5]), np.array([1.0]), settings)
    assert first.widths(settings)[0, 0] == pytest.approx(0.7 * settings.distance_max)
    second = add_unit(first, np.array([0.1]), np.array([1.0]), settings)
    assert second.widths(settings)[1, 0] == pytest.approx(0.7 * 0.6)
    assert nearest_unit(second, np.array([0.2]), settings) == (1, pytest.approx(0.1))


def test_silent_units_are_removed_after_the_window_and_not_before():
    settings = exact(prune_below=0.1, prune_after=3)
    state = add_unit(initial(1, 1, settings), np.array([0.0]), np.array([1.0]), settings)
    state = add_unit(state, np.array([0.9]), np.array([1e-3]), settings)
    x = np.array([0.0])
    for expected in (2, 2, 1):
        state = prune_units(state, x, settings)
        assert state.units == expected
    assert state.centres(settings)[0, 0] == 0.0


def test_one_loud_observation_restarts_the_count():
    settings = exact(prune_below=0.1, prune_after=2)
    state = add_unit(initial(1, 1, settings), np.array([-0.9]), np.array([1.0]), settings)
    state = add_unit(state, np.array([0.9]), np.array([1.0]), settings)
    assert contributions(state, np.array([0.9]), settings)[1] == 1.0
    for x in (-0.9, 0.9, -0.9, 0.9):
        state = prune_units(state, np.array([x]), settings)
    assert state.units == 2


def test_contribution_is_judged_output_by_output():
    settings = exact()
    state = add_unit(initial(1, 2, settings), np.array([0.0]), np.array([1.0, 0.0]), settings)
    state = add_unit(state, np.array([0.0]), np.array([0.0, 1e-6]), settings)
    np.testing.assert_array_equal(contributions(state, np.array([0.0]), settings), [1.0, 1.0])


@pytest.mark.full
@given(st.lists(st.floats(-1, 1), min_size=1, max_size=4))
def test_edge_factor_is_one_in_the_middle_and_never_below_its_floor(x):
    factor = edge_factor(np.array(x), 0.01)
    assert 0.01 <= factor <= 1.0
    assert edge_factor(np.zeros(len(x)), 0.01) == 1.0


def test_noise_is_never_far_below_the_innovation():
    settings = default()
    error = np.array([0.3, -0.4])
    assert measurement_variance(np.zeros(1), error, 0.0, settings) == pytest.approx(settings.gate * 0.125)
    assert measurement_variance(np.zeros(1), 0 * error, 0.02, settings) == pytest.approx(
        settings.noise_share * 0.02
    )
    assert measurement_variance(np.zeros(1), 0 * error, 0.0, settings) == settings.noise


@given(st.integers(0, 10_000))
def test_no_step_moves_a_unit_beyond_the_bound(seed):
    settings = exact(step_bound=0.1, noise=1e-8, tail="none")
    rng = np.random.default_rng(seed)
    state = add_unit(initial(1, 2, settings), rng.uniform(-1, 1, 1), rng.normal(size=2), settings)
    state = add_unit(state, rng.uniform(-1, 1, 1), rng.normal(size=2), settings)
    after = shown(state, rng.uniform(-1, 1, 1), rng.normal(size=2), settings)
    moved = np.abs(after.centres(settings) - state.centres(settings)) / state.widths(settings)
    assert moved.max() <= 0.1 * (1 + 1e-9)
    assert np.abs(np.log(after.widths(settings) / state.widths(settings))).max() <= 0.1 * (1 + 1e-9)


@given(st.integers(0, 10_000))
def test_no_update_raises_the_windows_error_beyond_what_is_allowed(seed):
    settings = exact(regression_limit=1.0, noise=1e-6)
    rng = np.random.default_rng(seed)
    state = add_unit(initial(1, 1, settings), rng.uniform(-1, 1, 1), rng.normal(size=1), settings)
    seen = rng.normal(size=(6, 2))
    state = replace(state, memory=seen, memory_times=np.arange(1, 7), count=6)
    after = shown(state, rng.uniform(-1, 1, 1), 3 * rng.normal(size=1), settings)

    def error(s):
        return ((value(s, seen[:, :1], settings) - seen[:, 1:]) ** 2).sum()

    assert error(after) <= error(state) * (1 + 1e-12)


@pytest.mark.full
def test_learning_a_smooth_map_reaches_its_accuracy_and_never_regresses():
    X, Y = stiffening(200)
    learned = learn(X[::2], Y[::2], INPUT, OUTPUTS, heldout=(X[1::2], Y[1::2]), seed=1)
    assert learned.history.heldout[-1] < 1e-3
    assert learned.history.regression < 2.0
    error = learned.network.predict(X[1::2]) - Y[1::2]
    assert np.sqrt((error**2).mean()) / Y.max() == pytest.approx(learned.history.heldout[-1], rel=1e-9)


def test_history_counts_what_the_network_shows():
    X, Y = stiffening(100)
    learned = learn(X, Y, INPUT, OUTPUTS, passes=2)
    h = learned.history
    assert h.units.size == 200
    assert h.grew.sum() - h.pruned.sum() == h.units[-1] == learned.network.units
    assert "200 observations in 2 passes" in str(h)


def test_history_file_round_trips_and_a_damaged_one_is_named(tmp_path):
    X, Y = stiffening(30)
    history = learn(X, Y, INPUT, OUTPUTS, passes=1).history
    path = history.save(tmp_path / "h.npz")
    again = History.load(path)
    np.testing.assert_array_equal(again.error, history.error)
    assert again.passes == 1
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(FileFormatError, match=r"h\.npz"):
        History.load(path)


def test_the_old_state_is_untouched_by_a_step():
    settings = default()
    state = add_unit(initial(1, 2, settings), np.zeros(1), np.ones(2), settings)
    before = state.vector().copy(), state.covariance.matrix.copy()
    step(state, np.array([0.3]), np.array([2.0, -1.0]), settings)
    np.testing.assert_array_equal(state.vector(), before[0])
    np.testing.assert_array_equal(state.covariance.matrix, before[1])


@pytest.mark.parametrize(
    ("X", "Y"),
    [
        (np.zeros((3, 1)), np.zeros((4, 3))),
        (np.zeros((3, 2)), np.zeros((3, 3))),
        (np.zeros((3, 1)), np.full((3, 3), np.nan)),
        (np.zeros((0, 1)), np.zeros((0, 3))),
    ],
)
def test_arrays_that_do_not_fit_are_refused(X, Y):
    with pytest.raises(UsageError):
        learn(X, Y, INPUT, OUTPUTS)


@pytest.mark.parametrize(
    "change",
    [
        {"noise": 0.0},
        {"window": 0},
        {"gate": -1.0},
        {"distance_decay": 1.5},
        {"tail": "cubic"},
        {"noise": "small"},
        {"widths": "wide"},
        {"window": 2.5},
        {"noise": float("inf")},
        {"distance_max": 0.1, "distance_min": 0.2},
        {"form": "rank-1", "growth": "significance"},
    ],
)
def test_settings_out_of_range_are_refused(change):
    with pytest.raises(
        UsageError, match=str(next(iter(change.values())) if "form" in change else next(iter(change)))
    ):
        Settings(**change)
