"""The gamepad of Linux on a double of evdev, with injected events; no pad has been touched."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from pathlib import Path

import evdev_double
import numpy as np
import pytest
from evdev_double import (
    ABS,
    BRAKE,
    EAST,
    GAS,
    KEY,
    LEFT_STICK,
    RX,
    RY,
    RZ,
    SOUTH,
    STICK,
    TRIGGER,
    AbsInfo,
    Pad,
    X,
    Y,
    Z,
)

from palpate.devices.gamepad import GamepadDevice, GamepadSettings
from palpate.devices.steering import DeadZone
from palpate.errors import DeviceError, DeviceLostError
from system_programs import require_package, require_program

PADS = json.loads((Path(__file__).parents[1] / "data/devices/gamepads.json").read_text(encoding="utf-8"))[
    "pads"
]
TICK = 1e-3
REST = {
    "rtol": 0.0,
    "atol": 0.0005,
}  # m: a stick that rests beside its zero is felt a little beyond the dead zone
RADIUS = GamepadDevice.traits.radius
FULL = GamepadDevice.traits.max_force
WEAK, STRONG = 1, 0  # places in what was played


@pytest.fixture
def pad(monkeypatch):
    plugged = Pad()
    monkeypatch.setitem(sys.modules, "evdev", evdev_double.module(plugged))
    return plugged


def hand(device, ticks=300, start=0.0, force=None):
    """The hand after so many ticks."""
    for k in range(ticks):
        sample = device.read(start + k * TICK)
        if force is not None:
            device.write(np.array([0.0, force(start + k * TICK), 0.0]))
    return sample.position.copy()


@pytest.mark.parametrize(("lowest", "highest", "flat"), [(-32768, 32767, 128), (0, 255, 15), (0, 1023, 0)])
@pytest.mark.parametrize("one_sided", [False, True])
def test_a_dead_zone_is_continuous_and_leaves_the_whole_range(lowest, highest, flat, one_sided):
    zone = DeadZone(lowest, highest, flat, 0.15, one_sided=one_sided)
    values = np.array([zone(raw) for raw in np.linspace(lowest, highest, 2001)])
    assert values[0] == (0.0 if one_sided else -1.0)
    assert values[-1] == 1.0
    steps = np.diff(values)
    assert (steps >= 0.0).all()
    assert steps.max() < 2.5 / 2000 / (1.0 - zone.dead), "no jump at the zone's edge"
    assert (values == 0.0).mean() == pytest.approx(zone.dead, abs=0.01)


def test_the_kernels_own_flat_zone_counts_where_it_is_larger():
    assert DeadZone(-100, 100, 30, 0.15).dead == 0.3
    assert DeadZone(-100, 100, 5, 0.15).dead == 0.15


def test_sticks_are_right_up_and_towards_the_user(pad):
    device = GamepadDevice()
    assert not hand(device).any(), "a pad at rest, though its sticks rest beside zero"
    for code, value, place in (
        (X, 255, (RADIUS, 0, 0)),
        (Y, 255, (0, -RADIUS, 0)),  # the kernel counts downwards
        (RY, 0, (0, 0, -RADIUS)),  # pushed forward, away from the user
    ):
        pad.move(code, value)
        np.testing.assert_allclose(hand(device), place, **REST)
        pad.move(code, 128)
        np.testing.assert_allclose(hand(device), 0.0, **REST)


@pytest.mark.parametrize("known", PADS, ids=lambda known: known["name"])
def test_pads_as_the_kernel_describes_them(monkeypatch, known):
    """Ranges and codes of each driver of the kernel, and its events, bring the hand where the stick points."""
    axes = {int(code): AbsInfo(*numbers) for code, numbers in known["axes"].items()}
    pad = Pad(axes, keys=known["keys"])
    pad.name = known["name"]
    monkeypatch.setitem(sys.modules, "evdev", evdev_double.module(pad))
    device, now = GamepadDevice(), 0.0
    assert device.name == known["name"]
    assert not hand(device).any()
    for frame in known["frames"]:
        now += 0.3
        pad.send(*frame["events"])
        np.testing.assert_allclose(
            hand(device, start=now), RADIUS * np.array(frame["place"]), atol=0.01 * RADIUS
        )
    pad.send((KEY, SOUTH, 1), (KEY, EAST, 1))
    sample = device.read(now + 0.3)
    assert (sample.buttons, sample.stop) == (1, True)
    device.close()
    if GAS in axes or {RX, RZ} <= axes.keys():
        GamepadDevice(GamepadSettings(depth="triggers")).close()
    else:
        with pytest.raises(DeviceError, match="depth=stick"):
            GamepadDevice(GamepadSettings(depth="triggers"))


def test_a_hand_stays_in_the_workspace_and_keeps_its_direction(pad):
    device = GamepadDevice()
    pad.send((ABS, X, 255), (ABS, Y, 0), (ABS, RY, 0))
    place = hand(device)
    assert np.linalg.norm(place) == pytest.approx(RADIUS)
    pad.send((ABS, RY, 128), (ABS, X, 180), (ABS, Y, 76))
    place = hand(device)
    assert place[0] == pytest.approx(place[1], rel=0.02), "a round dead zone turns nothing"


def test_a_step_of_the_stick_is_smoothed(pad):
    device = GamepadDevice()
    hand(device)
    pad.move(X, 255)
    places = [device.read(0.3 + k * TICK).position[0] for k in range(200)]
    assert max(np.diff(places)) < 0.06 * RADIUS
    assert np.interp(0.63 * RADIUS, places, np.arange(200)) == pytest.approx(20, abs=3)


def test_triggers_move_in_depth(pad):
    device = GamepadDevice(GamepadSettings(depth="triggers"))
    assert not hand(device).any()
    pad.move(RZ, 1023)
    np.testing.assert_allclose(hand(device), (0, 0, -RADIUS), **REST)
    pad.send((ABS, RZ, 0), (ABS, Z, 1023))
    np.testing.assert_allclose(hand(device), (0, 0, RADIUS), **REST)


def test_other_pads_have_their_axes_elsewhere(monkeypatch):
    axes = {X: STICK, Y: STICK, Z: STICK, RZ: STICK, BRAKE: TRIGGER, GAS: TRIGGER}
    for depth, code, end in (("stick", RZ, 0), ("triggers", GAS, 1023)):
        pad = Pad(dict(axes))
        monkeypatch.setitem(sys.modules, "evdev", evdev_double.module(pad))
        device = GamepadDevice(GamepadSettings(depth=depth))
        pad.move(code, end)
        np.testing.assert_allclose(hand(device), (0, 0, -RADIUS), **REST)


def test_speed_adds_up_and_stays(pad):
    device = GamepadDevice(GamepadSettings(mapping="speed", speed=0.05))
    hand(device)
    pad.move(Y, 255)
    hand(device, 500, start=0.3)
    pad.move(Y, 128)
    place = hand(device, 500, start=0.8)
    np.testing.assert_allclose(place, (0.0, -0.05 * 0.5, 0.0), atol=1e-3)
    pad.send((KEY, LEFT_STICK, 1))
    np.testing.assert_allclose(hand(device, start=1.3), 0.0, **REST)


def test_buttons_hold_and_stop(pad):
    device = GamepadDevice()
    sample = device.read(0.0)
    assert (sample.holding, sample.stop, sample.buttons) == (True, False, 0)
    pad.send((KEY, SOUTH, 1))
    assert device.read(0.0).buttons == 1, "the dead-man button"
    pad.send((KEY, EAST, 1))
    assert device.read(0.0).stop
    pad.send((KEY, EAST, 0))
    assert not device.read(0.0).stop


def test_a_button_can_hold_the_body(pad):
    device = GamepadDevice(GamepadSettings(hold="button"))
    assert not device.read(0.0).holding
    pad.send((KEY, SOUTH, 1))
    assert device.read(0.0).holding
    assert device.sample.buttons == 0, "it stops nothing"


def test_what_is_pressed_before_it_is_opened_counts(pad):
    pad.send((KEY, SOUTH, 1), (ABS, X, 255))
    pad.events.clear()
    device = GamepadDevice()
    assert hand(device)[0] == pytest.approx(RADIUS, rel=1e-3)
    assert device.sample.buttons == 1


def test_lost_events_are_asked_for(pad):
    device = GamepadDevice()
    device.read(0.0)
    pad.overflow((ABS, Y, 255), (KEY, EAST, 1))
    np.testing.assert_allclose(hand(device), (0.0, -RADIUS, 0.0), **REST)
    assert device.sample.stop


def test_silence_is_no_stall_and_a_lost_pad_an_error(pad):
    device = GamepadDevice()
    assert device.read(5.0).time == 5.0
    pad.lost = True
    with pytest.raises(DeviceLostError, match="Pad of two sticks is no longer there"):
        device.read(5.001)
    device.close()


def test_the_weak_motor_runs_with_the_force_and_the_strong_one_with_its_change(pad):
    device = GamepadDevice()
    assert device.rumbles
    hand(device, 100, force=lambda t: 0.0)
    assert not pad.played, "no force, no rumble"
    hand(device, 400, start=0.1, force=lambda t: -FULL / 2)
    first, last = pad.played[0], pad.played[-1]
    assert first[WEAK] / 0xFFFF == pytest.approx(0.5, abs=1e-3)
    assert first[STRONG] / 0xFFFF == pytest.approx(1.0, abs=0.05), "half of it in a twentieth of a second"
    assert (last[STRONG], last[WEAK]) == (0, first[WEAK])
    assert len(pad.played) == 8, "renewed every 50 ms"
    assert {entry[2] for entry in pad.played} == {100}, "ms, after which it ends by itself"
    hand(device, 200, start=0.5, force=lambda t: 0.0)
    assert pad.played[-1][3] == 0, "stopped"
    assert len(pad.effects) == 1, "one effect, changed"
    device.close()
    assert pad.effects == {}


def test_more_than_the_limit_is_full(pad):
    device = GamepadDevice()
    hand(device, 100, force=lambda t: 5 * FULL)
    assert pad.played[-1][WEAK] == 0xFFFF


@pytest.mark.parametrize("case", ["switched off", "no motors", "no room"])
def test_a_pad_without_rumble_is_touched_all_the_same(pad, case):
    pad.rumble, pad.full = case != "no motors", case == "no room"
    device = GamepadDevice(GamepadSettings(rumble=float(case != "switched off")))
    hand(device, 100, force=lambda t: FULL)
    assert not device.rumbles
    assert not pad.played
    device.close()
    assert pad.closed


def test_a_missing_package_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "evdev", None)
    with pytest.raises(DeviceError, match=r"pip install 'palpate\[gamepad\]'") as caught:
        GamepadDevice()
    assert "palpate view" in caught.value.fix


def test_the_pad_must_be_clear(monkeypatch):
    keyboard, other = Pad(keys=(30,)), Pad()
    keyboard.path, other.path = "/dev/input/event1", "/dev/input/event2"
    monkeypatch.setitem(sys.modules, "evdev", evdev_double.module(keyboard))
    with pytest.raises(DeviceError, match="group input"):
        GamepadDevice()
    monkeypatch.setitem(sys.modules, "evdev", evdev_double.module(keyboard, other, Pad()))
    with pytest.raises(DeviceError, match="2 gamepads") as caught:
        GamepadDevice()
    assert "/dev/input/event2" in caught.value.what
    assert GamepadDevice(GamepadSettings(path="/dev/input/event2")).name == other.name
    with pytest.raises(DeviceError, match="event99 can't be opened"):
        GamepadDevice(GamepadSettings(path="/dev/input/event99"))


def test_a_pad_without_the_axes_is_refused(monkeypatch):
    for axes, words in (({X: STICK}, "no stick"), ({X: STICK, Y: STICK}, "lacks the axes")):
        pad = Pad(axes)
        monkeypatch.setitem(sys.modules, "evdev", evdev_double.module(pad))
        with pytest.raises(DeviceError, match=words):
            GamepadDevice(GamepadSettings(path=pad.path))


def test_the_package_has_what_the_driver_uses():
    evdev = require_package("evdev", "gamepad")
    for name in (
        "capabilities",
        "absinfo",
        "active_keys",
        "read_one",
        "upload_effect",
        "erase_effect",
        "write",
        "close",
    ):
        assert callable(getattr(evdev.InputDevice, name))
    ff, codes = evdev.ff, evdev.ecodes
    kind = ff.EffectType(ff_rumble_effect=ff.Rumble(strong_magnitude=0xFFFF, weak_magnitude=7))
    effect = ff.Effect(codes.FF_RUMBLE, -1, 0, ff.Trigger(0, 0), ff.Replay(100, 0), kind)
    assert (effect.id, effect.ff_replay.length, effect.u.ff_rumble_effect.strong_magnitude) == (
        -1,
        100,
        0xFFFF,
    )
    names = {"ABS_X": X, "ABS_Y": Y, "ABS_Z": Z, "ABS_RX": RX, "ABS_RY": RY, "ABS_RZ": RZ, "ABS_GAS": GAS,
             "ABS_BRAKE": BRAKE, "BTN_SOUTH": SOUTH, "BTN_EAST": EAST, "BTN_THUMBL": LEFT_STICK,
             "BTN_START": evdev_double.START, "EV_FF": evdev_double.FF, "FF_RUMBLE": 0x50, "SYN_DROPPED": 3,
             }  # fmt: skip
    assert names == {name: getattr(codes, name) for name in names}


READS = """\
from palpate.devices.gamepad import GamepadDevice

device = GamepadDevice()
print(device.name)
place, tick = device.read(0.0).position, 0
while place[1] > -0.9999 * device.traits.radius:
    tick += 1
    place = device.read(1e-3 * tick).position
print(*place)
device.close()
"""


@pytest.mark.full
def test_a_pad_is_read_through_the_package_as_the_kernel_shows_it(tmp_path):
    """The package itself asks a pad that umockdev pretends to be: by the kernel's files, requests and events."""
    require_package("evdev", "gamepad")
    run, event_file = require_program("umockdev-run"), "/dev/input/event7"
    axes, keys = (X, Y, RX, RY), (SOUTH, EAST)
    kinds = [evdev_double.SYN, KEY, ABS]
    (tmp_path / "pad.umockdev").write_text(
        "P: /devices/virtual/input/input7/event7\nN: input/event7\n"
        f"E: DEVNAME={event_file}\nE: SUBSYSTEM=input\nA: dev=13:71\n\n"
    )
    requests = {
        "EVIOCGID": struct.pack("<4H", 3, 1, 2, 3),
        "EVIOCGVERSION": struct.pack("<i", 0x10001),
        "EVIOCGNAME(0)": b"Pad of the kernel".ljust(256, b"\0"),
        "EVIOCGBIT(0)": bits(kinds, 4),
        f"EVIOCGBIT({KEY})": bits(keys, 96),
        f"EVIOCGBIT({ABS})": bits(axes, 96),
        "EVIOCGKEY(0)": bits([], 96),
        "EVIOCGEFFECTS": struct.pack("<i", 0),
        **{f"EVIOCGABS({axis})" if axis else "EVIOCGABS": struct.pack("<6i", *STICK) for axis in axes},
    }
    lines = [f"{request} 0 {answer.hex().upper()}\n" for request, answer in requests.items()]
    (tmp_path / "pad.ioctl").write_text("".join([f"@DEV {event_file}\n", *lines]))
    (tmp_path / "pad.events").write_text(f"E: 0.0 {ABS:04x} {Y:04x} 255\nE: 0.0 0000 0000 0\n")
    pretend = ["-d", "pad.umockdev", "-i", f"{event_file}=pad.ioctl", "-e", f"{event_file}=pad.events"]
    done = subprocess.run(
        [run, *pretend, "--", sys.executable, "-c", READS],
        check=False,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    name, place = done.stdout.splitlines()
    assert name == "Pad of the kernel"
    np.testing.assert_allclose([float(x) for x in place.split()], (0.0, -RADIUS, 0.0), **REST)


def bits(codes, size):
    """The kernel's set of codes, in so many bytes."""
    return sum(1 << code for code in codes).to_bytes(size, "little")
