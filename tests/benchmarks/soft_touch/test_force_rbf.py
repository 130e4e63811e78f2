"""The rival on forces is exact where the force follows its law over its coordinates."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks.soft_touch.bodies import touched
from benchmarks.soft_touch.methods import force_rbf

RADIUS, STIFF = 0.01, 800.0  # m, N/m^1.5
LOW, HIGH = (-0.02, -0.015, 0.001), (0.02, 0.015, 0.004)  # m: x and y on the dome, depth


def presses(unit):
    """Return places (n, 3) of a ball over the dome, an ellipsoid, and Hertz's forces along its normal."""
    x, y, depth = (np.array(LOW) + unit * (np.array(HIGH) - np.array(LOW))).T
    surface = np.column_stack([x, y, 0.04 * np.sqrt(1.0 - (x**2 + y**2) / 0.05**2)])
    normal = surface / np.array([0.05, 0.05, 0.04]) ** 2
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return surface + (RADIUS - depth)[:, None] * normal, STIFF * depth[:, None] ** 1.5 * normal


@pytest.fixture(scope="module")
def surface():
    return force_rbf._Surface(SimpleNamespace(name="dome", radius=RADIUS))


def test_a_force_of_hertz_along_the_normal_is_learnt_from_few_presses(surface):
    rng = np.random.default_rng(3)
    (solved, forces), (fresh, exact) = presses(rng.random((16, 3))), presses(rng.random((40, 3)))
    size = np.linalg.norm(exact, axis=1)
    over = {}
    for name in force_rbf.OVER:
        method = force_rbf._Interpolated(solved, forces, name, None if name == "place" else surface)
        over[name] = float((np.linalg.norm(method.force(fresh) - exact, axis=1) / size).max())
    # facets of 1.25 mm lie 4 μm inside the dome, 0.6 % of the force at 1 mm; their normals turn by 0.3 degrees
    assert over["law"] < 0.01
    assert over["law"] < over["surface"] < over["place"]


def test_a_ball_outside_feels_nothing(surface):
    solved, forces = presses(np.random.default_rng(3).random((16, 3)))
    method = force_rbf._Interpolated(solved, forces, "law", surface)
    assert not method.force(np.array([[0.0, 0.0, 0.0501], [0.0, 0.0, 0.07]])).any()


def test_coordinates_are_those_of_the_whole_surface(surface):
    places, _ = presses(np.random.default_rng(5).random((10, 3)))
    for place, coordinates, axes in zip(places, *surface(places), strict=True):
        near, normal, distance = touched("dome").nearest(place)
        np.testing.assert_allclose(coordinates, [*near[:2], RADIUS - distance], atol=1e-12)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(axes[0], normal, atol=1e-12)
