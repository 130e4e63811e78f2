"""Several networks of an energy as their mean."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from palpate.learning.energy.average import average
from palpate.learning.energy.search import Problem, Search


def waves(count, seed):
    """Values, slopes and curvatures of more waves than few units can follow, as a search is given them."""
    X = np.random.default_rng(seed).uniform(-1, 1, (count, 2))
    k = np.array([[4.0, 3.0], [-3.0, 5.0], [5.0, -1.0]])
    phase = X @ k.T + np.array([0.0, 1.0, 2.0])
    Y = np.sin(phase).sum(axis=1)
    slopes = np.cos(phase) @ k
    curvatures = -np.sin(phase) @ np.stack([k[:, 0] ** 2, k[:, 0] * k[:, 1], k[:, 1] ** 2], axis=1)
    ones = np.ones(count)
    return X, {
        "Y": Y[:, None],
        "weights": ones,
        "slopes": slopes[:, None],
        "slope_weight": np.ones((count, 2)),
        "curvatures": curvatures[:, None],
        "curvature_weight": np.ones((count, 3)),
    }


@pytest.fixture(scope="module")
def search():
    X, rows = waves(25, 0)
    problem = Problem(X, rows, None, "")
    search = Search(problem, time.monotonic() + 60.0)
    for radial in ("gaussian", "matern-5/2"):
        of = problem.regressors("axis-aligned", radial)
        for _ in range(4):
            search.tried(search.random(of, 4), of, "random", 30)
    return search


def answers(found, X):
    """Of a mean's units and tail (N, 1)."""
    of = found.regressors
    return np.hstack([of.tail_rows(X), of.phi(X, found.theta)]) @ found.coefficients


def test_a_mean_answers_what_its_networks_do_on_average(search):
    found = average(search, 4)
    assert found.networks > 1
    X = np.random.default_rng(5).uniform(-1, 1, (30, 2))
    answer = answers(found, X)
    members = [one.predict(X) for one in found.members]
    np.testing.assert_allclose(answer, np.mean(members, axis=0), rtol=1e-10, atol=1e-12)


def test_what_a_mean_misses_of_a_solve_left_out_is_the_mean_of_what_its_networks_miss(search):
    found = average(search, 4)
    missed = np.mean([search.problem.missed(one).errors for one in found.members], axis=0)
    rows = search.problem.missed(found.members[0]).rows
    by_solve = [np.linalg.norm(missed[rows.samples == i]) for i in range(25)]
    assert found.error == pytest.approx(np.mean(by_solve), rel=1e-9)
    alone = [one.error for one in search.found if any(one.network is member for member in found.members)]
    assert found.error < np.mean(alone)
    assert found.error <= 1.1 * search.error  # of the best network alone


def test_unseen_answers_are_nearer_than_the_networks_on_average(search):
    """The error of a mean is below the mean of the squared errors, by what its networks differ (Krogh & Vedelsby)."""
    found = average(search, 4)
    X, rows = waves(200, 1)
    squares = [np.mean((one.predict(X) - rows["Y"]) ** 2) for one in found.members]
    answer = answers(found, X)
    assert np.mean((answer - rows["Y"]) ** 2) < np.mean(squares)


def test_one_network_is_the_best(search):
    found = average(search, 1)
    assert (found.networks, found.error) == (1, search.error)
    np.testing.assert_array_equal(found.theta, search.best.theta)


def test_the_second_network_is_that_with_which_the_mean_misses_least(search):
    found = average(search, 2)
    best = found.members[0]
    networks = [one.network for one in search.found]
    same = [one for one in networks if one.regressors.radial == best.regressors.radial]
    alone = search.problem.missed(best)

    def missed(other):
        return replace(alone, errors=(alone.errors + search.problem.missed(other).errors) / 2).mean

    assert found.error == pytest.approx(min(missed(one) for one in same if one is not best), rel=1e-12)


def test_no_more_units_than_a_query_has_time_for(search):
    assert len(average(search, 4, units=9).theta) <= 9
