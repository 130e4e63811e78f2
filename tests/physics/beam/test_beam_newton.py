"""The minimiser and the load path on functions whose minima are known."""

import numpy as np
import pytest

from palpate.physics.beam.beam_newton import LoadPath, follow, minimise
from palpate.physics.stop import Stop


class Dense:
    """K + shift·I by dense Cholesky."""

    def __init__(self, matrix):
        self.matrix = matrix

    def solve(self, rhs, shift):
        try:
            np.linalg.cholesky(self.matrix + shift * np.eye(len(rhs)))
        except np.linalg.LinAlgError:
            return None
        return np.linalg.solve(self.matrix + shift * np.eye(len(rhs)), rhs)


class Function:
    energy_floor = 1e-30

    def tangent(self, z):
        h = 1e-6
        columns = [(self.force(z + h * e) - self.force(z - h * e)) / (2 * h) for e in np.eye(len(z))]
        return Dense((np.array(columns) + np.array(columns).T) / 2)

    def relax(self, z, load):
        return z


class Rosenbrock(Function):
    """(1 - x)² + 100 (y - x²)², minimum at (1, 1) (Rosenbrock 1960); shifted up so that its energy has a scale."""

    def energy(self, z):
        x, y = z
        return 1 + (1 - x) ** 2 + 100 * (y - x**2) ** 2

    def force(self, z):
        x, y = z
        return np.array([-2 * (1 - x) - 400 * x * (y - x**2), 200 * (y - x**2)])


class DoubleWell(Function):
    """¼x⁴ - ½x² + ½y², minima at x = ±1 and a saddle between them."""

    def energy(self, z):
        x, y = z
        return 0.25 * x**4 - 0.5 * x**2 + 0.5 * y**2

    def force(self, z):
        x, y = z
        return np.array([x**3 - x, y])


class Wall(Function):
    """-log(1 - z): no minimum beyond the wall at 1, and not a number there."""

    def energy(self, z):
        with np.errstate(invalid="ignore", divide="ignore"):
            return float(-np.log(1 - z[0]) - z[0])

    def force(self, z):
        return np.array([1 / (1 - z[0]) - 1])


class Slope(Function):
    """No minimum at all under a load."""

    def energy(self, z):
        return float(np.sqrt(1 + z[0] ** 2))

    def force(self, z):
        return z / np.sqrt(1 + z**2)


def admit(_):
    return Stop.CONVERGED


def anywhere(*_):
    return True


@pytest.mark.parametrize("start", [(-1.2, 1.0), (3.0, -2.0), (0.0, 0.0)])
def test_rosenbrocks_valley(start):
    found = minimise(Rosenbrock(), np.zeros(2), np.array(start))
    assert found.stop is Stop.CONVERGED
    np.testing.assert_allclose(found.z, 1.0, atol=1e-9)


@pytest.mark.parametrize("x", [0.1, -0.3])
def test_an_indefinite_tangent_leads_downhill(x):
    found = minimise(DoubleWell(), np.zeros(2), np.array([x, 0.5]))
    assert found.stop is Stop.CONVERGED
    np.testing.assert_allclose(found.z, (np.sign(x), 0), atol=1e-9)


def test_a_saddle_is_called_unstable():
    assert minimise(DoubleWell(), np.zeros(2), np.zeros(2)).stop is Stop.UNSTABLE


def test_the_line_search_stays_inside_a_wall():
    found = minimise(Wall(), np.array([999.0]), np.zeros(1), limit=60)
    assert found.stop is Stop.CONVERGED
    assert found.z[0] == pytest.approx(0.999)


def test_no_minimum_ends_at_the_iteration_limit():
    found = minimise(Slope(), np.array([2.0]), np.zeros(1), limit=20)
    assert found.stop is not Stop.CONVERGED
    assert found.iterations <= 20


def test_a_path_without_end_is_given_up_in_bounded_time():
    path = LoadPath(np.zeros(1), np.array([2.0]), np.zeros(1))
    found = follow(Slope(), path, np.zeros(1), admit, anywhere)
    assert found.stop is not Stop.CONVERGED
    assert found.iterations <= 600


def test_a_path_that_leaves_the_models_reach_ends_there():
    path = LoadPath(np.zeros(1), np.array([0.9]), np.zeros(1))
    found = follow(
        Slope(), path, np.zeros(1), lambda z: Stop.STRAIN_LIMIT if z[0] > 1 else Stop.CONVERGED, anywhere
    )
    assert found.stop is Stop.STRAIN_LIMIT


class Wells(Function):
    """1 - cos z + z²/50: wells near the multiples of 2π, the outer ones higher."""

    def energy(self, z):
        return float(1 - np.cos(z[0]) + z[0] ** 2 / 50)

    def force(self, z):
        return np.array([np.sin(z[0]) + z[0] / 25])


def near(before, after):
    return abs(after[0] - before[0]) < 1


def test_a_step_that_leads_into_another_well_is_cut_back():
    """The predictor lies in the next well; the load's own path leaves the first one never."""
    path = LoadPath(np.zeros(1), np.array([0.9]), np.zeros(1))
    predictor = np.array([2 * np.pi + 0.8])
    far = follow(Wells(), path, predictor, admit, anywhere)
    found = follow(Wells(), path, predictor, admit, near)
    assert far.stop is found.stop is Stop.CONVERGED
    assert far.z[0] > 5
    assert 0 < found.z[0] < np.pi / 2
    np.testing.assert_allclose(Wells().force(found.z), 0.9, atol=1e-9)


def test_what_is_far_after_the_smallest_step_is_a_snap():
    """Beyond a load of about 1.06 the first well is gone: sin z + z/25 has no such value before the next one."""
    path = LoadPath(np.zeros(1), np.array([1.15]), np.zeros(1))
    found = follow(Wells(), path, np.zeros(1), admit, near)
    assert found.stop is Stop.CONVERGED
    assert found.z[0] > 5
    np.testing.assert_allclose(Wells().force(found.z), 1.15, atol=1e-9)


def test_convergence_is_quadratic_near_the_minimum():
    """The relative error is squared in each iteration, up to a factor."""
    errors = [minimise(Wall(), np.array([1.0]), np.array([0.4]), limit=n).residual for n in (2, 3, 4)]
    assert errors[1] < 10 * errors[0] ** 2
    assert errors[2] < 10 * errors[1] ** 2
