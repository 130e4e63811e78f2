"""Several networks of an energy as their mean."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from palpate.learning.energy.average import average
from palpate.learning.energy.judging import judged, left_out_again
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


@pytest.fixture(scope="module")
def networks(search):
    return judged(search, np.inf)


def answers(found, X):
    """Of a mean's units and tail (N, 1)."""
    of = found.regressors
    return np.hstack([of.tail_rows(X), of.phi(X, found.theta)]) @ found.coefficients


def test_a_mean_answers_what_its_networks_do_on_average(networks):
    found = average(networks, 4)
    assert found.networks > 1
    X = np.random.default_rng(5).uniform(-1, 1, (30, 2))
    answer = answers(found, X)
    members = [one.predict(X) for one in found.members]
    np.testing.assert_allclose(answer, np.mean(members, axis=0), rtol=1e-10, atol=1e-12)


def test_what_a_mean_misses_of_a_solve_left_out_is_the_mean_of_what_its_networks_miss(search, networks):
    found = average(networks, 4)
    rows = search.problem.missed(found.members[0]).rows

    def mean(miss):
        missed = np.mean([miss(one).errors for one in found.members], axis=0)
        return np.mean([np.linalg.norm(missed[rows.samples == i]) for i in range(25)])

    again = mean(lambda one: left_out_again(one, search.problem))
    assert found.left_out.mean == pytest.approx(again, rel=1e-9)
    assert found.error == pytest.approx(np.sqrt(again * mean(search.problem.missed)), rel=1e-9)
    members = {id(one) for one in found.members}
    alone = [one.error for one in networks if id(one.members[0]) in members]
    assert len(alone) == found.networks > 1
    assert found.error < np.mean(alone)
    assert found.error <= 1.1 * min(one.error for one in networks)


def test_unseen_answers_are_nearer_than_the_networks_on_average(networks):
    """The error of a mean is below the mean of the squared errors, by what its networks differ (Krogh & Vedelsby)."""
    found = average(networks, 4)
    X, rows = waves(200, 1)
    squares = [np.mean((one.predict(X) - rows["Y"]) ** 2) for one in found.members]
    answer = answers(found, X)
    assert np.mean((answer - rows["Y"]) ** 2) < np.mean(squares)


def test_one_network_is_the_best(networks):
    found, best = average(networks, 1), min(networks, key=lambda one: one.error)
    assert (found.networks, found.error) == (1, best.error)
    np.testing.assert_array_equal(found.theta, best.members[0].theta)


def test_the_second_network_is_that_with_which_the_mean_misses_least(networks):
    found = average(networks, 2)
    best = next(one for one in networks if one.members[0] is found.members[0])
    radial = best.members[0].regressors.radial
    others = [one for one in networks if one is not best and one.members[0].regressors.radial == radial]

    def together(other):
        both = (getattr(best, kind).errors + getattr(other, kind).errors for kind in ("left_out", "closed"))
        return np.prod([np.sqrt(replace(best.left_out, errors=errors / 2).mean) for errors in both])

    assert found.error == pytest.approx(min(map(together, others)), rel=1e-12)


def test_no_more_units_than_a_query_has_time_for(networks):
    assert len(average(networks, 4, units=9).theta) <= 9
