"""The search for devices on a machine laid out in a folder: nothing is loaded, and no port of this machine is asked."""

from __future__ import annotations

from dataclasses import replace

import pytest

from palpate.cli.device_commands import findings_in_words
from palpate.devices import device_names, device_search
from palpate.devices.device_search import HARDWARE, LibrarySearch, search
from palpate.devices.profiles import PROFILES, weakest_profile
from palpate.devices.surroundings import Surroundings

GAMEPAD = """\
I: Bus=0003 Vendor=046d
N: Name="A mouse"
H: Handlers=mouse0 event2

I: Bus=0003 Vendor=045e
N: Name="Pad of two sticks"
H: Handlers=event7 js0
"""


def entry(device):
    return next(e for e in HARDWARE if e.device == device)


PUCK = """\
I: Bus=0003 Vendor=046d Product=c626
N: Name="3Dconnexion SpaceNavigator"
H: Handlers=event4 js1

I: Bus=0003 Vendor=256f Product=c650
N: Name="3Dconnexion CadMouse"
H: Handlers=mouse1 event5
"""


@pytest.fixture
def empty(tmp_path):
    return Surroundings(tmp_path, {}, "linux", lambda host, port: False)


def touch(root, path):
    file = root / path.lstrip("/")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.touch()
    return file


def test_an_empty_machine_has_the_devices_of_this_version(empty):
    findings = search(empty)
    assert {f.device for f in findings if f.state == "ready"} >= {"page", "stroke"}
    for finding in findings:
        assert finding.detail
        if finding.kind != "built in":
            assert finding.state == "absent"
            assert finding.looked_for
            assert finding.looked_in
            assert finding.remedy
    assert len({f.name for f in findings}) == len(findings)


@pytest.mark.parametrize(
    ("device", "path", "environment"),
    [
        ("forcedimension", "/usr/local/lib/libdrd.so", {}),
        ("forcedimension", "/usr/lib/x86_64-linux-gnu/libdhd.so.3", {}),
        ("forcedimension", "/home/me/sdk/lib/release/lin-x86_64-gcc/libdrd.so.3", {"FDSDK": "/home/me/sdk"}),
        ("forcedimension", "/home/me/odd-name.so", {"PALPATE_DHD": "/home/me/odd-name.so"}),
        ("forcedimension", "/home/me/libdhd.so", {"PALPATE_DHD": "/home/me"}),
        ("forcedimension", "/a/libdhd.so", {"LD_LIBRARY_PATH": "/nowhere:/a"}),
        ("openhaptics", "/usr/lib/libHD.so", {}),
        ("openhaptics", "/opt/OpenHaptics/Developer/3.4-0/lib64/libHD.so.3.4", {}),
        ("openhaptics", "/kit/lib/libHD.so", {"OH_SDK_BASE": "/kit"}),
    ],
)
def test_a_library_is_found_where_it_lies(empty, device, path, environment):
    file = touch(empty.root, path)
    surroundings = Surroundings(empty.root, environment, "linux", empty.answers)
    found = entry(device).look(surroundings)
    assert str(file) in found.detail
    assert found.state == ("ready" if device in device_names() else "present")


def test_the_file_that_is_named_wins(empty):
    touch(empty.root, "/usr/lib/libdrd.so")
    named = touch(empty.root, "/mine/libdhd.so")
    surroundings = Surroundings(empty.root, {"PALPATE_DHD": "/mine/libdhd.so"}, "linux", empty.answers)
    assert entry("forcedimension").places.find(surroundings) == named


def test_windows_has_its_own_names(empty):
    touch(empty.root, "/vendor/dhd64.dll")
    surroundings = Surroundings(empty.root, {"PATH": "/a;/vendor"}, "win32", empty.answers)
    assert "dhd64.dll" in entry("forcedimension").look(surroundings).detail
    assert "absent" in entry("forcedimension").look(empty).state


@pytest.mark.parametrize(("device", "port"), [("haply", 10001), ("haply", 10000), ("crtk", 9090)])
def test_a_service_is_found_by_its_port(empty, device, port):
    asked = []

    def answers(host, number):
        asked.append((host, number))
        return number == port

    found = entry(device).look(Surroundings(empty.root, {}, "linux", answers))
    assert found.state != "absent"
    assert f"port {port} answers" in found.detail
    assert {host for host, _ in asked} == {"127.0.0.1"}, "only this machine is asked"


def test_gamepads_come_from_the_kernels_list(empty):
    listing = touch(empty.root, "/proc/bus/input/devices")
    listing.write_text(GAMEPAD, encoding="utf-8")
    touch(empty.root, "/dev/input/event7")
    found = entry("gamepad").look(empty)
    assert found.state != "absent"
    assert "Pad of two sticks at /dev/input/event7" in found.detail
    assert "mouse" not in found.detail


def test_a_gamepad_that_can_not_be_read_says_what_to_do(empty):
    touch(empty.root, "/proc/bus/input/devices").write_text(GAMEPAD, encoding="utf-8")
    assert "group input" in entry("gamepad").look(empty).remedy


@pytest.mark.parametrize("installed", [False, True])
def test_a_gamepad_needs_its_package(empty, installed):
    touch(empty.root, "/proc/bus/input/devices").write_text(GAMEPAD, encoding="utf-8")
    touch(empty.root, "/dev/input/event7")
    there = replace(empty, installed=lambda package: installed and package == "evdev")
    found = entry("gamepad").look(there)
    assert found.state == ("ready" if installed else "present")
    assert ("palpate[gamepad]" in found.remedy) is not installed


@pytest.mark.parametrize(
    ("environment", "configuration", "place"),
    [
        ({}, "", "/var/run/spnav.sock"),
        ({"SPNAV_SOCKET": "/home/me/puck.sock"}, "", "/home/me/puck.sock"),
        ({}, "socket = /run/puck\n", "/run/puck"),
    ],
)
def test_a_puck_is_found_by_the_socket_of_its_driver(empty, environment, configuration, place):
    touch(empty.root, "/etc/spnavrc").write_text(configuration, encoding="utf-8")
    there = replace(empty, environment=environment, listens=lambda path: path == empty.root / place[1:])
    found = entry("spacemouse").look(there)
    assert (found.state, found.remedy, found.device) == ("ready", "", "spacemouse")
    assert place in found.detail


def test_a_puck_without_its_driver_says_what_to_install(empty):
    touch(empty.root, "/proc/bus/input/devices").write_text(PUCK, encoding="utf-8")
    found = entry("spacemouse").look(empty)
    assert found.state == "absent"
    assert found.detail == "no driver answers; plugged in: 3Dconnexion SpaceNavigator"
    assert "apt install spacenavd" in found.remedy
    assert "SPNAV_SOCKET" in found.remedy
    assert "none" in entry("gamepad").look(empty).detail, "though the kernel gives it a joystick's handler"


def test_a_socket_that_nothing_listens_at_is_no_driver(empty):
    touch(empty.root, "/var/run/spnav.sock")
    assert entry("spacemouse").look(empty).state == "absent"


def test_what_is_driven_is_ready_by_its_name(empty, monkeypatch):
    """A driver that is entered in the table of devices makes its library usable, and is listed once."""
    monkeypatch.setattr(device_search, "device_names", lambda: ("page", "forcedimension"))
    assert "Force Dimension SDK" in entry("forcedimension").look(empty).remedy
    touch(empty.root, "/usr/lib/libdrd.so")
    found = [f for f in search(empty) if f.device == "forcedimension"]
    assert [f.state for f in found] == ["ready"]
    assert found[0].remedy == ""


@pytest.mark.parametrize("device", ["haply", "forcedimension", "openhaptics"])
def test_the_list_explains_limits_buttons_and_what_was_seen(empty, device):
    finding = next(f for f in search(empty) if f.device == device)
    text = findings_in_words([finding], explain=True)
    family = [profile for profile in PROFILES.values() if profile.driver == device]
    weakest = weakest_profile(device)
    for profile in family:
        assert f"{profile.name} ±{1e3 * profile.radius:g} mm, {profile.max_force:g} N" in text
        assert weakest.max_force <= profile.max_force
        assert weakest.radius <= profile.radius
    assert f"any other type ±{1e3 * weakest.radius:g} mm, {weakest.max_force:g} N" in text
    assert "buttons: " in text
    assert "seen on hardware: no" in text
    assert "any other type" not in findings_in_words([finding]), "a doctor's list is short"


def test_each_library_has_names_for_each_system():
    for library in HARDWARE:
        if isinstance(library, LibrarySearch):
            assert set(library.places.files) == {"linux", "darwin", "win32"}
            assert library.places.override.startswith("PALPATE_")
