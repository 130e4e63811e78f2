"""Depth over the surface, presses and order of a search, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from examined import plane, touch_along

from palpate.experiments.exam_touch import LEVELS, order_of_search, pressed_depths


def strips(columns: int = 6, rows: int = 10) -> np.ndarray:
    x, y = np.linspace(-0.04, 0.04, columns), np.linspace(-0.04, 0.04, rows)
    return np.array([(a, b) for k, a in enumerate(x) for b in (y if k % 2 == 0 else y[::-1])])


def circles() -> np.ndarray:
    return np.concatenate(
        [[(r * math.cos(t), r * math.sin(t)) for t in np.linspace(0, 2 * math.pi, 40)] for r in (0.02, 0.04)]
    )


def spokes() -> np.ndarray:
    out, angles = np.linspace(-0.04, 0.04, 9), np.arange(6) * math.pi / 6
    return np.concatenate(
        [np.outer(out if k % 2 else out[::-1], (math.cos(t), math.sin(t))) for k, t in enumerate(angles)]
    )


def test_one_press_reaches_as_deep_as_a_ball_does():
    surface, depth = plane(), 0.0055
    depths = pressed_depths(surface, touch_along(np.zeros((1, 2)), depth))
    away = np.linalg.norm(surface.points, axis=1)
    assert depths == pytest.approx(np.maximum(depth - away**2 / (2 * surface.radius), 0.0), abs=1e-12)
    # a circle on the map: a² = 2 R (s − level)
    for name, share in surface.shares(depths).items():
        circle = math.pi * 2 * surface.radius * max(depth - LEVELS[name] * surface.deepest, 0.0)
        assert share == pytest.approx(circle / 0.1**2, rel=0.05)  # on cells of 1 mm


def test_what_nobody_can_reach_is_nobodys_fault():
    surface = plane()
    half = surface.points[:, 0] < 0.0
    reachable = type(surface)(surface.points, surface.triangles, half, surface.radius, surface.deepest)
    depths = np.where(half, 0.006, 0.0)
    assert list(reachable.shares(depths).values()) == pytest.approx([1.0] * len(LEVELS))
    assert len(reachable.inner(0.0205)) == (surface.points[:, 0] < -0.0205).sum()


def test_presses_are_counted_with_their_depth_and_force():
    places = strips()
    touch = touch_along(places, 0.003)
    assert len(touch.presses) == len(places)
    assert np.array_equal([press.place[:2] for press in touch.presses], places)
    assert {press.depth for press in touch.presses} == {0.003}
    assert {press.force for press in touch.presses} == {2.0}
    assert touch.seconds_in_contact == pytest.approx(0.1 * len(places), rel=0.02)


def test_strips_circles_and_spokes_are_told_apart():
    surface = plane()
    found = {name: order_of_search(surface, touch_along(way())) for name, way in
             (("strips", strips), ("circles", circles), ("spokes", spokes))}  # fmt: skip
    # between strips go 5 short steps across: |Σ l e^{2iφ}|/Σ l = (54 · 8.9 − 5 · 16) / (54 · 8.9 + 5 · 16)
    along, across = 54 * 0.08 / 9, 5 * 0.016
    assert found["strips"].parallel == pytest.approx((along - across) / (along + across))
    assert found["circles"].around > 0.9
    for name, order in found.items():
        assert order.words.startswith(name)


def test_a_second_round_is_a_return():
    places = strips(4, 5)
    once, twice = (order_of_search(plane(), touch_along(np.tile(places, (k, 1)), pause=0.2)) for k in (1, 2))
    assert once.again == 0.0
    assert twice.again == pytest.approx(0.5)


def test_no_press_has_no_order():
    touch = touch_along(np.zeros((1, 2)), 0.0)
    assert touch.presses == ()
    assert order_of_search(plane(), touch).words == "too few places for an order"
    assert not pressed_depths(plane(), touch).any()
