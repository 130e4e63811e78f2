"""The energy of a held pad, whatever was learnt: nothing at rest, one energy, its continuation."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from touch_made import SOFT, differences, network

from allocated import kept_by
from held import INPUTS, drawn
from palpate.errors import UsageError
from palpate.network import TrainedRegion
from palpate.surrogates import LearntEnergy, PadBaseline, RestStiffness, Stiffening
from palpate.surrogates import energy as energy_module
from palpate.surrogates.baselines.rest_stiffness import terms
from palpate.surrogates.baselines.stiffening import exponents

CURVED = (*INPUTS, dataclasses.replace(INPUTS[4], name="p_z"), SOFT)


def made(inputs=INPUTS, degree=2, seed=1, **more) -> LearntEnergy:
    rng, k = np.random.default_rng(seed), len(inputs) - 3
    C = rng.normal(0.0, 0.3, (len(terms(k, degree)), 6))
    C[0] = [8.0, 0.3, -0.4, 9.0, 0.5, 11.0]
    net = network(inputs, units=30, seed=seed, size=0.05)
    parts = {
        "region": TrainedRegion.of(rng.uniform(-1.0, 1.0, (300, len(inputs)))),
        "root": 0.002 * rng.normal(size=(1 + len(inputs) + 30, 12)),
    }
    stiffening = more.pop("stiffening", Stiffening.none(len(inputs)))
    return LearntEnergy(net, PadBaseline(RestStiffness(C, k), stiffening), **(parts | more))


def wide(inputs, count, seed=2):
    low, high = np.array([[r.low for r in inputs], [r.high for r in inputs]])
    more = 0.6 * (high - low)
    more[6:] = 0.0
    return np.random.default_rng(seed).uniform(low - more, high + more, (count, len(low)))


@pytest.mark.parametrize(
    "inputs", [INPUTS[:3], INPUTS, CURVED], ids=["fixed place", "face", "curved, family"]
)
@pytest.mark.parametrize("degree", [0, 2])
def test_at_rest_there_is_nothing_but_a_stiffness(inputs, degree):
    S = made(inputs, degree)
    X = wide(inputs, 200)
    X[:, :3] = 0.0
    assert not S.energy(X).any()
    assert not S.force(X).any()
    assert not S.deviation(X).any()
    K = S.stiffness(X)
    np.testing.assert_array_equal(K, K.transpose(0, 2, 1))
    assert (np.linalg.eigvalsh(K) < 0).all()


def test_small_displacements_meet_the_stiffness_at_rest():
    S, X = made(), drawn(50)
    X[:, :3] *= 1e-7 / 0.01
    rest = X.copy()
    rest[:, :3] = 0.0
    linear = np.einsum("nij,nj->ni", S.stiffness(rest), X[:, :3])
    # the next term is smaller by |d| |∇ℓ|, 1e-7 m times some 1e2/m
    np.testing.assert_allclose(S.force(X), linear, atol=1e-4 * np.abs(linear).max())


@pytest.mark.parametrize(
    "inputs", [INPUTS[:3], INPUTS, CURVED], ids=["fixed place", "face", "curved, family"]
)
def test_force_and_stiffness_are_derivatives_of_the_energy_by_the_displacement(inputs):
    S, h = made(inputs), 2e-5
    X = wide(inputs, 800)
    low, high = np.array([[r.low for r in inputs], [r.high for r in inputs]])[:, :3]
    # a third derivative jumps at a range's end
    X = X[(np.minimum(np.abs(X[:, :3] - low), np.abs(X[:, :3] - high)) > 4 * h).all(axis=1)]
    inside = S.inside(X)
    assert 0 < inside.sum() < len(X)
    F, K, steps = S.force(X), S.stiffness(X), np.full(3, h)
    # sixth order: (h/w)⁶ with w ≥ 5 mm is nothing; rounding leaves 1e-16 U/(h F) with U ≈ F |d|/2
    np.testing.assert_allclose(F, -differences(S.energy, X, steps), atol=1e-11 * np.abs(F).max() * 0.02 / h)
    np.testing.assert_allclose(K, differences(S.force, X, steps), atol=1e-11 * np.abs(F).max() / h)
    np.testing.assert_array_equal(K, K.transpose(0, 2, 1))


def test_what_is_held_elsewhere_has_another_energy_but_no_force_of_the_hand_does_that_work():
    """At a fixed displacement U changes with place, while d, and so the hand, stays: the work is not the hand's."""
    S = made()
    X = np.tile([0.004, -0.003, 0.006, -0.015, 0.01], (40, 1))
    X[:, 3] = np.linspace(-0.015, 0.015, 40)
    assert np.ptp(S.energy(X)) > 1e-3 * S.energy(X).max()
    assert np.ptp(X[:, :3], axis=0).max() == 0.0  # F·Δd = 0


def test_far_outside_the_energy_goes_on_as_that_of_a_linear_spring():
    S, X = made(), drawn(20)
    direction = X[:, :3] / np.linalg.norm(X[:, :3], axis=1, keepdims=True)
    far, farther = X.copy(), X.copy()
    far[:, :3], farther[:, :3] = 10.0 * direction, 20.0 * direction
    near_axes = np.abs(direction).min(axis=1) < 0.01  # such a component has not left its range
    np.testing.assert_allclose(S.energy(farther)[~near_axes], 4 * S.energy(far)[~near_axes], rtol=1e-9)
    assert not S.inside(far).any()


def test_many_answers_are_shared_by_threads_and_the_same_bits(monkeypatch):
    """Each thread has its own scratch, that of the stiffening polynomial too."""
    E = exponents(len(INPUTS), 3)
    law = Stiffening(np.random.default_rng(3).normal(0.0, 0.1, len(E)), E)
    S, X = made(stiffening=law), wide(INPUTS, 20_001)
    monkeypatch.setattr(energy_module, "available_cores", lambda: 1)
    alone = S.force(X)
    monkeypatch.setattr(energy_module, "available_cores", lambda: 3)
    np.testing.assert_array_equal(S.force(X), alone)


def test_the_evaluator_says_the_same_and_allocates_nothing():
    S, X = made(), wide(INPUTS, 200)
    ev = S.evaluator()
    for x in X:
        ev(x[:3], x[3:])
        row = x[None]
        np.testing.assert_array_equal(ev.force, S.force(row)[0])
        np.testing.assert_array_equal(ev.stiffness, S.stiffness(row)[0])
        assert (ev.energy, ev.inside) == (S.energy(row)[0], S.inside(row)[0])
        assert ev.depth == pytest.approx(np.linalg.norm(x[:3]), rel=1e-15)
        assert ev.trust(x[:3], x[3:]) == S.deviation(row)[0]
    d, p = X[0, :3].copy(), X[0, 3:].copy()
    assert kept_by(lambda: ev(d, p)) < 500
    with pytest.raises(UsageError, match="can't be answered"):
        ev(d, np.zeros(3))
    ev(np.array([np.nan, 0.0, 0.0]), p)
    assert np.isnan(ev.force).all()
    assert not ev.inside


def test_parts_that_do_not_fit_are_refused():
    S = made()
    with pytest.raises(UsageError, match="stiffness at rest depends on 3 inputs"):
        LearntEnergy(S.network, PadBaseline(RestStiffness(np.ones((1, 6)), 3), Stiffening.none(5)))
    with pytest.raises(UsageError, match="region has 3"):
        made(region=TrainedRegion.of(np.zeros((1, 3))))
    with pytest.raises(UsageError, match="posterior"):
        made(root=np.zeros((3, 3)))
    with pytest.raises(UsageError, match="no stiffness at rest"):
        RestStiffness(np.ones((2, 6)), 2)
    with pytest.raises(UsageError, match="holds nothing"):
        RestStiffness.even(np.diag([1.0, -1.0, 1.0]))
    with pytest.raises(UsageError, match="shape"):
        S.force(np.zeros((2, 3)))


def test_an_even_stiffness_is_the_square_of_its_root():
    A = np.array([[3.0, 0.4, -0.2], [0.4, 2.0, 0.1], [-0.2, 0.1, 5.0]])
    rest = RestStiffness.even(A, 2)
    S = rest.root(np.zeros((1, 2)))[0]
    np.testing.assert_allclose(S @ S, A, rtol=1e-14, atol=1e-14)
    assert 0 < rest.least(np.zeros((1, 2))) <= 1
