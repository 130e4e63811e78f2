"""Offset, drift and faults of a load cell, found in a record of a specimen."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from correction_made import RADIUS, model

from palpate.dataset.measured import Measurements
from palpate.learning.correction import Phantom, correct
from palpate.surrogates import Surrogate

HEIGHT = 3e-4
NOISE = 0.005


@functools.cache
def body() -> Surrogate:
    return Surrogate(model(), {}, None, {})


def strokes(count=8, above=0.004, seed=3):
    """Down from above the surface to a millimetre below it, and up again, at places drawn at random."""
    down = np.linspace(RADIUS + above, RADIUS - 0.004, 14)
    both = np.concatenate([down, down[::-1]])
    xy = np.random.default_rng(seed).uniform(-0.015, 0.015, (count, 2))
    return np.concatenate([np.column_stack([np.tile(p, (len(both), 1)), both]) for p in xy])


@functools.cache
def forces(above=0.004):
    X = strokes(above=above)
    specimen = Phantom(body().energy, factor=1.4, layer=0.0, height=HEIGHT)
    return X, specimen.force(X) + np.random.default_rng(4).normal(0.0, NOISE, X.shape)


def record(X, F, along=None):
    along = np.zeros((len(X), 3)) if along is None else along
    return Measurements(X, F, along, np.full(len(X), np.nan), 0.01 * np.arange(len(X)))


@pytest.mark.full
def test_an_offset_is_found_in_air_and_is_no_height():
    X, F = forces()
    heights = []
    for offset in (0.0, 0.03):
        done = correct(body(), record(X, F + np.array([0.0, 0.0, offset])))
        assert done.cell.offset[2] == pytest.approx(offset, abs=4 * done.cell.deviation[2])
        assert done.cell.readings >= 5
        assert done.warning == ""
        height, sure = done.offset
        assert abs(height - HEIGHT) < 4.0 * sure + 3e-5
        heights.append(height)
    assert heights[0] == pytest.approx(heights[1], abs=2e-6)
    assert "in air" in str(done)
    assert done.as_dict()["load_cell"]["offset"][2] == pytest.approx(0.03, abs=0.005)


@pytest.mark.full
def test_a_drift_is_found_in_air():
    X, F = forces()
    rate = 0.02  # N/s
    drifting = F + np.outer(0.01 * np.arange(len(X)), [0.0, rate, 0.0])
    done = correct(body(), record(X, drifting))
    np.testing.assert_allclose(done.cell.drift, [0.0, rate, 0.0], atol=0.004)
    assert done.offset[0] == pytest.approx(HEIGHT, abs=1e-4)


@pytest.mark.full
def test_one_component_alone_has_an_offset_too():
    X, F = forces()
    along = np.tile([0.0, 0.0, 1.0], (len(X), 1))
    done = correct(body(), record(X, (F + np.array([0.0, 0.0, 0.03])) * along, along))
    assert done.cell.offset[2] == pytest.approx(0.03, abs=0.004)
    assert done.offset[0] == pytest.approx(HEIGHT, abs=1.5e-4)


@pytest.mark.full
def test_without_readings_in_air_height_and_offset_are_called_alike():
    X, F = forces(above=0.0005)
    one = np.argmin(np.abs(X[:, 2, None] - (RADIUS - 0.002)), axis=0)
    few = np.flatnonzero(np.abs(X[:, 2] - X[one[0], 2]) < 1e-9)  # all at one depth
    along = np.tile([0.0, 0.0, 1.0], (len(few), 1))
    done = correct(body(), record(X[few], F[few] * along, along))
    assert done.cell.readings == 0
    assert "not told apart" in done.warning
    assert "in air" in done.warning


@pytest.mark.full
@pytest.mark.parametrize("fault", ["stuck", "saturated", "sign", "lags"])
def test_faulty_sensors_are_named(fault):
    X, F = forces()
    F = F.copy()
    largest = np.abs(F[:, 2]).max()
    if fault == "stuck":
        F[100:, 2] = F[100, 2]
    elif fault == "saturated":
        F[:, 2] = np.clip(F[:, 2], -0.5 * largest, 0.5 * largest)
    elif fault == "sign":
        F[:, 2] = -F[:, 2]
    else:
        F[4:] = F[:-4].copy()
    text = correct(body(), record(X, F)).warning
    assert {"stuck": "stuck", "saturated": "saturated", "sign": "sign", "lags": "lags by 4"}[fault] in text


@pytest.mark.full
def test_a_sound_sensor_is_not_accused():
    X, F = forces()
    assert correct(body(), record(X, F)).cell.faults == ()
