"""Force Dimension's library, DHD with DRD, as far as a driver of handle and wrist needs it: names, types, return codes.

The library is loaded by `DhdLibrary` and not before. Each function's return code is looked at by itself: 0 is success,
-1 an error with the library's words, 1 of a reading means that it came too soon and repeats the old values, 2 of a
force that a motor is saturated. Any other code is an error too.

Names, codes and units are those of the *Force Dimension SDK* 3.16: m, m/s, N, kg.
"""

from __future__ import annotations

from ctypes import POINTER, c_bool, c_byte, c_char_p, c_double, c_int, c_ubyte, c_uint, c_ushort
from typing import Any

from palpate.devices.vendor_library import LibraryPlaces, Signatures, VendorLibrary
from palpate.errors import DeviceError

__all__ = ["FORCES_OFF", "LOST", "OPTIONAL", "PLACES", "DhdLibrary", "Status"]

PLACES = LibraryPlaces(
    family="Force Dimension delta, omega, sigma, lambda; Novint Falcon (DHD)",
    device="forcedimension",
    files={
        "linux": ("libdrd.so", "libdrd.so.3", "libdhd.so", "libdhd.so.3"),
        "darwin": ("libdrd.dylib", "libdrd.3.dylib", "libdhd.dylib", "libdhd.3.dylib"),
        "win32": ("drd64.dll", "dhd64.dll", "drdms64.dll", "dhdms64.dll"),
    },
    folders=("/opt/force[-_]dimension*/lib/release/*", "/opt/sdk-3.*/lib/release/*"),
    variables=("FDSDK",),
    override="PALPATE_DHD",
    download="the Force Dimension SDK, 3.16 or later",
)

_DOUBLES, _INTEGERS = POINTER(c_double), POINTER(c_int)
_STATUS = 17  # entries of the status vector

# error numbers: what is no longer there, and what a device simply lacks
LOST = frozenset((2, 4, 5))
OPTIONAL = frozenset((6, 10))

FORCES_OFF = {
    0: "it doesn't say why",
    1: "its force button was pressed",
    2: "it moved faster than its velocity brake allows",
    3: "its watchdog waited in vain for a force command",
    4: "a program turned them off",
    5: "its USB connection failed",
    6: "its dead-man switch was let go",
}

# name: type of the result, types of the arguments; a device's id is the last argument
_SIGNATURES: Signatures = {
    "dhdGetDeviceCount": (c_int, ()),
    "dhdOpen": (c_int, ()),
    "dhdOpenSerial": (c_int, (c_int,)),
    "dhdClose": (c_int, (c_byte,)),
    "dhdStop": (c_int, (c_byte,)),
    "dhdGetSystemType": (c_int, (c_byte,)),
    "dhdGetSystemName": (c_char_p, (c_byte,)),
    "dhdGetSerialNumber": (c_int, (POINTER(c_ushort), c_byte)),
    "dhdIsLeftHanded": (c_bool, (c_byte,)),
    "dhdGetStatus": (c_int, (_INTEGERS, c_byte)),
    "dhdGetButtonMask": (c_uint, (c_byte,)),
    "dhdGetPosition": (c_int, (_DOUBLES, _DOUBLES, _DOUBLES, c_byte)),
    "dhdSetForce": (c_int, (c_double, c_double, c_double, c_byte)),
    "dhdEnableForce": (c_int, (c_bool, c_byte)),
    "dhdSetBrakes": (c_int, (c_bool, c_byte)),
    "dhdSetGravityCompensation": (c_int, (c_bool, c_byte)),
    "dhdSetEffectorMass": (c_int, (c_double, c_byte)),
    "dhdSetMaxForce": (c_int, (c_double, c_byte)),
    "dhdGetMaxForce": (c_double, (c_byte,)),
    "dhdEnableExpertMode": (c_int, ()),
    "dhdSetWatchdog": (c_int, (c_ubyte, c_byte)),
    "dhdErrorGetLast": (c_int, ()),
    "dhdErrorGetLastStr": (c_char_p, ()),
    "dhdSleep": (None, (c_double,)),
    "dhdGetTime": (c_double, ()),
}
# those that not every library has: DRD comes in libdrd alone, wrists came later
_EXTRA: Signatures = {
    "dhdEnableSimulator": (None, (c_bool,)),
    "dhdHasWrist": (c_bool, (c_byte,)),
    "dhdHasActiveWrist": (c_bool, (c_byte,)),
    "dhdGetPositionAndOrientationFrame": (c_int, (_DOUBLES, _DOUBLES, _DOUBLES, _DOUBLES, c_byte)),
    "dhdSetForceAndTorque": (c_int, (*(c_double,) * 6, c_byte)),
    "drdOpenID": (c_int, (c_byte,)),
    "drdIsInitialized": (c_bool, (c_byte,)),
    "drdAutoInit": (c_int, (c_byte,)),
    "drdIsRunning": (c_bool, (c_byte,)),
    "drdStop": (c_int, (c_bool, c_byte)),
}


class Status:
    """The status vector of a device, read into one array for good."""

    def __init__(self) -> None:
        self.values = (c_int * _STATUS)()

    @property
    def powered(self) -> bool:
        """True while the device has power."""
        return bool(self.values[0])

    @property
    def connected(self) -> bool:
        """True while the device is there."""
        return bool(self.values[1])

    @property
    def homed(self) -> bool:
        """True once its encoders have been homed."""
        return bool(self.values[3])

    @property
    def forces(self) -> bool:
        """True while its motors push."""
        return bool(self.values[5])

    @property
    def wrong(self) -> bool:
        """True while the device reports an error."""
        return bool(self.values[9])

    @property
    def cause(self) -> int:
        """The cause of its forces being off, a key of `FORCES_OFF`."""
        return int(self.values[14])


class DhdLibrary(VendorLibrary):
    """The library's functions, with their types, as attributes; one that is missing is a DeviceError."""

    places, signatures, extra = PLACES, _SIGNATURES, _EXTRA

    def last_error(self) -> tuple[int, str]:
        """Return the number and the words of the library's last error."""
        text = self.dhdErrorGetLastStr()
        return int(self.dhdErrorGetLast()), text.decode("utf-8", "replace") if text else "no words"

    def call(self, name: str, *arguments: Any, optional: bool = False) -> bool:
        """Call a function that returns 0 or fails, outside the loop; a failure is a DeviceError in the library's words.

        The answer is False where the call is `optional` and this device doesn't have that.
        """
        code = getattr(self, name)(*arguments)
        if code == 0:
            return True
        number, words = self.last_error()
        if code == -1 and optional and number in OPTIONAL:
            return False
        raise DeviceError(
            f"The Force Dimension library refuses {name}.",
            why=f"{words} (error {number})"
            if code == -1
            else f"It returned {code}, which is no code of its own.",
            fix="Check power, cable and the device's own programs, then start again.",
        )
