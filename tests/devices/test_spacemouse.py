"""The puck on a double of spacenavd, fed with example packets, and on spacenavd itself; no puck has been touched."""

from __future__ import annotations

import contextlib
import math
import os
import select
import socket
import subprocess
import time

import numpy as np
import pytest
from spnav_double import FRAMES, Daemon, packet

from palpate.devices import device_traits, spacemouse
from palpate.devices.spacemouse import SOCKET, SpaceMouseDevice, SpaceMouseSettings, sockets
from palpate.errors import DeviceError, DeviceLostError
from system_programs import require_program
from waiting import wait_for

TICK, RADIUS, SPEED = 1e-3, SpaceMouseDevice.traits.radius, 0.08
REST, LEFT_GO = [0, 0, 0, 0, 0, 0, 0, 16], [2, 0, 0, 0, 0, 0, 0, 0]
LEFT, RIGHT = [1, 0, 1, 0, 0, 0, 0, 0], [1, 1, 1, 0, 0, 0, 0, 0]
UNPLUGGED, PLUGGED = [3, 1, 0, 0x206, 0x46D, 0xC626, 0, 0], [3, 0, 1, 0x206, 0x46D, 0xC626, 0, 0]


@pytest.fixture
def daemon():
    with Daemon() as double:
        yield double


@pytest.fixture
def connect(monkeypatch):
    devices = []

    def connect_to(daemon, **settings):
        if daemon.protocol:  # it answers, however busy the machine is
            monkeypatch.setattr(spacemouse, "_ANSWER", 60.0)
        devices.append(SpaceMouseDevice(SpaceMouseSettings(socket=daemon.path, **settings)))
        return devices[-1]

    yield connect_to
    for device in devices:
        device.close()


def push(x=0, y=0, away=0):
    return [0, x, y, away, 0, 0, 0, 16]


class Hand:
    """Reads a device tick by tick, and never before what was sent has arrived."""

    def __init__(self, device, daemon):
        self.device, self.daemon, self.now = device, daemon, 0.0

    def __call__(self, *events, ticks=1):
        if events:
            self.daemon.send(*events)
            select.select([self.device._socket], (), (), 5.0)
        for _ in range(ticks):
            sample = self.device.read(self.now)
            self.now += TICK
        return sample

    def travel(self, *events, ticks=200):
        """The way of the hand in these ticks, once the low pass has followed, m/s."""
        self(*events, ticks=100)
        start = self.device.sample.position.copy()
        return (self(ticks=ticks).position - start) / (ticks * TICK)


@pytest.mark.parametrize(
    "frame", [f for f in FRAMES["events"] if "push" in f["means"]], ids=lambda f: f["says"]
)
def test_example_packets_of_motion(daemon, frame, connect):
    """A tenth of the way is the dead zone, the rest is stretched: share s gives (s − 0.1)/0.9 of the speed."""
    hand = Hand(connect(daemon, dead=0.1), daemon)
    share = np.array(frame["means"]["push"])
    size = np.linalg.norm(share)
    expected = SPEED * (size - 0.1) / 0.9 * share / size if size else np.zeros(3)
    np.testing.assert_allclose(hand.travel(frame["words"]), expected, atol=1e-3 * SPEED)


def test_example_packets_of_buttons_and_others(daemon, connect):
    hand = Hand(connect(daemon, centre=0.0), daemon)
    for frame in FRAMES["events"]:
        means = frame["means"]
        if means.get("gone"):
            with pytest.raises(DeviceLostError, match="no longer plugged in"):
                hand(frame["words"])
            hand.daemon.asked.acquire()  # the driver asks for another puck
        else:
            sample = hand(frame["words"])
            if "pressed" in means:
                assert sample.buttons == sum(1 << number - 1 for number in means["pressed"])


def test_the_puck_is_known_by_name_and_buttons(daemon, connect):
    device = connect(daemon)
    assert (device.name, device.protocol, device.traits.buttons) == ("Spaceball 3003/3003C", 1, 1)
    with Daemon(answers=("long_name", "buttons"), first=(push(1), LEFT)) as other:
        device = connect(other, centre=0.0)
        assert (device.name, device.traits.buttons) == ("3Dconnexion SpaceMouse Wireless Receiver", 2)


def test_the_hand_stays_where_it_is_let_go_and_in_its_sphere(daemon, connect):
    hand = Hand(connect(daemon), daemon)
    hand(push(x=350, y=-350), ticks=400)
    place = hand(REST, ticks=600).position.copy()  # the low pass is at its end
    assert np.linalg.norm(place) > 0.02
    np.testing.assert_allclose(hand(ticks=100).position, place, atol=1e-12)
    assert place[0] == pytest.approx(-place[1], rel=1e-9), "a round dead zone turns nothing"
    far = hand(push(y=-350), ticks=2000).position
    assert np.linalg.norm(far) == pytest.approx(RADIUS, rel=1e-3)
    np.testing.assert_allclose(hand(REST, RIGHT, ticks=400).position, 0.0, atol=1e-6)
    assert hand.device.sample.buttons == 0, "the driver's own button stops nothing"


def test_a_puck_at_rest_beside_its_zero_moves_nothing(daemon, connect):
    hand = Hand(connect(daemon), daemon)
    assert not hand(push(20, -20, 20), ticks=300).position.any()  # 34.6 of 35 counts


def test_a_deflection_can_be_a_place(daemon, connect):
    hand = Hand(connect(daemon, mapping="position", dead=0.0), daemon)
    np.testing.assert_allclose(hand(push(y=-175), ticks=300).position, (0.0, -RADIUS / 2, 0.0), atol=1e-6)
    np.testing.assert_allclose(hand(REST, ticks=300).position, 0.0, atol=1e-6)


def test_buttons_hold_stop_and_are_dead_man(daemon, connect):
    hand = Hand(connect(daemon), daemon)
    sample = hand()
    assert (sample.holding, sample.buttons, sample.clutched, sample.stop) == (True, 0, False, False)
    assert hand(LEFT).buttons == 1
    assert hand([1, 5, 1, 0, 0, 0, 0, 0]).buttons == 0b10001, "the driver's own, the second, is left out"
    assert hand(LEFT_GO).buttons == 0b10000


def test_a_button_can_hold_the_body(daemon, connect):
    hand = Hand(connect(daemon, hold=1.0, centre=0.0), daemon)
    assert not hand().holding
    assert hand(LEFT).holding
    assert hand.device.sample.buttons == 0
    assert hand(RIGHT).buttons == 1
    assert device_traits("spacemouse").buttons == 1
    assert device_traits("spacemouse:centre=0").buttons == 2
    assert device_traits("spacemouse:hold=1").buttons == 0


def test_an_unplugged_puck_is_lost_stands_still_and_is_found_again(daemon, connect):
    hand = Hand(connect(daemon), daemon)
    daemon.buttons = "no_buttons"
    with pytest.raises(DeviceLostError, match="Spaceball 3003/3003C is no longer plugged in"):
        hand(push(y=-350), LEFT, UNPLUGGED)
    with pytest.raises(DeviceLostError):
        hand()
    sample = hand(PLUGGED)
    place = sample.position.copy()
    np.testing.assert_array_equal(hand(ticks=100).position, place)
    assert sample.buttons == 0, "let go with the puck that is gone"


def test_of_two_pucks_one_may_go(daemon, connect):
    hand = Hand(connect(daemon), daemon)
    with pytest.raises(DeviceLostError):
        hand(UNPLUGGED)
    for _ in range(2):  # the sign of life, and the question for another puck
        daemon.asked.acquire()
    wait_for(lambda: is_there(hand))
    assert hand().holding


def is_there(hand):
    try:
        return hand()
    except DeviceLostError:
        return False


def test_a_daemon_that_ends_is_lost(daemon, connect):
    hand = Hand(connect(daemon), daemon)
    hand(push(y=-350))
    daemon.end()
    with pytest.raises(DeviceLostError, match="spacenavd has ended"):
        hand(ticks=2)
    hand.device.close()


def test_a_daemon_that_hangs_is_a_stall_and_a_puck_at_rest_is_none(daemon, connect):
    hand = Hand(connect(daemon), daemon)
    for k in range(5):
        hand.now = 0.2 * k
        hand()
        daemon.asked.acquire()
        select.select([hand.device._socket], (), (), 5.0)  # the answer
        assert hand().time > 0.2 * k
    daemon.hanging = True
    for _ in range(1000):
        sample = hand()
    assert hand.now - sample.time > sample.patience


def test_a_daemon_before_version_1_is_understood(connect):
    with Daemon(protocol=0, first=(push(1),)) as daemon:
        device = connect(daemon)
        daemon.asked.acquire()
        assert device.protocol == 0
        assert daemon.sensitivity == 1.0, "it has taken the wish for a sensitivity"
        hand = Hand(device, daemon)
        assert hand.travel(push(x=350))[0] == pytest.approx(SPEED, rel=1e-3)
        assert device.read(50.0).time == 50.0, "silence is no stall"


def test_packets_in_pieces_and_floods(connect):
    with Daemon(protocol=0) as daemon:  # one that answers nothing in between
        send_pieces_and_a_flood(Hand(connect(daemon), daemon), daemon)


def send_pieces_and_a_flood(hand, daemon):
    data = packet(push(x=350))
    for piece in (data[:5], data[5:31]):
        daemon.send_bytes(piece)
        assert not hand(ticks=30).position.any()
    daemon.send_bytes(data[31:])
    assert hand.travel()[0] > 0.0
    daemon.send(*[push(x=-350)] * 4000)
    assert abs(hand.travel(REST)[0]) < 0.01 * SPEED, "the newest counts"


def test_a_missing_daemon_says_what_to_install_and_where_it_was_looked_for(tmp_path, monkeypatch, connect):
    monkeypatch.setenv("SPNAV_SOCKET", str(tmp_path / "named.sock"))
    monkeypatch.setattr(spacemouse, "SOCKET", str(tmp_path / "default.sock"))
    with pytest.raises(DeviceError, match="spacenavd, is not running") as caught:
        SpaceMouseDevice()
    text = str(caught.value)
    for words in ("named.sock", "default.sock", "SPNAV_SOCKET", "/etc/spnavrc", "apt install spacenavd"):
        assert words in text
    for answers in (("no_name", "no_buttons"), ("name", "no_buttons")):
        with Daemon(answers=answers) as daemon, pytest.raises(DeviceError, match="has no puck"):
            connect(daemon)


def test_the_socket_is_looked_for_where_libspnav_does():
    text = "# socket = /commented\nsensitivity = 2\n socket = /from/file \n"
    assert sockets({"SPNAV_SOCKET": "/named"}, text) == ("/named", "/from/file", SOCKET)
    assert sockets({}, "") == (SOCKET,)


def test_a_system_without_unix_sockets_is_told_so(monkeypatch):
    monkeypatch.delattr(spacemouse.socket, "AF_UNIX")
    with pytest.raises(DeviceError, match="can't have") as caught:
        SpaceMouseDevice()
    assert "palpate view" in caught.value.fix


# The daemon has one place for its socket, which may be another's: the loader puts another in its stead.
ELSEWHERE = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>

static void place(struct sockaddr_un *there) {
    memset(there, 0, sizeof *there);
    there->sun_family = AF_UNIX;
    strncpy(there->sun_path, getenv("SPNAV_SOCKET"), sizeof there->sun_path - 1);
}
int bind(int s, const struct sockaddr *address, socklen_t size) {
    int (*real)(int, const struct sockaddr *, socklen_t) = dlsym(RTLD_NEXT, "bind");
    struct sockaddr_un there;
    place(&there);
    return address->sa_family == AF_UNIX ? real(s, (struct sockaddr *)&there, sizeof there) : real(s, address, size);
}
int connect(int s, const struct sockaddr *address, socklen_t size) { (void)s, (void)address, (void)size; return -1; }
int unlink(const char *file) { (void)file; return 0; }
int remove(const char *file) { (void)file; return 0; }
FILE *fopen(const char *file, const char *mode) {
    FILE *(*real)(const char *, const char *) = dlsym(RTLD_NEXT, "fopen");
    return strstr(file, "spnavd") ? NULL : real(file, mode);
}
"""
SPACEBALL = (
    b"\r@1 Spaceball alive and well after a poweron reset.\r"
    b"@2 Firmware version 2.35 created on 24-Oct-1997.\r"
)


@pytest.fixture
def spaceball(tmp_path, c_compiler, monkeypatch):
    """spacenavd itself, with a Spaceball 3003 on a pseudo terminal; yields the end that is the Spaceball."""
    program = require_program("spacenavd")
    (tmp_path / "elsewhere.c").write_text(ELSEWHERE, encoding="utf-8")
    library = tmp_path / "elsewhere.so"
    subprocess.run(
        [c_compiler, "-shared", "-fPIC", str(tmp_path / "elsewhere.c"), "-o", str(library), "-ldl"],
        check=True,
    )
    ball, line = os.openpty()
    (tmp_path / "spnavrc").write_text(f"serial = {os.ttyname(line)}\n", encoding="utf-8")
    with Daemon() as other:  # for a path that is short
        path = other.path + "2"
        monkeypatch.setenv("SPNAV_SOCKET", path)
        process = subprocess.Popen(
            [program, "-d", "-c", str(tmp_path / "spnavrc")],
            env=os.environ | {"LD_PRELOAD": str(library), "DISPLAY": ""},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            deadline, heard = time.monotonic() + 20.0, b""
            while not os.path.exists(path) and time.monotonic() < deadline:
                if select.select([ball], (), (), 0.02)[0]:
                    heard += os.read(ball, 100)
                    if heard.endswith(b"@RESET\r"):
                        os.write(ball, SPACEBALL)
            yield ball
        finally:
            process.kill()
            process.wait()
            os.close(line)
            os.close(ball)


def listens(path):
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as connection:
        connection.connect(path)
        return True
    return False


def test_spacenavd_itself_brings_a_virtual_puck(spaceball):
    """A Spaceball's packet D: a period and six numbers of 16 bits; K: its buttons."""
    wait_for(lambda: listens(os.environ["SPNAV_SOCKET"]))  # it may be bound, and not yet listening
    device = SpaceMouseDevice()
    assert device.name == "Spaceball 3003/3003C"
    assert device.traits.buttons == 1
    device.read(0.0)
    os.write(
        spaceball,
        b"D" + b"".join(n.to_bytes(2, "big", signed=True) for n in (16, 60, -240, 300, 0, 0, 0)) + b"\r",
    )
    os.write(spaceball, b"K\0\1\r")
    now = 0.0
    wait_for(lambda: device.read(0.0).buttons)
    for _ in range(100):
        now += TICK
        device.read(now)
    start = device.sample.position.copy()
    for _ in range(200):
        now += TICK
        sample = device.read(now)
    way = sample.position - start
    np.testing.assert_allclose(
        way / np.linalg.norm(way), np.array([60, -240, -300]) / math.hypot(60, 240, 300), atol=1e-6
    )
    device.close()
