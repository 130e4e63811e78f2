"""Fits to many rows: sums over blocks of rows say what all rows at once say, in memory that rows do not change."""

from __future__ import annotations

import time
import tracemalloc

import numpy as np
import pytest

from palpate.learning.arrays.fit import fit
from palpate.learning.arrays.held_out import start_units
from palpate.learning.arrays.many_rows import MANY_ROWS, RowParts
from palpate.learning.arrays.streamed_weights import (
    OutOfTime,
    RegressorRows,
    RowStream,
    newton_steps,
    project_units,
    solve_weights,
)
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.levenberg import levenberg_step
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import Regressors

ROWS = 20_000


def response(X):
    return np.sin(2.5 * X[:, 0] + X[:, 1]) + X[:, 1] * X[:, 2] + np.exp(-3.0 * (X[:, 2] - X[:, 0]) ** 2)


def rows_of(count, *, noise=0.02, seed=0):
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1, 1, (count, 3))
    return X, response(X) + noise * rng.normal(size=count)


def units_at(X, form="rank-2", radial="gaussian", count=12):
    regressors = Regressors(unit_form(form, X.shape[1]), radial)
    return regressors, start_units(regressors.form, X, np.ones(X.shape[1]), count, seed=3)


@pytest.fixture(scope="module")
def many():
    X, y = rows_of(ROWS)
    return fit(X, y, effort=0.03), X, y


@pytest.mark.parametrize("radial", RADIAL_FUNCTIONS)
@pytest.mark.parametrize("form", ["rank-1", "rank-2", "rotated", "axis-aligned"])
def test_compiled_regressors_are_those_of_a_refinement(form, radial):
    X, _ = rows_of(50)
    regressors, theta = units_at(X, form, radial)
    rows = RegressorRows(*regressors.form.factors(theta), radial)(X)
    wanted = np.hstack([regressors.tail_rows(X), regressors.phi(X, theta)])
    np.testing.assert_allclose(rows, wanted, atol=1e-13)


@pytest.mark.parametrize("ridge", [1e-10, 1e-6, 1e-2])
def test_streamed_weights_are_those_of_least_squares(ridge):
    X, y = rows_of(30_000)
    Y = np.column_stack([y, y**2])
    regressors, theta = units_at(X, count=40)
    rows = RegressorRows(*regressors.form.factors(theta), regressors.radial)
    stream = RowStream(X, Y)
    streamed = solve_weights(stream, rows, stream.moments(rows), ridge)
    penalty = np.sqrt(ridge * len(X)) * np.eye(rows.columns)[rows.tail :]
    wanted = np.vstack([Y, np.zeros((rows.units, 2))])
    direct = np.linalg.lstsq(np.vstack([rows(X), penalty]), wanted, rcond=None)[0]
    np.testing.assert_allclose(rows(X) @ streamed, rows(X) @ direct, atol=1e-10)


def test_the_number_of_threads_changes_no_bit():
    X, y = rows_of(30_000)
    regressors, theta = units_at(X, count=100)
    rows = RegressorRows(*regressors.form.factors(theta), regressors.radial)
    alone, shared = (RowStream(X, y[:, None], workers).moments(rows) for workers in (1, 3))
    np.testing.assert_array_equal(alone.gram, shared.gram)
    np.testing.assert_array_equal(alone.cross, shared.cross)


def test_a_streamed_step_is_the_step_of_all_rows_at_once():
    X, y = rows_of(9_000)
    Y = np.column_stack([y, np.cos(X[:, 0])])
    regressors, theta = units_at(X)
    stream = RowStream(X, Y)
    streamed = next(newton_steps(stream, project_units(stream, regressors, theta, 1e-8), damping=1e-2))
    dense = levenberg_step(Rows.of(regressors, X, Y), theta, 1e-8 * len(X), damping=1e-2)
    assert np.abs(dense.theta - theta).max() > 0.1
    np.testing.assert_allclose(streamed.theta, dense.theta, atol=1e-4)
    assert streamed.cost == pytest.approx(dense.fit.cost, rel=1e-4)


@pytest.mark.full
def test_memory_of_a_step_does_not_grow_with_the_rows():
    X, y = rows_of(80_000)
    regressors, theta = units_at(X, count=40)

    def peak(count):
        stream = RowStream(X[:count], y[:count, None])
        tracemalloc.start()
        next(newton_steps(stream, project_units(stream, regressors, theta, 1e-8)))
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    few = peak(20_000)
    assert few < 150e6
    assert peak(80_000) < 1.02 * few


def test_rows_are_not_added_up_beyond_the_limit_on_time():
    X, y = rows_of(1000)
    regressors, theta = units_at(X)
    with pytest.raises(OutOfTime):
        project_units(RowStream(X, y[:, None], deadline=time.monotonic() - 1.0), regressors, theta, 1e-8)


def test_copies_of_a_row_are_in_one_part():
    places = np.repeat(np.arange(8000), 3)
    parts = RowParts.of(places, seed=1)
    learn = np.zeros(len(places), dtype=bool)
    learn[parts.learn] = True
    for part in (learn, parts.decide, parts.judge):
        assert (part.reshape(-1, 3).sum(axis=1) % 3 == 0).all()
    np.testing.assert_array_equal(learn.astype(int) + parts.decide + parts.judge, 1)


@pytest.mark.parametrize("places", [3, 200])
def test_rows_at_few_places_are_dealt_one_by_one(places):
    parts = RowParts.of(np.random.default_rng(0).integers(places, size=12_000), seed=1)
    assert (parts.decide.sum(), parts.judge.sum()) == (1200, 1200)
    assert len(parts.learn) == 9600


@pytest.mark.full
def test_all_rows_make_a_better_network_than_some(many):
    fitted, X, y = many
    asked, _ = rows_of(4000, seed=9)
    some = fit(X[: MANY_ROWS // 2], y[: MANY_ROWS // 2], effort=0.03)
    error, error_of_some = (
        np.sqrt(((model.predict(asked) - response(asked)) ** 2).mean()) for model in (fitted, some)
    )
    assert error < min(error_of_some, 0.01)


@pytest.mark.full
def test_the_error_told_is_that_of_unseen_rows(many):
    fitted, _, y = many
    asked, measured = rows_of(4000, seed=9)
    low, high = fitted.interval(asked)
    assert 0.87 < ((low <= measured) & (measured <= high)).mean() < 0.93
    error = np.sqrt(((fitted.predict(asked) - measured) ** 2).mean()) / y.std()
    assert fitted.heldout == pytest.approx(error, rel=0.1)
    assert fitted.trusted(asked).mean() > 0.99


def test_a_plane_of_many_rows_has_no_units():
    X, _ = rows_of(12_000)
    fitted = fit(X, 1.0 + X @ [1.0, -2.0, 0.5], effort=0.02)
    assert fitted.units == 0
    assert fitted.heldout < 1e-9


@pytest.mark.full
def test_the_error_of_a_rough_target_is_told():
    X, _ = rows_of(12_000)
    rough = np.sign(np.sin(9.0 * X[:, 0]) * np.sin(9.0 * X[:, 1])) + 0.1 * X[:, 2]
    fitted = fit(X, rough, effort=0.005)
    asked = rows_of(3000, seed=4)[0]
    wanted = np.sign(np.sin(9.0 * asked[:, 0]) * np.sin(9.0 * asked[:, 1])) + 0.1 * asked[:, 2]
    error = np.sqrt(((fitted.predict(asked) - wanted) ** 2).mean()) / rough.std()
    assert error < 1.0
    assert fitted.heldout == pytest.approx(error, rel=0.1)
