"""The rules of choice: against recomputation, brute force, and what symmetry and failures ask of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pressed_problem import DEEPEST, RADIUS, PressedSlab, truth

from palpate.improvement.choice_rules import (
    VarianceChoice,
    choose_by_disagreement,
    choose_by_variance,
    choose_farthest,
    image_distances,
)
from palpate.improvement.force_model import ForceModel
from palpate.learning.gradient_process import Observations
from palpate.rbf.symmetric_units import Images
from palpate.surrogates import ContactBaseline, ContactLaw, Solves, TouchedSurface

PROBLEM = PressedSlab()
MIRROR = np.array([np.eye(3), np.diag([1.0, -1.0, 1.0])])


@pytest.fixture(scope="module")
def model() -> ForceModel:
    """A model of twelve solves of the slab, which is symmetric in y."""
    layout = PROBLEM.layout
    surface = TouchedSurface.of(layout.rest, layout.triangles, radius=RADIUS, spacing=0.003)
    X = PROBLEM.design(12)
    U, F, K = truth(X)
    solves = Solves(X, U, F, K, PROBLEM.ranges, MIRROR, np.zeros(3))
    return ForceModel.fit(solves, ContactBaseline(ContactLaw("pad"), surface, RADIUS))


def candidates(count: int = 14) -> np.ndarray:
    X = PROBLEM.design(count, seed=5)
    X[:, 2] = np.minimum(X[:, 2], RADIUS - 0.1 * DEEPEST)
    return X


def summed_error(model: ForceModel, X: np.ndarray, chosen: list[int]) -> float:
    """Σ_r tr(A_r P_rr A_rᵀ) after solves at some candidates, by a process that has seen them too."""
    process, weights = model.process, model.weights(X)[chosen]
    seen = Observations(
        np.vstack([process.seen.X, model.scaled(X)[chosen]]),
        np.vstack([process.seen.targets, np.zeros((len(chosen), 4))]),
        np.vstack([process.seen.weights, weights]),
    )
    after = replace(process, seen=seen)
    P = (process.variance / after.variance * after.posterior(model.scaled(X))).reshape(len(X), 4, len(X), 4)
    A = model.error_maps(X)
    return float(sum(np.trace(A[r] @ P[r, :, r] @ A[r].T) for r in range(len(X))))


def test_the_force_that_is_expected_is_minus_the_slope_of_its_energy(model):
    X, h = candidates(5), 1e-7
    _, F = model.energy_and_force(X)
    for i in range(3):
        step = h * np.eye(3)[i]
        up, down = (model.energy_and_force(X + sign * step)[0] for sign in (1, -1))
        assert F[:, i] == pytest.approx(-(up - down) / (2 * h), rel=1e-5, abs=1e-6)
    felt = truth(X)[1]
    assert np.linalg.norm(model.force(X) - felt, axis=1).max() < 0.2 * np.linalg.norm(felt, axis=1).max()


def test_error_maps_take_small_errors_of_the_energy_to_the_force(model):
    """An error δℓ and δ∇ℓ at a place, made by hand in U and F, is A (δℓ, δ∇ℓ) to first order."""
    X = candidates(4)
    _, F = model.energy_and_force(X)
    A, size = model.error_maps(X), np.linalg.norm(F, axis=1)
    size = np.maximum(size, 0.05 * model.largest)
    delta = 1e-6 * np.random.default_rng(1).normal(size=(4, 4))
    expected = model.process.predict(model.scaled(X)) + delta
    value, first, _ = model.baseline.logarithm(X, model.inputs)
    other = -np.exp(expected[:, 0] + value)[:, None] * (expected[:, 1:] / model.half + first)
    change = (other - F) / size[:, None] * np.sqrt(model.baseline.row_weights(X))[:, None]
    assert np.einsum("rkm,rm->rk", A, delta) == pytest.approx(change, rel=1e-4, abs=1e-11)


def test_the_posterior_brought_up_to_date_is_that_computed_anew(model):
    X = candidates()
    state = VarianceChoice.of(model.process, model.scaled(X), model.error_maps(X), model.weights(X))
    before = summed_error(model, X, [])
    fall = state.falls(np.array([[3], [8]]))
    assert before - fall[1] == pytest.approx(summed_error(model, X, [8]), rel=1e-6)
    assert before - fall[0] == pytest.approx(summed_error(model, X, [3]), rel=1e-6)
    pair = state.falls(np.array([[3, 8]]))[0]
    assert before - pair == pytest.approx(summed_error(model, X, [3, 8]), rel=1e-6)
    state.condition(np.array([8]))
    assert fall[1] + state.falls(np.array([[3]]))[0] == pytest.approx(pair, rel=1e-6)
    assert state.W.reshape(len(X), 3, -1) == pytest.approx(
        np.einsum("rkm,rmx->rkx", model.error_maps(X), state.P.reshape(len(X), 4, -1)), abs=1e-12
    )


def test_picks_by_variance_are_those_of_brute_force(model):
    X = candidates(10)
    groups = [np.array([i]) for i in range(10)]
    picks = choose_by_variance(model, X, groups, np.ones(10), 3, taken=X[:0], farthest_every=0)
    chosen: list[int] = []
    for _ in range(3):
        left = [i for i in range(10) if i not in chosen]
        chosen.append(min(left, key=lambda i: summed_error(model, X, [*chosen, i])))
    assert picks == chosen


def test_a_series_is_chosen_where_it_is_worth_its_cost(model):
    X = candidates(9)
    groups = [np.array([i]) for i in range(6)] + [np.array([6, 7, 8])]
    cheap = np.array([1.0] * 6 + [0.1])
    assert choose_by_variance(model, X, groups, cheap, 1, taken=X[:0], farthest_every=0) == [6]
    dear = np.array([1.0] * 6 + [100.0])
    assert choose_by_variance(model, X, groups, dear, 6, taken=X[:0], farthest_every=0)[-1] != 6


def test_nothing_is_chosen_beside_a_solve_that_failed(model):
    X = candidates(10)
    groups = [np.array([i]) for i in range(10)]
    common = {"taken": X[:0], "farthest_every": 0}
    first = choose_by_variance(model, X, groups, np.ones(10), 2, **common)
    again = choose_by_variance(model, X, groups, np.ones(10), 1, failed=X[[first[0]]], **common)
    assert again == [first[1]]


def test_errors_count_where_a_hand_goes(model):
    """With weight at one place alone, its own solve and those beside it are worth most."""
    X = candidates(10)
    groups = [np.array([i]) for i in range(10)]
    for place in (2, 7):
        picks = choose_by_variance(
            model, X, groups, np.ones(10), 1, taken=X[:0], interest=np.eye(10)[place], farthest_every=0
        )
        assert picks == [place]


def test_one_pick_in_four_is_the_farthest(model):
    X = candidates(12)
    groups = [np.array([i]) for i in range(12)]
    picks = choose_by_variance(model, X, groups, np.ones(12), 4, taken=PROBLEM.design(12))
    scaled = model.scaled(np.concatenate([PROBLEM.design(12), X[picks[:3]]]))
    left = [i for i in range(12) if i not in picks[:3]]
    distance = image_distances(model.scaled(X[left]), scaled, model.half, model.images).min(axis=1)
    assert picks[3] == left[int(np.argmax(distance))]


def test_the_mirror_image_of_a_solve_is_as_good_as_solved(model):
    seen = PROBLEM.design(12)
    mirrored = seen * [1.0, -1.0, 1.0]
    distance = image_distances(model.scaled(mirrored), model.scaled(seen), model.half, model.images)
    assert np.diag(distance) == pytest.approx(0.0, abs=1e-12)
    X = np.concatenate([mirrored, candidates(4)])
    assert min(choose_farthest(model.scaled(X), model.scaled(seen), model.half, model.images, 4)) >= 12
    state = VarianceChoice.of(model.process, model.scaled(X), model.error_maps(X), model.weights(X))
    falls = state.falls(np.arange(len(X))[:, None])
    assert falls[:12].max() < falls[12:].max()


def test_farthest_points_of_a_square_are_its_corners():
    X = np.array([[x, y, 0.0] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)])
    nothing = Images(np.eye(3)[None], np.zeros((1, 3)))
    picks = choose_farthest(X, np.zeros((1, 3)), np.ones(3), nothing, 4)
    assert np.abs(X[picks]).sum(axis=1).tolist() == [2.0] * 4


def test_models_disagree_where_nothing_was_solved(model):
    """Solves of one half of the slab leave the other to guesses."""
    X = candidates(40)
    rows = model.process.seen.X[:, 0] < 0
    half = replace(model, process=replace(model.process, seen=model.process.seen.take(rows)))
    picks = choose_by_disagreement(half, X, 4)
    assert len(set(picks)) == 4
    assert (X[picks[:2], 0] > 0).all()
