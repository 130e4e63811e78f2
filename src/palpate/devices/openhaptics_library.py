"""3D Systems' OpenHaptics HD library, as far as a driver of one device needs it: names, types, numbers, errors.

The library is loaded by whoever makes an `HdLibrary`, and not before. Names, numbers and types are those of the HD
headers (hdDevice, hdDefines, hdScheduler; 3.30): lengths in mm, velocities in mm/s, forces in N, torques in mN m,
stiffness in N/mm.
"""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_char_p, c_double, c_int, c_ubyte, c_uint, c_ulong, c_ushort, c_void_p

from palpate.devices.vendor_library import LibraryPlaces, Signatures, VendorLibrary

__all__ = ["DONE", "GOING_ON", "LOST", "NO_DEVICE", "PLACES", "Code", "HdError", "HdLibrary"]

PLACES = LibraryPlaces(
    family="3D Systems Touch, Touch X, Phantom (OpenHaptics HD)",
    device="openhaptics",
    files={
        "linux": ("libHD.so", "libHD.so.3.4", "libHD.so.3.4.0"),
        "darwin": ("HD.framework/HD",),
        "win32": ("hd.dll",),
    },
    folders=("/opt/OpenHaptics/Developer/*/lib64", "/opt/OpenHaptics/Developer/*/lib"),
    variables=("OH_SDK_BASE", "3DTOUCH_BASE"),
    override="PALPATE_HD",
    download="OpenHaptics for Developers 3.4 or later, and the Touch device driver, of 3D Systems",
)
NO_DEVICE = 0xFFFFFFFF
DONE, GOING_ON = 0, 1  # what a callback returns

LOST = frozenset((0x0104, 0x0300, 0x0302))  # handle, device, communication: the device is gone

_MEANINGS = {
    0x0100: "a parameter that it doesn't know",
    0x0101: "a value that it doesn't accept",
    0x0102: "an operation at the wrong time",
    0x0103: "a parameter asked for as a number of another type",
    0x0104: "a handle that is no longer valid",
    0x0200: "the motors are too warm",
    0x0201: "the force exceeded its maximum",
    0x0202: "the force changed too suddenly",
    0x0203: "the handle moved too fast",
    0x0204: "an error of the force",
    0x0300: "a fault of the device",
    0x0301: "the device is already in use",
    0x0302: "the connection failed",
    0x0303: "no configuration of that name",
    0x0304: "an error of the timer",
    0x0400: "a frame begun within a frame",
    0x0401: "a frame ended that was not begun",
    0x0402: "an error of a frame",
    0x0500: "a priority out of range",
    0x0501: "too many callbacks",
    0x0600: "no valid licence of OpenHaptics",
}


class Code:
    """Numbers of parameters and capabilities."""

    BUTTONS, SAFETY_SWITCH, INKWELL = 0x2000, 0x2001, 0x2002
    POSITION, VELOCITY, TRANSFORM = 0x2050, 0x2051, 0x2052
    MODEL, SERIAL = 0x2501, 0x2504
    MAX_WORKSPACE, USABLE_WORKSPACE, CALIBRATION_STYLE = 0x2550, 0x2551, 0x2555
    INPUT_AXES, OUTPUT_AXES = 0x2553, 0x2554  # six where the handle's turn is told, or torques are rendered
    MAX_STIFFNESS, MAX_FORCE, CONTINUOUS_FORCE = 0x2602, 0x2603, 0x2604
    FORCE, TORQUE = 0x2700, 0x2701
    FORCE_OUTPUT, CLAMPING = 0x4000, 0x4001
    CALIBRATED, NEEDS_UPDATE, NEEDS_HAND = 0x5000, 0x5001, 0x5002
    AUTOMATIC, IN_INKWELL = 2, 4  # styles of calibration


class HdError(ctypes.Structure):
    """One entry of the library's list of errors."""

    _fields_ = (("code", c_uint), ("internal", c_int), ("device", c_uint))


_DOUBLES, _INTEGERS, _BYTES = POINTER(c_double), POINTER(c_int), POINTER(c_ubyte)
# name: type of the result, types of the arguments
_SIGNATURES: Signatures = {
    "hdBeginFrame": (None, (c_uint,)),
    "hdEndFrame": (None, (c_uint,)),
    "hdGetDoublev": (None, (c_uint, _DOUBLES)),
    "hdGetIntegerv": (None, (c_uint, _INTEGERS)),
    "hdGetBooleanv": (None, (c_uint, _BYTES)),
    "hdSetDoublev": (None, (c_uint, _DOUBLES)),
    "hdIsEnabled": (c_ubyte, (c_uint,)),
    "hdEnable": (None, (c_uint,)),
    "hdGetError": (HdError, ()),
    "hdGetErrorString": (c_char_p, (c_uint,)),
    "hdInitDevice": (c_uint, (c_char_p,)),
    "hdMakeCurrentDevice": (None, (c_uint,)),
    "hdDisableDevice": (None, (c_uint,)),
    "hdGetString": (c_char_p, (c_uint,)),
    "hdDisable": (None, (c_uint,)),
    "hdCheckCalibration": (c_uint, ()),
    "hdUpdateCalibration": (None, (c_uint,)),
    "hdSetSchedulerRate": (None, (c_ulong,)),
    "hdStartScheduler": (None, ()),
    "hdStopScheduler": (None, ()),
    "hdScheduleAsynchronous": (c_ulong, (c_void_p, c_void_p, c_ushort)),
    "hdUnschedule": (None, (c_ulong,)),
    "hdWaitForCompletion": (c_ubyte, (c_ulong, c_uint)),
}
_MOST_ERRORS = 64  # a list that is longer doesn't end


class HdLibrary(VendorLibrary):
    """The library's functions, with their types, as attributes; one that is missing is a DeviceError."""

    places, signatures = PLACES, _SIGNATURES

    def errors(self) -> list[HdError]:
        """Return the errors since the last call, the newest first; the library has none left afterwards."""
        newest = self.hdGetError()
        raised: list[HdError] = []
        while newest.code != 0 and len(raised) < _MOST_ERRORS:
            raised.append(newest)
            newest = self.hdGetError()
        return raised

    def in_words(self, error: HdError) -> str:
        """Return an error as words with its numbers."""
        text = self.hdGetErrorString(error.code)
        said = text.decode("utf-8", "replace") if text else "no words"
        meaning = _MEANINGS.get(error.code, "an error that is not in the headers")
        return f"{meaning} (error 0x{error.code:04x}, internal {error.internal}: {said})"

    def text(self, code: int) -> str:
        """Return a parameter that is a text; empty where the device has none."""
        value = self.hdGetString(code)
        return "" if self.errors() or not value else value.decode("utf-8", "replace")

    def numbers(self, code: int, count: int) -> tuple[float, ...]:
        """Return a parameter of so many numbers; empty where the device has none."""
        values = (c_double * count)()
        self.hdGetDoublev(code, values)
        return () if self.errors() else tuple(values)

    def whole_number(self, code: int) -> int:
        """Return a parameter that is a whole number; 0 where the device has none."""
        value = c_int()
        self.hdGetIntegerv(code, ctypes.byref(value))
        return 0 if self.errors() else value.value
