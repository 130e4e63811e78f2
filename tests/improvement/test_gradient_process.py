"""The process with gradients against derivatives by complex steps, dense conditioning and the symmetry it promises."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from palpate.learning.gradient_process import (
    LEVEL,
    SLOPE,
    GradientProcess,
    Observations,
    covariance,
    fit_process,
    no_symmetry,
    tied_inputs,
)
from palpate.rbf.symmetric_units import Images

STEP = 1e-30
LENGTHS = np.array([0.7, 0.7, 1.9])
RNG = np.random.default_rng(3)


def square() -> Images:
    """The symmetry of a square in x and y, about a point beside the origin of scaled inputs."""
    turns, about = [], np.array([0.2, 0.2, 0.0])
    for quarter in range(4):
        c, s = np.cos(quarter * np.pi / 2).round(), np.sin(quarter * np.pi / 2).round()
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turns += [turn, turn @ np.diag([1.0, -1.0, 1.0])]
    G = np.array(turns)
    return Images(G, about - G @ about)


GROUPS = {"without": no_symmetry(3), "square": square()}


def kernel(x: np.ndarray, z: np.ndarray, images: Images) -> complex:
    """The covariance of two values as the module's docstring writes it, for complex places too."""
    total, fixed = 0.0, images.shifts.mean(axis=0)
    for G, t in zip(images.turns, images.shifts, strict=True):
        image = G @ z + t
        total += (
            (1.0 + np.sum(((x - image) / LENGTHS) ** 2)) ** -0.5
            + LEVEL
            + SLOPE * np.sum((x - fixed) * (image - fixed))
        )
    return total / len(images.turns)


@pytest.mark.parametrize("images", GROUPS.values(), ids=GROUPS)
def test_covariances_of_slopes_are_derivatives_of_that_of_values(images):
    A, B = RNG.uniform(-1, 1, (2, 3)), RNG.uniform(-1, 1, (3, 3))
    K = covariance(A, B, LENGTHS, images)
    axes, h = np.eye(3), 1e-5
    for i, a in enumerate(A):
        for j, b in enumerate(B):
            assert K[i, 0, j, 0] == pytest.approx(kernel(a, b, images))
            by_a = [kernel(a + 1j * STEP * e, b, images).imag / STEP for e in axes]
            by_b = [kernel(a, b + 1j * STEP * e, images).imag / STEP for e in axes]
            assert K[i, 1:, j, 0] == pytest.approx(np.array(by_a), rel=1e-12, abs=1e-12)
            assert K[i, 0, j, 1:] == pytest.approx(np.array(by_b), rel=1e-12, abs=1e-12)
            both = [
                [
                    (
                        kernel(a + 1j * STEP * e, b + h * f, images)
                        - kernel(a + 1j * STEP * e, b - h * f, images)
                    ).imag
                    / (2 * h * STEP)
                    for f in axes
                ]
                for e in axes
            ]
            assert K[i, 1:, j, 1:] == pytest.approx(np.array(both), rel=1e-7, abs=1e-7)


def observations(count: int = 6) -> Observations:
    X = RNG.uniform(-1, 1, (count, 3))
    weights = RNG.uniform(0.2, 2.0, (count, 4))
    weights[1, 3] = 0.0  # a slope that is not known
    return Observations(X, RNG.normal(size=(count, 4)), weights)


@pytest.mark.parametrize("images", GROUPS.values(), ids=GROUPS)
def test_prediction_and_likelihood_are_those_of_the_joint_normal(images):
    """Conditioning by inverses of the whole joint covariance, and the density by SciPy."""
    seen, noise = observations(), 0.1
    process = GradientProcess(seen, images, LENGTHS, noise)
    X = RNG.uniform(-1, 1, (3, 3))
    known = np.flatnonzero(seen.weights.ravel() > 0)
    joint = covariance(np.vstack([seen.X, X]), np.vstack([seen.X, X]), LENGTHS, images).reshape(36, 36)
    S = joint[np.ix_(known, known)] + np.diag(noise**2 / seen.weights.ravel()[known])
    y, across = seen.targets.ravel()[known], joint[24:][:, known]
    inverse = np.linalg.inv(S)
    scale = y @ inverse @ y / len(y)
    assert process.variance == pytest.approx(scale)
    assert process.predict(X).ravel() == pytest.approx(across @ inverse @ y)
    assert process.posterior(X) == pytest.approx(
        scale * (joint[24:, 24:] - across @ inverse @ across.T), rel=1e-9, abs=1e-9 * scale
    )
    density = multivariate_normal(np.zeros(len(y)), scale * S).logpdf(y)
    constant = 0.5 * len(y) * (1.0 + np.log(2 * np.pi))
    assert -process.misfit - constant == pytest.approx(density)


def test_what_is_expected_is_symmetric():
    images = square()
    process = GradientProcess(observations(), images, LENGTHS, 0.05)
    X = RNG.uniform(-1, 1, (4, 3))
    expected = process.predict(X)
    spread = np.diag(process.posterior(X)).reshape(4, 4)[:, 0]
    for G, image in zip(images.turns, images.of(X), strict=True):
        there = process.predict(image)
        assert there[:, 0] == pytest.approx(expected[:, 0])
        assert there[:, 1:] @ G == pytest.approx(expected[:, 1:])
        assert np.diag(process.posterior(image)).reshape(4, 4)[:, 0] == pytest.approx(spread)
    assert tied_inputs(images).tolist() == [0, 0, 1]
    assert tied_inputs(no_symmetry(3)).tolist() == [0, 1, 2]


def test_the_search_makes_observations_likelier_and_finds_a_smooth_map():
    X = RNG.uniform(-1, 1, (20, 2))

    def value(P: np.ndarray) -> np.ndarray:
        return np.sin(2.0 * P[:, 0]) + 0.3 * P[:, 1]

    slopes = np.stack([2.0 * np.cos(2.0 * X[:, 0]), np.full(20, 0.3)], axis=1)
    seen = Observations(X, np.hstack([value(X)[:, None], slopes]), np.ones((20, 3)))
    begun = GradientProcess(seen, no_symmetry(2), np.ones(2), 0.01)
    found = fit_process(seen, no_symmetry(2))
    assert found.misfit < begun.misfit
    further = fit_process(seen, no_symmetry(2), found)
    assert further.misfit <= found.misfit
    places = RNG.uniform(-0.9, 0.9, (50, 2))
    assert found.predict(places)[:, 0] == pytest.approx(value(places), abs=0.01)


def test_observations_that_repeat_without_noise_are_no_failure():
    seen = observations(3)
    twice = Observations(*(np.concatenate([a, a]) for a in (seen.X, seen.targets, 1e9 * seen.weights)))
    assert np.isfinite(fit_process(twice, no_symmetry(3)).variance)
