"""Errors that no unit of measurement can spoil."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning.arrays.array_samples import ArrayProblem
from palpate.learning.learn import automatic, ranges_of
from palpate.rbf.sample_checks import relative_error, spread_of
from palpate.units import Quantity

RNG = np.random.default_rng(0)
X, Y = RNG.uniform(-1, 1, (40, 2)), RNG.normal(size=(40, 3))
OUTPUTS = [Quantity(f"y{i}") for i in range(3)]


@pytest.mark.parametrize("unit", [1e-300, 1e-200, 1e-3, 1e200, 1e300])
def test_the_unit_does_not_matter(unit):
    assert spread_of(unit * Y) / unit == pytest.approx(spread_of(Y), rel=1e-12)
    error = relative_error(unit * (Y + 0.1), unit * Y, spread_of(unit * Y))
    assert error == pytest.approx(0.1 / spread_of(Y), rel=1e-9)


def test_spread_is_the_deviation_from_each_outputs_mean():
    far = Y + np.array([0.0, 3.0, -5.0])
    assert spread_of(far) == pytest.approx(np.sqrt(((Y - Y.mean(axis=0)) ** 2).mean()), rel=1e-12)
    assert spread_of(np.zeros((4, 2))) == 1.0
    assert spread_of(np.full((4, 2), 2.0)) == 1.0


@pytest.mark.parametrize("unit", [1e-200, 1e200])
def test_a_problem_is_the_same_in_any_unit(unit):
    here, there = (
        ArrayProblem.of(X, Y, ranges_of(X), OUTPUTS),
        ArrayProblem.of(X, unit * Y, ranges_of(X), OUTPUTS),
    )
    np.testing.assert_allclose(there.Y @ there.basis, here.Y @ here.basis, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(there.scaling.output_scale / unit, here.scaling.output_scale, rtol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize("unit", [1e-200, 1e200])
def test_thresholds_are_the_same_in_any_unit(unit):
    given = automatic(X, unit * Y, target=0.3, passes=1)
    wanted = automatic(X, Y, target=0.3, passes=1)
    assert given.distance_min == wanted.distance_min
    assert given.error_min == pytest.approx(wanted.error_min, rel=1e-9)
    assert given.noise == pytest.approx(wanted.noise, rel=1e-6)


@pytest.mark.full
def test_lists_are_samples_too():
    assert automatic(X.tolist(), Y.tolist(), target=0.3, passes=1) == automatic(X, Y, target=0.3, passes=1)


@pytest.mark.parametrize(
    ("x", "y"),
    [
        (X, Y[:, 0]),
        (X[:, 0], Y),
        (X[:0], Y[:0]),
        (X, Y[:-1]),
        (X, np.full_like(Y, np.nan)),
        (np.full_like(X, np.inf), Y),
    ],
)
def test_what_is_no_samples_is_refused(x, y):
    for ask in (lambda: automatic(x, y, target=0.1), lambda: ArrayProblem.of(x, y, ranges_of(X), OUTPUTS)):
        with pytest.raises(UsageError) as caught:
            ask()
        assert caught.value.fix


def test_ranges_do_not_fit_other_samples():
    with pytest.raises(UsageError, match=r"\(any, 3\)"):
        automatic(X, Y, ranges_of(np.zeros((1, 3))), target=0.1)
    with pytest.raises(UsageError, match="Weights"):
        automatic(X, Y, target=0.1, weights=np.ones(3))
    with pytest.raises(UsageError, match="shape"):
        ranges_of(X[:, 0])
