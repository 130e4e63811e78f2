"""The page's interpolation and signs of life; the scripted stroke."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices import device_named
from palpate.devices.page import FrameInterpolator, PageDevice, page_patience
from palpate.errors import DeviceError, UsageError

TICK = 1e-3
targets = st.lists(
    st.tuples(st.floats(-0.07, 0.07), st.floats(-0.07, 0.07), st.integers(3, 60)), min_size=1, max_size=12
)


@pytest.mark.full
@settings(deadline=None)
@given(targets)
def test_interpolation_never_overshoots(frames):
    """Every point lies between the hull of the last point and its target, frame by frame, jitter or not."""
    path, now = FrameInterpolator(np.zeros(3)), 0.0
    for x, y, ticks in frames:
        start, target = path.position.copy(), np.array([x, y, 0.0])
        path.aim(target, now)
        share = 0.0
        for _ in range(ticks):
            path.move(now)
            now += TICK
            low, high = np.minimum(start, target) - 1e-12, np.maximum(start, target) + 1e-12
            assert (low <= path.position).all()
            assert (path.position <= high).all()
            done = np.linalg.norm(path.position - start)
            assert done >= share - 1e-12, "never backwards"
            share = done


def test_a_steady_drag_is_followed_one_frame_behind():
    """v = 0.1 m/s at 60 Hz: the position trails the hand by at most two frames, and moves every tick."""
    path, speed, frame = FrameInterpolator(np.zeros(3)), 0.1, 1 / 60
    sent, positions, hands = -1, [], []
    for k in range(1000):
        now = k * TICK
        if int(now / frame) > sent:
            sent = int(now / frame)
            path.aim(np.array([speed * now, 0.0, 0.0]), now)
        path.move(now)
        positions.append(path.position[0])
        hands.append(speed * now)
    lag = (np.array(hands) - positions)[100:] / speed
    assert frame * 0.5 < lag.mean() < frame * 1.5
    assert lag.max() <= 2 * frame + 2 * TICK
    steps = np.diff(positions)[100:]
    assert steps.max() < 2 * speed * TICK, "no staircase"


@pytest.fixture
def page(shared):
    return PageDevice(shared.command)


def test_a_hand_takes_hold_where_it_is(page, shared):
    """And not on the way there: what leads from the centre to it would go through the body, or bend it."""
    shared.write_command(grabbed=True, target=(0.01, -0.02, 0.0))
    np.testing.assert_array_equal(page.read(0.0).position, [0.01, -0.02, 0.0])
    shared.write_command(grabbed=False)
    for k in range(1, 500):
        page.read(k * TICK)
    shared.write_command(grabbed=True, target=(-0.03, 0.0, 0.0))
    np.testing.assert_array_equal(page.read(0.5).position, [-0.03, 0.0, 0.0])
    shared.write_command(grabbed=True, target=(-0.04, 0.0, 0.0))
    assert page.read(0.5 + TICK).position[0] > -0.035


def test_frames_arrive_in_full(page, shared):
    shared.write_command(grabbed=True, target=(0.01, -0.02, 0.0))
    for k in range(60):
        sample = page.read(k * TICK)
    np.testing.assert_allclose(sample.position, [0.01, -0.02, 0.0])


def test_release_springs_back_and_a_grab_without_a_target_starts_there(page, shared):
    shared.write_command(grabbed=True, target=(0.0, -0.05, 0.0))
    for k in range(100):
        page.read(k * TICK)
    shared.write_command(grabbed=False)
    path = [page.read(k * TICK).position[1] for k in range(100, 600)]
    assert np.all(np.diff(path) >= 0.0)
    assert abs(path[-1]) < 1e-5
    shared.write_command(
        grabbed=True
    )  # before the first new target: the old one must be approached, not jumped to
    assert abs(page.read(0.6).position[1]) < 1e-5


def test_a_bad_frame_does_not_poison_the_next(page, shared):
    shared.write_command(grabbed=True, target=(math.nan, 0.0, 0.0))
    assert math.isnan(page.read(0.0).position[0])
    shared.write_command(target=(0.01, 0.0, 0.0))
    for k in range(1, 40):
        sample = page.read(k * TICK)
    np.testing.assert_allclose(sample.position, [0.01, 0.0, 0.0])


def test_sign_of_life_is_the_heartbeat(page, shared):
    shared.write_command(beat=3.0, period=0.2, grabbed=True)
    sample = page.read(3.0)
    assert sample.time == 3.0
    assert sample.patience == pytest.approx(0.6)
    assert sample.holding
    assert not sample.asleep
    shared.write_command(hidden=True)
    assert page.read(3.1).asleep
    assert page_patience(0.01) == page_patience(0.0) == page_patience(math.nan) == 0.1


@pytest.mark.parametrize("shape", ["sine", "ramp"])
def test_stroke_is_the_wave_it_says(shared, shape):
    device = device_named(f"stroke:amplitude=0.02,frequency=2,x=3,y=4,shape={shape}", shared.command)
    began, along = 50.0, np.array([0.6, 0.8, 0.0])
    for quarter, value in enumerate([0.0, 1.0, 0.0, -1.0, 0.0]):
        position = device.read(began + quarter / 8.0).position
        np.testing.assert_allclose(position, 0.02 * value * along, atol=1e-15)
    middle = device.read(began + 1 / 16).position @ along
    assert middle == pytest.approx(0.02 * (math.sin(math.pi / 4) if shape == "sine" else 0.5))


def test_stroke_misbehaves_on_time(shared):
    device = device_named("stroke:stall_at=1,lasting=0.5", shared.command)
    device.read(0.0)
    assert device.read(0.9).time == 0.9
    assert device.read(1.1).time == 0.9
    assert device.read(1.6).time == 1.6
    device = device_named("stroke:nan_at=1", shared.command)
    device.read(0.0)
    assert not np.isfinite(device.read(1.0).position).all()
    device = device_named("stroke:fail_at=1,lasting=0.5", shared.command)
    device.read(0.0)
    with pytest.raises(DeviceError):
        device.read(1.2)
    device.read(1.6)


@pytest.mark.parametrize("options", ["shape=square", "amplitude=inf", "y=0", "frequency=fast", "amplitude="])
def test_stroke_refuses_nonsense(shared, options):
    with pytest.raises(UsageError):
        device_named(f"stroke:{options}", shared.command)
