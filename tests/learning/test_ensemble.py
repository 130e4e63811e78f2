"""Several networks of an energy as their mean."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.learning.energy.energy_problem import EnergyProblem, mean_error
from palpate.learning.energy.energy_search import best_mean, score
from palpate.learning.search import Candidate, Search
from palpate.learning.starts import random_units


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
    problem, rng = EnergyProblem(X, rows, None), np.random.default_rng(0)
    search = Search(problem)
    for radial in ("gaussian", "matern-5/2"):
        of = problem.regressors("axis-aligned", radial)
        starts = [random_units(of.form, X, 4, rng, scatter=0.05) for _ in range(4)]
        search.try_all([Candidate(of, start, "random") for start in starts], 30)
    return search


@pytest.fixture(scope="module")
def networks(search):
    return [score(search.problem, candidate) for candidate in search.tried]


@pytest.fixture(scope="module")
def mean(search, networks):
    """The mean of so many of the networks that misses least."""
    return lambda most, **options: best_mean(search.problem, networks, most, **options)


def alone(search, one):
    """Error of one judged network."""
    return best_mean(search.problem, [one], 1).error


def answers(found, X):
    """Of a mean's units and tail (N, 1)."""
    of = found.regressors
    return np.hstack([of.tail_rows(X), of.phi(X, found.theta)]) @ found.coefficients


@pytest.mark.full
def test_a_mean_answers_what_its_networks_do_on_average(mean):
    found = mean(4)
    assert found.networks > 1
    X = np.random.default_rng(5).uniform(-1, 1, (30, 2))
    answer = answers(found, X)
    members = [one.predict(X) for one in found.members]
    np.testing.assert_allclose(answer, np.mean(members, axis=0), rtol=1e-10, atol=1e-12)


@pytest.mark.full
def test_what_a_mean_misses_of_a_solve_left_out_is_the_mean_of_what_its_networks_miss(search, networks, mean):
    problem, found = search.problem, mean(4)
    rows = problem.missed(found.members[0]).rows

    def of_all(miss):
        missed = np.mean([miss(one).errors for one in found.members], axis=0)
        return np.mean([np.linalg.norm(missed[rows.samples == i]) for i in range(25)])

    again = of_all(problem.cross_validate)
    assert found.left_out.mean == pytest.approx(again, rel=1e-9)
    assert found.error == pytest.approx(np.sqrt(again * of_all(problem.missed)), rel=1e-9)
    members = {id(one) for one in found.members}
    each = [alone(search, one) for one in networks if id(one.network) in members]
    assert len(each) == found.networks > 1
    assert found.error < np.mean(each)
    assert found.error <= 1.1 * min(alone(search, one) for one in networks)


@pytest.mark.full
def test_unseen_answers_are_nearer_than_the_networks_on_average(mean):
    """The error of a mean is below the mean of the squared errors, by what its networks differ (Krogh & Vedelsby)."""
    found = mean(4)
    X, rows = waves(200, 1)
    squares = [np.mean((one.predict(X) - rows["Y"]) ** 2) for one in found.members]
    answer = answers(found, X)
    assert np.mean((answer - rows["Y"]) ** 2) < np.mean(squares)


@pytest.mark.full
def test_one_network_is_the_best(search, networks, mean):
    found, best = mean(1), min(networks, key=lambda one: alone(search, one))
    assert (found.networks, found.error) == (1, alone(search, best))
    np.testing.assert_array_equal(found.theta, best.network.theta)


@pytest.mark.full
def test_the_second_network_is_that_with_which_the_mean_misses_least(search, networks, mean):
    found = mean(2)
    best = next(one for one in networks if one.network is found.members[0])
    rows = search.problem.fitted(best.network)[0]
    radial = best.network.regressors.radial
    others = [one for one in networks if one is not best and one.network.regressors.radial == radial]

    def together(other):
        both = zip(best.misses, other.misses, strict=True)
        return np.prod([np.sqrt(mean_error(rows, (a + b) / 2)) for a, b in both])

    assert found.error == pytest.approx(min(map(together, others)), rel=1e-12)


def test_no_more_units_than_a_query_has_time_for(mean):
    assert len(mean(4, units=9).theta) <= 9
