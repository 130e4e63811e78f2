"""Errors of networks at solves that they were refined again without, and how samples are split for it."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.learning.energy.energy_problem import EnergyProblem
from palpate.learning.energy.energy_search import best_mean, score
from palpate.learning.folds import fold_numbers, held_out, near_places
from palpate.learning.search import Candidate, Search
from palpate.learning.starts import random_units

GROUPS = np.repeat(np.arange(10), 3)
WAVES = np.array([[4.0, 3.0], [-3.0, 5.0], [2.0, -1.0]])


def wave(X):
    """Values (N,) and slopes (N, 2)."""
    phase = X @ WAVES.T + np.array([0.0, 1.0, 2.0])
    return np.sin(phase).sum(axis=1), np.cos(phase) @ WAVES


def problem_of(X, Y, slopes, groups=GROUPS):
    count = len(X)
    known = {
        "Y": Y[:, None],
        "weights": np.random.default_rng(9).uniform(0.5, 2.0, count),
        "slopes": slopes[:, None],
        "slope_weight": np.ones((count, 2)),
        "curvatures": np.zeros((count, 1, 3)),
        "curvature_weight": np.zeros((count, 3)),
        "groups": groups,
    }
    return EnergyProblem(X, known, None, ridge=1e-12)  # a penalty would bias what is exact


def places(count, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (count, 2))


def unitless(problem):
    """The affine tail alone."""
    of = problem.regressors("rotated", "gaussian")
    return problem.refined(np.zeros((0, of.form.size)), of, iterations=0)


def test_a_plane_is_fitted_again_without_each_fold():
    X = places(30)
    problem = problem_of(X, *wave(X))
    network = unitless(problem)
    found = problem.cross_validate(network)
    rows, fold = found.rows, found.together[found.rows.samples]
    A, b = rows.matrix(network.theta), rows.targets
    for k in range(8):
        C = np.linalg.lstsq(A[fold != k], b[fold != k], rcond=None)[0]
        np.testing.assert_allclose(
            found.errors[fold == k], b[fold == k] - A[fold == k] @ C, rtol=1e-6, atol=1e-9
        )


def test_groups_alone_in_their_folds_are_missed_by_the_closed_form():
    """Allen's (1974), for eight groups of three or four."""
    X = places(30)
    problem = problem_of(X, *wave(X), groups=np.arange(30) % 8)
    network = unitless(problem)
    found, closed = problem.cross_validate(network), problem.missed(network)
    np.testing.assert_allclose(found.errors, closed.errors, rtol=1e-6, atol=1e-9)
    assert found.mean == pytest.approx(closed.mean, rel=1e-6)


def test_what_such_units_have_made_is_answered_where_it_is_left_out():
    X = places(30)
    of = problem_of(X, np.zeros(30), np.zeros((30, 2))).regressors("rotated", "gaussian")
    theta = np.array([of.form.unit(np.array(c), 0.8) for c in ([-0.4, 0.3], [0.5, -0.2])])
    weights = np.array([1.0, -2.0])
    problem = problem_of(X, of.phi(X, theta) @ weights, np.einsum("nlk,k->nl", of.slopes(X, theta), weights))
    network = problem.refined(theta, of, iterations=30)
    assert np.abs(problem.cross_validate(network).errors).max() < 1e-8


@pytest.mark.parametrize("count", [1, 2, 8, 9, 50])
def test_folds_are_of_whole_groups_and_of_like_numbers(count):
    groups = np.random.default_rng(2).permutation(np.repeat(np.arange(count), 3))
    fold = fold_numbers(groups, 8)
    assert all(len(np.unique(fold[groups == g])) == 1 for g in range(count))
    sizes = np.bincount(fold) // 3
    assert len(sizes) == min(count, 8)
    assert sizes.max() - sizes.min() <= 1
    np.testing.assert_array_equal(fold, fold_numbers(groups, 8))


def test_a_single_group_is_left_to_the_closed_form():
    X = places(6)
    problem = problem_of(X, *wave(X), groups=np.zeros(6, dtype=int))
    network = unitless(problem)
    np.testing.assert_array_equal(problem.cross_validate(network).errors, problem.missed(network).errors)


@pytest.mark.parametrize("copies", [1, 3])
@pytest.mark.parametrize("fold", [0, 2, 7])
def test_what_is_held_out_is_at_places_of_its_own(copies, fold):
    place = np.repeat(np.arange(20), copies)
    kept, held = held_out(place, 0.2, seed=1, fold=fold)
    assert sorted([*kept, *np.flatnonzero(held)]) == list(range(len(place)))
    assert held.sum() == 4 * copies
    assert not set(place[kept]) & set(place[held])
    assert (held != held_out(place, 0.2, seed=1, fold=1)[1]).any()


@pytest.mark.parametrize("inputs", [3, 9])
def test_rows_that_are_nearly_copies_are_at_one_place(inputs):
    rng = np.random.default_rng(inputs)
    alone, copied = rng.uniform(-1, 1, (2000, inputs)), rng.uniform(-1, 1, (100, inputs))
    copies = np.repeat(copied, 3, axis=0) + 1e-6 * rng.normal(size=(300, inputs))
    places = near_places(np.vstack([alone, copies]))
    assert (np.ptp(places[2000:].reshape(100, 3), axis=1) == 0).all()
    assert len(np.unique(places)) > 2090


@pytest.mark.full
def test_errors_are_as_large_as_at_places_never_seen():
    X, rng = places(40), np.random.default_rng(0)
    problem = problem_of(X, *wave(X), groups=np.arange(40))
    of, search = problem.regressors("axis-aligned", "gaussian"), Search(problem)
    search.try_all(
        [Candidate(of, random_units(of.form, X, 9, rng, scatter=0.05), "random") for _ in range(4)], 40
    )
    found = best_mean(problem, [score(problem, one) for one in search.tried], 4)
    rows = found.left_out.rows
    values = found.left_out.errors[:40] @ rows.modes / rows.scale[:, None]
    new = places(400, 1)
    answer = np.mean([one.predict(new)[:, 0] for one in found.members], axis=0)
    ratio = np.median(np.abs(values)) / np.median(np.abs(answer - wave(new)[0]))
    # the median of 40 such errors is known to about a third, so three times that is allowed
    assert 0.4 < ratio < 2.5
