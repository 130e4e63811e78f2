"""Tables whose rows come in close triples f(x − h), f(x), f(x + h) teach no less than their centres alone."""

from __future__ import annotations

import numpy as np
import pytest

import palpate
from palpate.errors import FitWarning
from palpate.learning.arrays.array_samples import Samples
from palpate.learning.arrays.close_copies import problem_without_copies


def camel(X):
    """The six-hump camel function."""
    x, y = 2 * X[:, 0], X[:, 1]
    return (4 - 2.1 * x * x + x**4 / 3) * x * x + x * y + (4 * y * y - 4) * y * y


def wave(X):
    return np.sin(3 * X[:, 0]) * np.cos(X.sum(axis=1))


def box(count, inputs, seed=0):
    return np.random.default_rng([seed, count, inputs]).uniform(-1, 1, (count, inputs))


def triples(centres, step):
    aside = step * 2.0 * np.eye(centres.shape[1])[0]  # the step is a share of the range from −1 to 1
    return np.concatenate([centres - aside, centres, centres + aside])


def error(X, function):
    Z = box(1000, 2, 9)
    return np.sqrt(((palpate.fit(X, function(X), effort=0.02).predict(Z) - function(Z)) ** 2).mean())


@pytest.mark.full
def test_close_triples_teach_no_less_than_their_centres():
    centres = box(100, 2)
    alone = error(centres, camel)
    for step in (1e-2, 1e-3, 1e-6):
        assert error(triples(centres, step), camel) < 1.2 * alone


@pytest.mark.grid
@pytest.mark.parametrize("step", [0.0, 1e-6, 1e-3])
def test_copies_that_tell_nothing_are_left_out(step):
    centres = box(120, 3)
    X = triples(centres, step)
    samples, problem, places = problem_without_copies(Samples.of(X, wave(X)))
    assert len(samples.X) == len(problem.X) == len(places) == 120
    assert problem.record["training"]["samples"] == 360
    np.testing.assert_array_equal(X[list(samples.rows)], samples.X)
    # of three different rows the middle one
    np.testing.assert_array_equal(samples.X, centres)


@pytest.mark.parametrize("inputs", [1, 2, 5])
@pytest.mark.parametrize("count", [150, 1500])
def test_a_table_without_copies_is_learnt_as_it_is(inputs, count):
    samples = Samples.of(X := box(count, inputs), wave(X))
    assert problem_without_copies(samples)[0] is samples


@pytest.mark.parametrize("step", [0.0, 1e-6, 1e-3])
def test_copies_that_tell_a_noise_are_all_learnt_from(step):
    X = triples(box(120, 2), step)
    y = wave(X) + 0.05 * np.random.default_rng(0).normal(size=len(X))
    samples = Samples.of(X, y)
    assert problem_without_copies(samples)[0] is samples


@pytest.mark.full
def test_a_note_names_rows_of_the_whole_table():
    """One place whose three rows are wrong alike is told of by its row in the table that was given."""
    y = wave(X := triples(box(120, 2), 1e-6))
    y[[7, 127, 247]] += 3.0
    with pytest.warns(FitWarning, match="1 of 360 samples .* row 127,"):
        palpate.fit(X, y, effort=0.02)
