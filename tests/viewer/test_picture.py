"""What is drawn: the field network's shape while held, a decaying swing after release."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import one_sided

from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.viewer.page_model import DAMPING, FREQUENCY, STILL, LineDrawing, swing


def drawn(rod: Surrogate) -> LineDrawing:
    body = touchable(rod)
    assert body.line is not None
    return LineDrawing(body, body.line)


def shape_of(rod: Surrogate, load: float) -> np.ndarray:
    return rod.fields["displacement"].values(np.array([[load]]))[0]


def test_the_swing_solves_the_damped_oscillator():
    w, h = 2 * np.pi * FREQUENCY, 1e-4
    for t in (0.05, 0.2, 0.6):
        before, here, after = swing(t - h), swing(t), swing(t + h)
        residual = (after - 2 * here + before) / h**2 + DAMPING * w * (after - before) / h + w**2 * here
        assert abs(residual) < 1e-3 * w**2  # differences of second order: w⁴h²/12 ≈ 2e-5


def test_the_swing_starts_at_the_held_shape_without_a_jump():
    assert swing(0.0) == 1.0
    assert swing(1e-6) == pytest.approx(1.0, abs=1e-9)


def test_the_swing_ends_and_its_end_is_no_visible_jump():
    end = -np.log(STILL) / (DAMPING * 2 * np.pi * FREQUENCY)
    assert swing(end + 1e-9) == 0.0
    assert abs(swing(end - 1e-9)) < 1.1 * STILL
    assert end < 3.0


def test_held_is_the_network_and_released_swings_back(rod: Surrogate):
    drawing, load = drawn(rod), np.array([3.0])
    held = drawing.held(load, 10.0)
    assert np.array_equal(held, shape_of(rod, 3.0))
    after = drawing.free(np.zeros(0), 10.0)
    assert np.allclose(after, held, rtol=0, atol=1e-12)
    half = drawing.free(np.zeros(0), 10.0 + 0.5 / FREQUENCY)
    assert half[-1, 1] > 0.05  # mirrored: it swings past its rest
    rest = drawing.free(np.zeros(0), 20.0)
    assert np.array_equal(rest, shape_of(rod, 0.0))


def test_a_body_that_does_not_mirror_stops_at_its_range(rod: Surrogate):
    drawing = drawn(one_sided(rod))
    drawing.held(np.array([3.0]), 0.0)
    half = drawing.free(np.zeros(0), 0.5 / FREQUENCY)
    assert np.array_equal(half, shape_of(rod, 0.0))


def test_before_any_touch_the_body_rests(rod: Surrogate):
    shape = drawn(rod).free(np.zeros(0), 5.0)
    assert np.array_equal(shape, shape_of(rod, 0.0))
