"""Motions hold what their names promise."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning.relaxation import ramp, random_drive, sinusoid, step_hold

TOUCH = (0.01, 0.02, 0.03)


def depth(drive):
    return TOUCH[2] - drive.positions[:, 2]


def test_a_step_is_sudden_and_held():
    drive = step_hold(TOUCH, 0.004, [0.1, 1.0])
    assert drive.times[0] <= 1e-6
    np.testing.assert_allclose(depth(drive), 0.004)


def test_a_ramp_rises_holds_and_falls_evenly():
    drive = ramp(TOUCH, 0.004, 1.0, 0.25, hold=0.5, fall=0.5)
    np.testing.assert_allclose(drive.times, 0.25 * np.arange(1, 9))
    np.testing.assert_allclose(depth(drive), 0.001 * np.array([1, 2, 3, 4, 4, 4, 2, 0]), atol=1e-15)


def test_a_sinusoid_swings_about_its_mean():
    drive = sinusoid(TOUCH, 0.003, 0.002, 2.0, 0.5 / 16, cycles=2)
    found = depth(drive)
    assert found.max() == pytest.approx(0.005)
    assert found.min() == pytest.approx(0.001)
    assert found[-1] == pytest.approx(0.003)


def test_a_random_drive_presses_slides_and_lifts_off():
    drive = random_drive(TOUCH, 0.005, 0.008, seconds=20, dt=0.001, seed=4, lifted=0.2)
    assert len(drive) == 20_000
    assert depth(drive).max() == pytest.approx(0.005, rel=1e-3)
    assert (depth(drive) < 0).mean() == pytest.approx(0.2, abs=2e-3)
    sideways = np.abs(drive.positions[:, :2] - TOUCH[:2]).max(axis=0)
    np.testing.assert_allclose(sideways, 0.008, rtol=1e-3)


def test_a_random_drive_depends_on_its_seed_and_not_on_its_step():
    coarse, fine = (random_drive(TOUCH, 0.005, 0.008, seconds=5, dt=dt, seed=1) for dt in (0.1, 0.05))
    np.testing.assert_allclose(coarse.positions, fine.positions[1::2], atol=1e-15)
    assert not np.allclose(coarse.positions, random_drive(TOUCH, 0.005, 0.008, seconds=5, dt=0.1).positions)


def test_motions_press_along_any_direction():
    inward = np.array([1.0, 2.0, -2.0]) / 3
    drive = random_drive(TOUCH, 0.005, 0.008, seconds=5, dt=0.05, inward=3 * inward)
    across = drive.positions - TOUCH - np.outer((drive.positions - TOUCH) @ inward, inward)
    assert np.linalg.matrix_rank(across, tol=1e-6) == 2
    assert ((drive.positions - TOUCH) @ inward).max() == pytest.approx(0.005, rel=1e-2)


@pytest.mark.parametrize(
    "mistake",
    [
        lambda: step_hold(TOUCH, 0.001, [0.2, 0.1]),
        lambda: step_hold(TOUCH[:2], 0.001, [0.1]),
        lambda: ramp(TOUCH, 0.001, 1.0, 0.0),
        lambda: sinusoid(TOUCH, 0.001, 0.001, 0.0, 0.1),
        lambda: random_drive(TOUCH, 0.001, 0.0, lifted=1.0),
        lambda: random_drive(TOUCH, 0.001, 0.0, inward=(0, 0, 0)),
    ],
)
def test_mistaken_motions_are_refused(mistake):
    with pytest.raises(UsageError):
        mistake()
