"""The simulated hand against its equation of motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.devices import device_named
from palpate.devices.simulated import SimulatedHand, SimulatedSettings
from palpate.devices.tick_record import TICK
from palpate.devices.trace_file import TraceWriter
from palpate.errors import UsageError

T = 1e-3


def hand(**settings):
    return SimulatedHand(SimulatedSettings(**({"amplitude": 0.0} | settings)))


def test_a_constant_push_is_held_by_the_grip():
    device, push = hand(grip=200.0, mass=0.2), np.array([1.0, -2.0, 0.5])
    for k in range(2000):
        device.read(k * T)
        device.write(push)
    np.testing.assert_allclose(device.place, push / 200.0, rtol=1e-4)
    assert device.work == pytest.approx(push @ device.place)


def test_a_free_swing_has_its_frequency_and_its_damping():
    device = hand(mass=0.2, damping=0.5, grip=200.0, grip_damping=0.0)
    device.read(0.0)
    device.place[0] = 0.01
    X = []
    for k in range(1, 1000):
        device.read(k * T)
        X.append(device.place[0])
    decay, frequency = 0.5 / (2 * 0.2), math.sqrt(200.0 / 0.2 - (0.5 / 0.4) ** 2)
    t = T * np.arange(1, 1000)
    swing = 0.01 * np.exp(-decay * t) * (np.cos(frequency * t) + decay / frequency * np.sin(frequency * t))
    np.testing.assert_allclose(X, swing, atol=3e-4)


def test_friction_holds_what_pushes_less():
    device = hand(grip=0.0, friction=0.5)
    for push, moved in ((0.4, False), (0.6, True)):
        for k in range(200):
            device.read(k * T)
            device.write(np.array([push, 0.0, 0.0]))
        assert bool(abs(device.place[0]) > 1e-6) is moved


def test_what_is_read_is_old_and_in_steps():
    device = hand(shape="sine", amplitude=0.02, frequency=2.0, delay=0.0042, step=1e-4)
    places, times = [], []
    for k in range(500):
        sample = device.read(10.0 + k * T)
        places.append(device.place.copy())
        times.append(10.0 + k * T)
        assert sample.time == pytest.approx(max(10.0, times[-1] - 0.0042))
        true = np.array([np.interp(sample.time, times, np.array(places)[:, i]) for i in range(3)])
        assert np.abs(sample.position - true).max() <= 0.5e-4 + 1e-12
        np.testing.assert_allclose(sample.position / 1e-4, np.round(sample.position / 1e-4), atol=1e-6)


def test_a_seed_is_a_motion():
    def walk(seed):
        device = hand(shape="random", amplitude=0.02, seed=seed)
        return np.array([device.read(k * T).position.copy() for k in range(300)])

    np.testing.assert_array_equal(walk(3), walk(3))
    assert np.abs(walk(3) - walk(4)).max() > 1e-3


def test_the_device_has_an_end(shared):
    device = device_named("simulated:grip=0", shared.command)
    for k in range(3000):
        device.read(k * T)
        device.write(np.array([0.0, 12.0, 0.0]))
    assert np.linalg.norm(device.place) <= device.traits.radius * (1 + 1e-12)
    assert device_named("simulated:damping=2", shared.command).traits.damping == 2.0


@pytest.mark.parametrize(
    "options", ["shape=square", "mass=0", "damping=-1", "delay=0.1", "y=0", "seed=-1", "grip=nan"]
)
def test_refuses_nonsense(shared, options):
    with pytest.raises(UsageError):
        device_named(f"simulated:{options}", shared.command)


def test_a_profile_sets_workspace_and_largest_force():
    device = hand(profile="falcon", shape="press", amplitude=1.0)
    assert (device.traits.radius, device.traits.max_force) == (0.04, 8.0)
    for k in range(1000):
        device.read(k * T)
    assert np.linalg.norm(device.place) == pytest.approx(0.04)
    with pytest.raises(UsageError, match=r"no profile of a device 'fulcrum'"):
        hand(profile="fulcrum")


def test_a_recorded_hand_is_followed_over_and_over(tmp_path):
    ticks = np.zeros(400, TICK)
    t = np.cumsum(np.random.default_rng(0).uniform(0.5, 1.5, 400)) * T
    ticks["time"], ticks["hand"][:, 1] = 7.0 + t, 0.01 * np.sin(2.0 * math.pi * t / (t[-1] - t[0]))
    writer = TraceWriter(tmp_path / "a.trace", {})
    writer.add_ticks(ticks)
    writer.close({})
    device = SimulatedHand(SimulatedSettings(file=str(tmp_path / "a.trace"), grip=1e5, grip_damping=300.0))
    span, places, wished = t[-1] - t[0], [], []
    for k in range(1000):
        device.read(k * T)
        places.append(device.place[1])
        wished.append(np.interp((k * T) % span, t - t[0], ticks["hand"][:, 1]))
    lag = 300.5 / 1e5 / T  # ticks, of damper and spring
    np.testing.assert_allclose(
        places[20:], np.interp(np.arange(20, 1000) - lag, np.arange(1000), wished), atol=2e-4
    )
