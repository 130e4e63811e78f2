"""The spring in front of a stiff body: an envelope of its energy, no stiffer than it may be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.runtime.coupling import Coupling, coupling_stiffness


def settle(coupling, hand, body, tangent, steps=30):
    """Follow until nothing moves; the force of the spring."""
    for _ in range(steps):
        coupling.follow(hand, body(coupling.proxy), tangent(coupling.proxy))
    return coupling.pull(hand).copy()


def test_body_and_spring_in_series_are_as_stiff_as_the_bound():
    for body, bound in ((2000.0, 1000.0), (1e6, 400.0), (401.0, 400.0)):
        k = coupling_stiffness(body, bound)
        assert k * body / (k + body) == pytest.approx(bound)
    assert coupling_stiffness(100.0, 100.0) == math.inf
    assert coupling_stiffness(math.inf, 100.0) == 100.0
    with pytest.raises(UsageError):
        coupling_stiffness(100.0, 0.0)


def test_a_linear_body_is_balanced_in_one_step():
    H = np.array([[900.0, 100, 0], [100, 700, -50], [0, -50, 300]])
    k, hand = 500.0, np.array([1e-3, -2e-3, 3e-3])
    coupling = Coupling(k)
    coupling.follow(np.zeros(3), np.zeros(3), -H)
    coupling.follow(hand, np.zeros(3), -H)
    assert coupling.balanced(hand, -H @ coupling.proxy)
    np.testing.assert_allclose(coupling.pull(hand), -np.linalg.inv(np.eye(3) / k + np.linalg.inv(H)) @ hand)


def wall(A):
    """A contact that stiffens with depth below z = 0: U = A s³."""

    def force(p):
        s = max(0.0, -p[2])
        return np.array([0.0, 0.0, 3 * A * s**2])

    def tangent(p):
        K = np.zeros((3, 3))
        K[2, 2] = -6 * A * max(0.0, -p[2])
        return K

    return force, tangent


def test_what_is_felt_of_a_stiffening_contact_is_the_slope_of_the_envelope():
    A, k = 1e6, 800.0
    force, tangent = wall(A)
    coupling, felt = Coupling(k, hardest=1e5), []
    depths = np.linspace(-1e-3, 8e-3, 200)
    for depth in depths:
        hand = np.array([0.0, 0.0, -depth])
        felt.append(settle(coupling, hand, force, tangent)[2])
        s = max(0.0, depth - felt[-1] / k)  # of the body, in series with the spring
        assert felt[-1] == pytest.approx(3 * A * s**2, rel=1e-6, abs=1e-9)
    slope = np.diff(felt) / np.diff(depths)
    assert slope.min() >= 0.0
    assert slope.max() < k


def test_a_body_whose_stiffness_is_not_known_or_not_convex_is_followed_all_the_same():
    hand, k = np.array([0.0, 0.0, 4e-3]), 500.0

    def body(p):
        return -2000.0 * p

    for tangent in (np.zeros((3, 3)), 1e5 * np.eye(3)):
        coupling = Coupling(k, hardest=2000.0)
        force = settle(coupling, hand, body, lambda p, T=tangent: T, steps=60)
        np.testing.assert_allclose(force, -400.0 * hand, rtol=1e-6)


def test_nothing_gets_stiffer_under_load():
    coupling = Coupling(500.0)
    coupling.follow(np.zeros(3), np.zeros(3), np.zeros((3, 3)))
    coupling.pull(np.array([1e-3, 0, 0]))
    coupling.change(800.0)
    assert coupling.stiffness == 500.0
    coupling.change(300.0)
    assert coupling.stiffness == 300.0
    coupling.reset()
    coupling.change(math.inf)
    assert not coupling.active
