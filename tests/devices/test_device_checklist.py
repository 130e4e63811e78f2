"""What every device must do; a new one is tested by being entered in the table of devices."""

from __future__ import annotations

import contextlib
import math
import sys
import tracemalloc

import evdev_double
import numpy as np
import pytest
from evdev_double import Pad
from library_double import LibraryDouble
from spnav_double import Daemon

from palpate.devices import Sample, device_named, device_names, device_traits
from palpate.devices.doubles.crtk_simulator import CrtkSimulator, CrtkSimulatorSettings
from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.devices.doubles.library_doubles import DOUBLES
from palpate.devices.tick_record import FLAGS, TICK
from palpate.devices.trace_file import TraceWriter
from palpate.errors import UsageError
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits
from palpate.runtime.workspace import Workspace
from standins import STIFFNESS, PlainModel

# settings of the doubles; a thread that calls back must not do so while tracemalloc stops, which Python doesn't bear
STARTS = {"forcedimension": {"manual": 1}, "openhaptics": {"speed": 20, "manual_after": 50}}


@pytest.fixture(params=device_names())
def name(request):
    return request.param


@pytest.fixture
def recorded_stroke(tmp_path):
    """A file of a stroke of 40 ms."""
    ticks = np.zeros(41, TICK)
    ticks["tick"], ticks["time"] = np.arange(41), 1e-3 * np.arange(41)
    ticks["hand"][:, 1] = -0.03 * np.sin(np.linspace(0.0, np.pi, 41))
    ticks["flags"] = 1 << FLAGS.index("holding")
    writer = TraceWriter(
        tmp_path / "a.trace", {"workspace": {"radius": 0.075}, "limits": {"max_force": 12.0}}
    )
    writer.add_ticks(ticks)
    writer.close({})
    return writer.path


@contextlib.contextmanager
def served(name, request):
    """The device's address, that of its double if it is hardware, and what to call once it is open."""
    if name == "haply":
        with HaplySimulator(SimulatorSettings(port=0, events=0)) as service:
            yield f"haply:ws://127.0.0.1:{service.port},events={service.events_port},wait=1", no_more
    elif name == "crtk":
        with CrtkSimulator(CrtkSimulatorSettings(port=0)) as service:
            yield f"crtk:ws://127.0.0.1:{service.port},arm=arm,delay=0.002,search=10", service.hang
    elif name == "gamepad":
        request.getfixturevalue("monkeypatch").setitem(sys.modules, "evdev", evdev_double.module(Pad()))
        yield name, no_more
    elif name == "spacemouse":
        with Daemon() as daemon:
            yield f"spacemouse:socket={daemon.path}", no_more
    elif name == "trace":
        yield f"trace:file={request.getfixturevalue('recorded_stroke')},repeat=1", no_more
    elif name in DOUBLES:
        library = request.getfixturevalue("double")(name)
        LibraryDouble(library, **STARTS[name])
        yield f"{name}:library={library}", no_more
    else:
        yield name, no_more


def no_more():
    """Nothing that goes on by itself has to be stopped."""


@pytest.fixture
def device(name, shared, request):
    shared.write_command(beat=0.0, grabbed=True, target=(0.0, -0.01, 0.0), period=0.1)
    with served(name, request) as (address, opened):
        device = device_named(address, shared.command)
        opened()
        yield device
        device.close()


def test_traits_are_physical(name):
    traits = device_traits(name)
    assert 0.0 < traits.radius < 1.0
    assert 0.0 < traits.max_force < 100.0
    assert traits.damping is None or traits.damping >= 0.0
    assert traits.source
    assert (traits.damping is None) <= (traits.resolution == 0.0), (
        "the steps of a sensor are stated where motors push"
    )
    assert device_traits(f"{name}:some=option") == traits


def test_reads_one_sample_object_inside_the_workspace(device):
    first = device.read(0.0)
    assert isinstance(first, Sample)
    position, seen = first.position, first.time
    for k in range(200):
        sample = device.read(1e-3 * k)
        assert sample is first
        assert sample.position is position
        assert position.shape == (3,)
        assert np.isfinite(position).all()
        assert np.linalg.norm(position) <= device.traits.radius
        assert seen <= sample.time <= 1e-3 * k + 1e-9, "a sign of life is never of the future"
        assert 0.0 < sample.patience <= 1.0
        seen = sample.time


def test_takes_any_force_and_closes_twice(device):
    device.read(0.0)
    for force in (np.zeros(3), np.array([1.0, -2.0, 3.0])):
        kept = force.copy()
        device.write(force)
        np.testing.assert_array_equal(force, kept)
    device.close()
    device.close()


def test_keeps_no_memory_per_tick(device):
    def kept_after(ticks):
        least = math.inf  # of the last 150: a double's thread may be at work at any of them
        for k in ticks:
            device.write(force)
            device.read(1e-3 * k)
            if k >= ticks.stop - 150:
                least = min(least, tracemalloc.get_traced_memory()[0])
        return least

    force = np.ones(3)
    device.read(0.0)
    tracemalloc.start()
    before = kept_after(range(200))
    after = kept_after(range(200, 1200))
    tracemalloc.stop()
    assert after - before < 1000, "bytes left after a thousand ticks"


class Sensor:
    """A device whose places have noise, steps, and now and then come a tick late, whatever its own are."""

    def __init__(self, device, noise=5e-5, step=5.5e-5):
        self.device, self.noise, self.step = device, noise, step
        self._random, self._sample, self._before = np.random.default_rng(2), None, np.zeros(3)

    def __getattr__(self, name):
        return getattr(self.device, name)

    def read(self, now):
        sample = self.device.read(now)
        self._sample = self._sample or Sample(sample.patience)
        for field in set(Sample.__slots__) - {"position"}:
            setattr(self._sample, field, getattr(sample, field))
        late = self._random.random() < 0.2
        true, self._before = self._before if late else sample.position, sample.position.copy()
        noisy = true + self.noise * self._random.normal(size=3)
        self._sample.position[:] = self.step * np.round(noisy / self.step)
        return self._sample


def test_a_noisy_sensor_of_any_device_does_not_shake_the_force(name, device, shared):
    """From tick to tick the force changes by what a spring answers to way and noise, and not by more than 12 K σ."""
    traits, places, forces = device.traits, [], []
    sensor, model = Sensor(device), PlainModel()
    loop = Loop(
        model, sensor, shared, Workspace(traits.radius, 1.0), Limits(traits.max_force), stiffness=STIFFNESS
    )
    loop.evaluator.rest_zone = (
        math.inf
    )  # a double's hand may stand anywhere, and never come to where the spring is slack
    for k in range(600):
        loop.tick(1e-3 * k)
        places.append(sensor._before.copy())
        if loop.open:
            forces.append(loop.out.force.copy())
    way = np.linalg.norm(np.diff(places, axis=0), axis=1).max()
    if name == "forcedimension":  # its double is moved by hand here, and stands still: the input is stalled
        assert not forces
        return
    assert len(forces) > 1, "the loop has sent a force"
    change = np.linalg.norm(np.diff(forces, axis=0), axis=1).max()
    ramp = STIFFNESS * traits.radius * 1e-3 / 0.05
    assert change <= 12.0 * STIFFNESS * 5.5e-5 + 2.0 * STIFFNESS * way + ramp


def test_unknown_options_are_listed(name, shared):
    with pytest.raises(UsageError, match="no option 'colour'"):
        device_named(f"{name}:colour=red", shared.command)


def test_unknown_devices_are_listed(shared):
    with pytest.raises(UsageError) as caught:
        device_named("omega", shared.command)
    assert all(name in str(caught.value) for name in device_names())
