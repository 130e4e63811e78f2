"""A held body learnt from solves, against springs whose energy is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from held import INPUTS, SQUARE, drawn, held
from palpate.errors import UsageError
from palpate.learning.energy import learn_energy
from palpate.learning.energy.energy_samples import EnergySamples
from palpate.learning.pad_fit import fit_pad
from palpate.surrogates import PadBaseline, RestStiffness, Solves, Stiffening, Surrogate
from palpate.surrogates.baselines.stiffening import exponents, powers
from palpate.validation import TouchSolves, validate

QUICK = {"effort": 0.2, "form": "rotated", "radial": "inverse-multiquadric", "units_max": 16}


def solves(X, U, F, K, symmetry=(), axes=(0, 1)):
    return Solves(X, U, F, K, INPUTS, np.array(symmetry, float).reshape(-1, 3, 3), axes=axes)


def learnt(count=16, *, derivatives=True, symmetry=SQUARE, degree="auto", stiffening="auto", **more):
    X = drawn(count)
    U, F, K = held(X)
    if not derivatives:
        F, K = F[:, :3], K[:, :3, :3]
    known = solves(X, U, F, K, symmetry)
    baseline, _ = fit_pad(known, degree=degree, stiffening=stiffening)
    return learn_energy(known, baseline, **({"networks": 4} | QUICK | more))


@pytest.fixture(scope="module")
def square():
    return learnt()


def test_the_springs_are_an_energy_and_its_derivatives():
    X, h = drawn(20), 1e-6
    _, F, K = held(X)
    for i in range(5):
        up, down = X + h * np.eye(5)[i], X - h * np.eye(5)[i]
        # second order in h of lengths of 20 mm and more, plus rounding of 1e-16 U/h
        np.testing.assert_allclose(F[:, i], -(held(up)[0] - held(down)[0]) / (2 * h), atol=1e-8)
        np.testing.assert_allclose(K[:, i], (held(up)[1] - held(down)[1]) / (2 * h), atol=1e-6)


def test_few_solves_of_a_symmetric_body_teach_its_force_and_stiffness():
    test = drawn(200, seed=9)
    U, F, K = held(test)
    energy, _ = learnt(units_max=0)  # the law alone
    validation = validate(Surrogate(energy), TouchSolves(test, F[:, :3], U, K[:, :3, :3]))
    assert validation.force.median < 0.01
    assert validation.force.p95 < 0.035
    assert validation.stiffness.p95 < 0.08
    assert validation.loops.max < 1e-9
    assert validation.border_loops.max < 1e-9


@pytest.mark.full
def test_images_of_a_solve_get_images_of_its_force(square):
    S, X = square[0], drawn(30, seed=4)
    for M in SQUARE:
        turned = X.copy()
        turned[:, :3], turned[:, 3:] = X[:, :3] @ M.T, X[:, 3:] @ M[:2, :2].T
        # exact but for rounding in sums over images
        np.testing.assert_allclose(S.energy(turned), S.energy(X), rtol=1e-9)
        np.testing.assert_allclose(S.force(turned), S.force(X) @ M.T, atol=1e-9 * np.abs(S.force(X)).max())


@pytest.mark.full
def test_the_samples_of_a_known_law_are_its_polynomial():
    """Solves of U = ½ ‖S d‖² exp P have ℓ + P = P with all derivatives, whatever S and P are."""
    rng = np.random.default_rng(0)
    rest = RestStiffness(np.vstack([[8, 0.3, -0.4, 9, 0.5, 11], rng.normal(0, 0.5, (5, 6))]), 2)
    E = exponents(5, 3)
    P = Stiffening(rng.normal(0, 0.1, len(E)), E)
    X, half = drawn(12), np.array([(r.high - r.low) / 2 for r in INPUTS])

    def energy(X):
        z = X / half  # the ranges' middles are zero
        S = rest.root(z[:, 3:])
        return (np.einsum("nij,nj->ni", S, X[:, :3]) ** 2).sum(axis=1) / 2 * np.exp(P.at(z)[0])

    def slope(f, X, i, h):
        up, down = X.copy(), X.copy()
        up[:, i] += h
        down[:, i] -= h
        return (8 * (f(up) - f(down))) / (16 * h)

    F = -np.stack([slope(energy, X, i, 1e-7) for i in range(5)], axis=1)
    K = -np.stack([np.stack([slope(lambda Y, i=i: slope(energy, Y, i, 1e-5), X, j, 1e-5) for j in range(5)], 1)
                   for i in range(5)], 1)  # fmt: skip
    baseline = PadBaseline(rest, P)
    samples = EnergySamples.of(solves(X, energy(X), F, K), baseline)
    value, slopes, bends = samples.targets(baseline)
    np.testing.assert_allclose(value, 0.0, atol=1e-12)
    # differences: 1e-16 U/h of rounding against F h, then 1e-16 U/h² against K h², and (h/mm)² of truncation
    np.testing.assert_allclose(slopes, 0.0, atol=1e-6)
    np.testing.assert_allclose(bends, 0.0, atol=3e-4)


def test_a_law_that_is_the_form_itself_is_found():
    A = np.array([[80.0, 0, 0], [0, 80, 0], [0, 0, 120]])
    X = drawn(12)
    d = X[:, :3]
    U, F = np.einsum("ni,ij,nj->n", d, A, d) / 2, -d @ A
    K = np.broadcast_to(-A, (12, 3, 3))
    found, _ = fit_pad(solves(X, U, F, K, SQUARE), degree=0, stiffening=2)
    S = found.rest.root(np.zeros((1, 2)))[0]
    factor = np.exp(found.stiffening.at(np.zeros((1, 5)))[0])
    np.testing.assert_allclose(S @ S * factor, A, rtol=1e-4, atol=1e-3)


def test_a_pad_at_rest_tells_of_its_stiffness():
    X = drawn(10)
    rest = X[:4].copy()
    rest[:, :3] = 0.0
    U, F, K = held(np.vstack([X, rest]))
    known = solves(np.vstack([X, rest]), U, F, K)
    baseline, _ = fit_pad(known, degree=0, stiffening=2)
    rows = EnergySamples.of(known, baseline).rows(baseline)
    assert not rows["slope_weight"][10:].any()
    assert not rows["curvature_weight"][10:].any()
    assert np.isfinite(rows["Y"]).all()
    with pytest.raises(UsageError, match="displaced pad"):
        EnergySamples.of(solves(rest, U[10:], F[10:], K[10:]), baseline)


def test_monomials_and_their_derivatives():
    E, X = exponents(3, 4), np.random.default_rng(1).uniform(-1, 1, (5, 3))
    value, slope, bend = powers(X, E)
    h = 1e-5
    for i in range(3):
        up, down = X + h * np.eye(3)[i], X - h * np.eye(3)[i]
        # fourth derivatives are at most 24: h² times that, and rounding over h
        np.testing.assert_allclose(
            slope[:, :, i], (powers(up, E)[0] - powers(down, E)[0]) / (2 * h), atol=1e-8
        )
        np.testing.assert_allclose(
            bend[:, :, i], (powers(up, E)[1] - powers(down, E)[1]) / (2 * h), atol=1e-8
        )
    assert value.shape == (5, 35)


@pytest.mark.full
def test_without_symmetry_and_without_derivatives_by_place_it_still_learns():
    energy, _ = learnt(24, derivatives=False, symmetry=(), stiffening=2, degree=1, units_max=0)
    test = drawn(100, seed=9)
    F = held(test)[1][:, :3]
    errors = np.linalg.norm(energy.force(test) - F, axis=1) / np.linalg.norm(F, axis=1)
    assert np.median(errors) < 0.035  # what a hand does not notice


def test_what_can_not_be_learnt_is_refused():
    X = drawn(6)
    U, F, K = held(X)
    for changed, match in (
        ({"axes": (0, 1, 2)}, "does not fit"),
        ({"symmetry": (np.eye(3), np.eye(3)[[2, 1, 0]])}, "mixes"),
        ({"symmetry": (2 * np.eye(3),)}, "no isometry"),
    ):
        with pytest.raises(UsageError, match=match):
            fit_pad(solves(X, U, F, K, **changed))
    with pytest.raises(UsageError, match="stored no energy"):
        fit_pad(solves(X, 0 * U, F, K))
    with pytest.raises(UsageError, match="too few"):
        fit_pad(solves(X[:3], U[:3], F[:3], K[:3]))
    for changed, match in (({"seconds": 0.0}, "above 0"), ({"radial": "round"}, "option radial")):
        with pytest.raises(UsageError, match=match):
            learn_energy(
                solves(X, U, F, K),
                PadBaseline(RestStiffness.even(np.eye(3), 2), Stiffening.none(5)),
                **changed,
            )
