"""Drivers and their doubles against what the makers document: files in tests/data/devices, each with its sources.

The files were written from the makers' pages and headers, not from the drivers: a double that shares a misreading with
its driver fails here.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
from pathlib import Path

import numpy as np
import pytest
from library_double import LibraryDouble
from rigs import HaplyRig

from palpate.devices.force_dimension import TYPES, ForceDimensionDevice, ForceDimensionSettings
from palpate.devices.force_dimension_library import FORCES_OFF, LOST, OPTIONAL, Status
from palpate.devices.haply_frames import (
    choose_profile,
    device_types,
    grips_in,
    read_buttons,
    read_scale,
)
from palpate.devices.openhaptics import OpenHapticsDevice, OpenHapticsSettings
from palpate.devices.openhaptics_library import LOST as HD_LOST
from palpate.devices.openhaptics_library import NO_DEVICE, Code, HdLibrary
from palpate.devices.profiles import PROFILES, device_profile, weakest_profile
from palpate.devices.websocket_channel import WebsocketChannel
from palpate.errors import DeviceError

DATA = Path(__file__).parents[1] / "data" / "devices"
HAPLY, DHD, HD = (
    json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    for name in ("haply", "force-dimension", "openhaptics")
)
INVENTORIES = pytest.mark.parametrize("example", HAPLY["inventories"], ids=lambda e: e["title"])


@pytest.fixture
def serve():
    """Starts a service with an inventory."""
    with contextlib.ExitStack() as stack:
        yield lambda frame, **settings: stack.enter_context(HaplyRig(inventory=frame, **settings))


def connect(rig, example, **settings):
    return rig.open(**({"spelling": "auto" if example["echoes"] else "values"} | settings))


def frames(service):
    """The first frame of a service, and one that answers a message."""
    channel = WebsocketChannel(f"ws://127.0.0.1:{service.port}", "service")
    first = json.loads(channel.receive(1.0)[-1])
    channel.send("{}")
    later = json.loads(channel.receive(1.0)[-1])
    channel.close()
    return first, later


def form(value):
    """The fields of a frame with the kinds of their values."""
    if isinstance(value, dict):
        return {key: form(part) for key, part in value.items()}
    if isinstance(value, list):
        return [form(part) for part in value]
    return "switch" if isinstance(value, bool) else "number" if isinstance(value, (int, float)) else "text"


@INVENTORIES
def test_a_double_keeps_the_form_of_the_makers_frames(serve, example):
    first, later = frames(serve(example["frame"]).service)
    first.pop("session_id")
    assert form(first) == form({k: v for k, v in example["frame"].items() if k != "session_id"})
    for entry in (*first["inverse3"], *first["verse_grip"], *first.get("wireless_verse_grip", ())):
        del entry["config"]
    assert form(later) == form(first), "configurations come once"


def test_the_doubles_own_frames_have_the_form_of_the_makers(serve):
    frame, _ = frames(serve(None, grip="both").service)
    maker = HAPLY["inventories"][0]["frame"]

    def check(ours, theirs, where):
        if isinstance(ours, dict):
            for key in ours:
                if where[-1:] != ("status",) or key in theirs:  # no page prints the status of a grip in whole
                    check(ours[key], theirs[key], (*where, key))
        elif isinstance(ours, list):
            check(ours[0], theirs[0], where)
        else:
            assert form(ours) == form(theirs), where

    for grip in frame["wireless_verse_grip"]:
        del grip["status"]
    check(frame, maker, ())


@INVENTORIES
def test_a_driver_drives_the_makers_device(serve, example):
    rig = serve(example["frame"])
    device = connect(rig, example)
    profile = PROFILES[example["profile"]]
    assert device.profile is profile
    assert (device.traits.radius, device.traits.max_force) == (profile.radius, profile.max_force)
    assert device.traits.source.startswith(profile.source)
    assert ("doesn't tell whether its origin" in device.note) is (
        "preset" not in example["frame"]["inverse3"][0]["config"]
    )
    rig.drive(60, (0.0, 0.0, 0.5))
    np.testing.assert_allclose(rig.force(), [0.0, 0.0, 0.5])
    device.close()


@INVENTORIES
def test_each_button_of_the_makers_grips_stops_the_force(serve, example, plain, shared):
    """The button of a wired grip was read in the wired grip's own field by nobody."""
    rig = serve(example["frame"])
    loop = rig.loop(plain, shared, opened=connect(rig, example))
    device = rig.device
    assert rig.press()[-1][0] > 0.1, "it is pressed"
    rig.service.press(example["buttons"][0])
    rig.run(3)
    assert not loop.safety.force.any()
    for name in example["buttons"]:
        rig.service.press(name)
        rig.run(3)
        assert device.sample.buttons, name
        rig.service.press(*example["buttons"], down=False)
        rig.run(3)
        assert not device.sample.buttons
    loop.end()


@INVENTORIES
def test_each_button_of_the_makers_grips_can_hold(serve, example):
    rig = serve(example["frame"])
    for name in example["buttons"]:
        device = connect(rig, example, hold=name)
        assert not rig.sample(3).holding
        rig.service.press(name)
        assert rig.sample(3).holding, name
        assert device.sample.buttons == 0, "its driver has it"
        rig.service.press(name, down=False)
        assert not rig.sample(3).holding
        device.close()


def test_a_service_that_echoes_no_force_asks_for_the_spelling(serve):
    example = next(e for e in HAPLY["inventories"] if not e["echoes"])
    rig = serve(example["frame"])
    device = connect(rig, example, spelling="auto")
    with pytest.raises(DeviceError, match=r"echoes no force, as before version 3\.5"):
        rig.drive(60, (0.0, 0.0, 0.5))
    device.close()


@pytest.mark.parametrize("example", HAPLY["grips"], ids=lambda e: e["source"][:40])
def test_buttons_are_read_in_each_form_that_is_documented(example):
    grip = {"device_id": "1", "state": example["state"]}
    assert list(grips_in({example["family"]: [grip]})) == [grip]
    assert read_buttons(grip) == example["pressed"]


@pytest.mark.parametrize("example", HAPLY["types"], ids=lambda e: e["source"][:40])
def test_a_type_is_read_where_it_is_documented(example):
    profile = choose_profile(device_types(example))
    assert profile == (
        weakest_profile("haply") if example["profile"] == "unknown" else PROFILES[example["profile"]]
    )


@pytest.mark.parametrize("example", HAPLY["scales"], ids=lambda e: e["source"][:40])
def test_a_scale_is_read_in_each_form_of_an_answer(example):
    if example["scale"] is None:
        with pytest.raises((LookupError, TypeError)):
            read_scale(example["answer"])
    else:
        assert read_scale(example["answer"]) == example["scale"]


def test_the_types_of_force_dimension_are_those_of_the_header():
    assert dict(DHD["types"].values()) == TYPES
    assert not TYPES.keys() & set(DHD["unknown"].values())


@pytest.mark.parametrize(("name", "limits"), DHD["limits"].items())
def test_the_limits_of_force_dimension_are_those_of_the_source(name, limits):
    profile = device_profile(name)
    assert (profile.max_force, profile.max_stiffness, profile.radius) == (
        limits["newton"],
        limits["newton_per_metre"],
        limits["metre"],
    )


def test_the_numbers_of_force_dimension_are_those_of_the_header():
    errors, causes, places = DHD["errors"], DHD["causes"], DHD["status"]
    assert {errors[f"DHD_ERROR_{name}"] for name in ("COM", "NO_DRIVER_FOUND", "NO_DEVICE_FOUND")} == LOST
    assert {errors[f"DHD_ERROR_{name}"] for name in ("NOT_AVAILABLE", "NOT_IMPLEMENTED")} == OPTIONAL
    words = {"BUTTON": "button", "VELOCITY": "velocity", "WATCHDOG": "watchdog", "SOFTWARE": "program",
             "USBDISCN": "USB", "DEADMAN": "dead-man"}  # fmt: skip
    for name, word in words.items():
        assert word in FORCES_OFF[causes[f"DHD_FORCEOFF_{name}"]]
    status = Status()
    assert len(status.values) == DHD["status_length"]
    for field, place in (
        ("powered", "POWER"),
        ("connected", "CONNECTED"),
        ("homed", "RESET"),
        ("forces", "FORCE"),
        ("wrong", "ERROR"),
    ):
        status.values[:] = [int(k == places[f"DHD_STATUS_{place}"]) for k in range(len(status.values))]
        seen = [
            name for name in ("powered", "connected", "homed", "forces", "wrong") if getattr(status, name)
        ]
        assert seen == [field]
    status.values[places["DHD_STATUS_FORCEOFFCAUSE"]] = 6
    assert status.cause == 6


def test_the_double_of_force_dimension_has_the_headers_numbers(double):
    dhd = LibraryDouble(double("forcedimension"), manual=1, time=100)
    device = ForceDimensionDevice(ForceDimensionSettings(library=str(dhd.path)))
    errors, places = DHD["errors"], DHD["status"]
    status = (ctypes.c_int * DHD["status_length"])()
    for setting, place in (
        ("powered", "POWER"),
        ("homed", "RESET"),
        ("broken", "ERROR"),
        ("gravity", "GRAVITY"),
    ):
        for value in (0, 1):
            setattr(dhd, setting, value)
            dhd.library.dhdGetStatus(status, 0)
            assert status[places[f"DHD_STATUS_{place}"]] == value
    dhd.broken, dhd.force_on, dhd.cause = 0, 1, 0
    dhd.library.dhdStop(0)
    dhd.library.dhdGetStatus(status, 0)
    assert status[places["DHD_STATUS_FORCE"]] == 0
    assert status[places["DHD_STATUS_FORCEOFFCAUSE"]] == DHD["causes"]["DHD_FORCEOFF_SOFTWARE"]
    dhd.buttons = 1 << DHD["falcon_buttons"]["RIGHT"]
    assert device.read(dhd.time).buttons == 1 << DHD["falcon_buttons"]["RIGHT"]
    device.close()
    last = dhd.library.dhdErrorGetLast
    assert (dhd.library.dhdClose(0), last()) == (-1, errors["DHD_ERROR_NO_DEVICE_FOUND"])
    dhd.in_use = 1
    assert (dhd.library.dhdOpen(), last()) == (-1, errors["DHD_ERROR_DEVICE_IN_USE"])


def test_the_numbers_of_openhaptics_are_those_of_the_header():
    for parameter in HD["parameters"]:
        assert getattr(Code, parameter["driver"]) == int(parameter["code"], 16), parameter["name"]
    for name, code in HD["constants"].items():
        assert getattr(Code, name) == int(code, 16), name
    assert int(HD["handles"]["HD_INVALID_HANDLE"], 16) == NO_DEVICE
    errors = {name: int(code, 16) for name, code in HD["errors"].items()}
    assert {errors[name] for name in ("HD_BAD_HANDLE", "HD_DEVICE_FAULT", "HD_COMM_ERROR")} == HD_LOST


def test_errors_of_openhaptics_are_said_by_the_headers_numbers(double):
    words = {
        "HD_INVALID_ENUM": "doesn't know",
        "HD_INVALID_VALUE": "value",
        "HD_INVALID_OPERATION": "wrong time",
        "HD_INVALID_INPUT_TYPE": "type",
        "HD_BAD_HANDLE": "handle",
        "HD_WARM_MOTORS": "warm",
        "HD_EXCEEDED_MAX_FORCE": "maximum",
        "HD_EXCEEDED_MAX_FORCE_IMPULSE": "suddenly",
        "HD_EXCEEDED_MAX_VELOCITY": "fast",
        "HD_COMM_ERROR": "connection",
        "HD_INVALID_LICENSE": "licence",
    }
    hd = HdLibrary(LibraryDouble(double("openhaptics")).library)
    for name, code in HD["errors"].items():
        if name == "HD_SUCCESS":
            continue
        error = type(hd.hdGetError())(int(code, 16), 0, 0)
        assert "not in the headers" not in hd.in_words(error), name
        assert words.get(name, "") in hd.in_words(error)


@pytest.mark.parametrize("parameter", HD["parameters"], ids=lambda p: p["name"])
def test_the_double_of_openhaptics_asks_for_the_headers_types(double, parameter):
    """A switch that is asked for as an integer is an invalid input type: a public client found that on a device."""
    library = LibraryDouble(double("openhaptics"))
    hd = HdLibrary(library.library)
    device = hd.hdInitDevice(b"Default Device")
    hd.hdBeginFrame(device)
    values = {
        "double": (hd.hdGetDoublev, (ctypes.c_double * 6)()),
        "integer": (hd.hdGetIntegerv, (ctypes.c_int * 6)()),
        "boolean": (hd.hdGetBooleanv, (ctypes.c_ubyte * 6)()),
    }
    code = int(parameter["code"], 16)
    for kind, (get, place) in values.items():
        get(code, place)
        raised = [error.code for error in hd.errors()]
        wrong = [int(HD["errors"]["HD_INVALID_INPUT_TYPE"], 16)]
        assert raised == ([] if kind == parameter["type"] else wrong)
    assert bool(hd.hdGetString(code)) is (parameter["type"] == "string")
    hd.errors()
    hd.hdEndFrame(device)
    hd.hdGetDoublev(Code.POSITION, values["double"][1])
    assert [error.code for error in hd.errors()] == [int(HD["errors"]["HD_INVALID_OPERATION"], 16)]
    hd.hdDisableDevice(device)


def test_models_of_openhaptics_have_the_profile_of_their_name(double, monkeypatch):
    library = LibraryDouble(double("openhaptics"), speed=50)
    for example in HD["models"]:
        monkeypatch.setattr(
            HdLibrary, "text", lambda self, code, e=example: e["model"] if code == Code.MODEL else ""
        )
        device = OpenHapticsDevice(OpenHapticsSettings(library=str(library.path)))
        unknown = example["profile"] == "unknown"
        assert device.profile.name == example["profile"]
        assert ("unknown model" in device.traits.name) is ("least of each limit" in device.note) is unknown
        device.close()
