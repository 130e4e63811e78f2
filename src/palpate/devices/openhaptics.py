"""3D Systems Touch and Touch X, and the Phantom devices before them, through the vendor's library OpenHaptics HD.

The library is loaded when a device is opened, see `openhaptics_library`. It has a thread of its own, which calls a
compiled function a thousand times a second, see `openhaptics_servo`. That and the loop meet in a mailbox. A place is
therefore up to a frame old, and a force up to a frame late; `Traits.delay` says so.

A force that is older than 20 ms is not sent: the loop must have stopped. After that, and after errors of the motors'
own limits (warm, too much force, too sudden, too fast), the force is zero until the loop has been told, has answered
with zero force, and a pause is over. Any other error ends the calls, with zero force, and the loop is told in words.

The library's frame is ours: x right, y up, z towards the user. It has mm, here it is m; the origin here is the middle
of the usable workspace.
"""

from __future__ import annotations

import math
import time
from ctypes import byref, c_int
from dataclasses import dataclass

import numpy as np

from palpate.devices import openhaptics_servo as servo
from palpate.devices.device import (
    ASSUMED_DAMPING,
    HARDWARE_PATIENCE,
    NO_TORQUE,
    PLAIN_AXES,
    UNPUBLISHED,
    Driver,
    Sample,
    Traits,
    free_buttons,
)
from palpate.devices.device_options import DeviceOptions, number, word
from palpate.devices.openhaptics_library import LOST, NO_DEVICE, Code, HdError, HdLibrary
from palpate.devices.orientation import rotation_into
from palpate.devices.profiles import DeviceProfile, device_profile, weakest_profile
from palpate.errors import DeviceError, DeviceLostError, DeviceStopError

__all__ = ["AXES", "OpenHapticsDevice", "OpenHapticsSettings"]

AXES = PLAIN_AXES

# a word in the model's name, and the profile; the Touch X took the Desktop's place in the vendor's range
_MODELS = {"touch x": "desktop", "touchx": "desktop", "desktop": "desktop", "omni": "omni", "touch": "touch"}
_MASS = 0.045  # kg, apparent at the tip of a Touch (3D Systems' data sheet)
_PRIORITY = 0xFFFF  # of the callback, the highest
_START = 2.0  # s that the frames of the start may take
_MARGIN, _UNSTATED_REACH = 0.02, 0.4  # m around the largest workspace; m of reach where none is stated
# s of zero force after an error, at first and at most: doubled where an error comes again within _AGAIN, s
_PAUSE, _LONGEST_PAUSE, _AGAIN = 0.1, 5.0, 10.0
_GOODBYE = 0.1  # s for the last frame
_BUTTONS = 4
_MM = 1e-3
_ALL_AXES = 6  # of a handle whose turn is told, or which is turned
_TORQUE = (
    0.048  # N m, what the weakest axis of a Phantom Premium 6DOF renders for long (its maker's data sheet)
)


@dataclass(frozen=True)
class OpenHapticsSettings(DeviceOptions):
    """Settings of the connection."""

    driver = "openhaptics"
    device: str = word("Default Device")  # name of the device in the vendor's configuration
    library: str = ""  # file of the vendor's library; empty looks for it
    rate: float = 1000.0  # Hz, frames of the library's scheduler; 500 or 1000
    # button, 1 to 4, that works as a clutch; 0 for none. Of the others the first is the dead-man button where one is
    # asked for, and each stops the force else
    clutch: float = number(0.0, 0.0, _BUTTONS, whole=True)
    # rest or ignore: whether a stylus that stands in its inkwell lets go of the body
    inkwell: str = word("rest", "ignore")
    # ignore, or hold: the force acts only while the device's safety switch is active
    switch: str = word("ignore", "hold")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rate not in {500.0, 1000.0}:
            raise self.refusal(f"rate={self.rate:g}", "It is 500 or 1000 Hz.")


class OpenHapticsDevice(Driver):
    """One device behind the vendor's library; its traits are of its own figures and its profile's the smaller ones.

    `profile` is that of its model; `name` has its serial number; `note` says in a sentence what was taken on trust when
    it was opened, empty for nothing; `frames` counts those so far.
    """

    settings_kind = OpenHapticsSettings
    called = "OpenHaptics device"
    traits = Traits(
        0.10,
        7.9,
        ASSUMED_DAMPING,
        f"before it is opened: Phantom Desktop's, the largest; {UNPUBLISHED}",
        mass=_MASS,
        delay=2e-3,
        axes=AXES,
        buttons=_BUTTONS,
    )

    def __init__(self, settings: OpenHapticsSettings | None = None) -> None:
        self._settings = settings = settings or OpenHapticsSettings()
        self._hd = HdLibrary.load(settings.library)
        self.note = ""
        self.sample, self.frames, self.name = Sample(), 0, f"The OpenHaptics device {settings.device!r}"
        self._clutch = int(settings.clutch) - 1
        self._rests, self._needs_switch = settings.inkwell == "rest", settings.switch == "hold"
        self._place, self._now = np.zeros(3), -math.inf
        # stops that were told and that are over; what was told, and until when it lasts at least
        self._told, self._resumed, self._words, self._until = 0, 0, "", -math.inf
        self._pause, self._failed = _PAUSE, -math.inf
        self._handle, self._running = 0, False
        self._device = self._connect()
        patience = round(HARDWARE_PATIENCE * settings.rate) - 2
        self._box = servo.Mailbox(self._hd.addresses(), self._device, patience)
        self._cells = self._box.cells
        try:
            self._identify()
            self._calibrate()
            self._start()
        except BaseException:
            self.close()
            raise

    def read(self, now: float) -> Sample:
        """Return what the device said in its latest frame; one without a new frame keeps the sample's time."""
        self.check_open()
        self._now, sample, cells = now, self.sample, self._cells
        frame, mask, inkwell, switch = self._box.read(self._place)
        if frame != self.frames:
            self.frames, sample.time = frame, now
            np.multiply(self._place, _MM, out=sample.position)
            sample.position -= self._centre
            if self.traits.orients:
                a = self._box.turn.tolist()  # column by column
                rotation_into((a[0], a[4], a[8], a[1], a[5], a[9], a[2], a[6], a[10]), sample.orientation)
            sample.holding = not (inkwell and self._rests) and (switch or not self._needs_switch)
            sample.clutched = self._clutch >= 0 and bool(mask >> self._clutch & 1)
            sample.buttons = free_buttons(mask, self._clutch)
        if cells[servo.FATAL] != 0.0:
            raise self._failure()
        if (stops := int(cells[servo.STOPS])) != self._resumed:
            if stops != self._told:
                self._take_stop(stops, now)
            raise DeviceStopError(self._words)
        return sample

    def write(self, force: np.ndarray, torque: np.ndarray = NO_TORQUE) -> None:
        """Leave a force (3,), N, and a torque (3,), N m, for the next frame.

        A force over the device's maximum is shortened. A device without motors in its wrist takes no torque.
        """
        x, y, z, norm = self.components(force)
        if norm > self.traits.max_force:  # more than that, and the library turns the forces off
            share = self.traits.max_force / norm
            x, y, z = share * x, share * y, share * z
        *twist, turning = self.components(torque)
        share = 1e3 * min(1.0, self.traits.max_torque / turning) if turning > 0.0 else 0.0
        self._box.write(x, y, z, *(share * part for part in twist))
        norm += turning
        if self._told != self._resumed and norm == 0.0 and self._now >= self._until:
            if not self._hd.hdIsEnabled(Code.FORCE_OUTPUT):
                self._hd.hdEnable(Code.FORCE_OUTPUT)
            self._cells[servo.RESUMED] = self._resumed = self._told

    def close(self) -> None:
        """Zero force in a last frame, then stop the scheduler and let go."""
        if self.closed:
            return
        self.closed = True
        hd = self._hd
        self._cells[servo.LEAVING] = 1.0
        if self._running:
            end = time.monotonic() + _GOODBYE
            while hd.hdWaitForCompletion(self._handle, 0) and time.monotonic() < end:
                time.sleep(1e-3)
            if hd.hdWaitForCompletion(self._handle, 0):
                hd.hdUnschedule(self._handle)
            hd.hdStopScheduler()
        hd.hdDisable(Code.FORCE_OUTPUT)
        hd.hdDisableDevice(self._device)
        hd.errors()  # nobody is left to hear them

    def _take_stop(self, stops: int, now: float) -> None:
        """Keep the force at zero for a pause, longer where the last stop was not long ago."""
        cause = self._cells[servo.CAUSE]
        if cause == servo.SILENCE:
            self._words = f"The loop sent {self.name} no force for {1e3 * HARDWARE_PATIENCE:.0f} ms."
        else:
            error = HdError(int(cause), int(self._cells[servo.INTERNAL]), self._device)
            self._words = f"{self.name} has turned its forces off: {self._hd.in_words(error)}."
        if stops > self._told + 1 or self._told == self._resumed:  # not the same one, still going on
            again = now - self._failed < _AGAIN
            self._pause = min(2.0 * self._pause, _LONGEST_PAUSE) if again else _PAUSE
        self._failed, self._until, self._told = now, now + self._pause, stops

    def _failure(self) -> DeviceError:
        """Return the error that ended the calls."""
        error = HdError(int(self._cells[servo.FATAL]), int(self._cells[servo.FATAL_INTERNAL]), self._device)
        kind = DeviceLostError if error.code in LOST else DeviceError
        words = f"{self.name} has failed: {self._hd.in_words(error)}."
        return kind(words, fix="Check cable and power, then start again.")

    def _refuse(self, errors: list[HdError], what: str, fix: str) -> None:
        if errors:
            raise DeviceError(f"{self.name} {what}.", why=self._hd.in_words(errors[0]), fix=fix)

    def _connect(self) -> int:
        device = int(self._hd.hdInitDevice(self._settings.device.encode()))
        errors = self._hd.errors()
        if errors or device == NO_DEVICE:
            why = self._hd.in_words(errors[0]) if errors else "The library says nothing more."
            raise DeviceError(
                f"{self.name} can't be opened.",
                why=why,
                fix="Connect it, switch it on and set it up in the vendor's own program (Touch Setup), which also "
                "gives it its name; close other programs that use it; and check the licence of OpenHaptics.",
            )
        self._hd.hdMakeCurrentDevice(device)
        return device

    def _identify(self) -> None:
        """Find out which device it is, and what it may do."""
        hd = self._hd
        hd.hdBeginFrame(self._device)
        model, serial = hd.text(Code.MODEL), hd.text(Code.SERIAL)
        force, continuous, stiffness = (
            _positive(hd.numbers(code, 1))
            for code in (Code.MAX_FORCE, Code.CONTINUOUS_FORCE, Code.MAX_STIFFNESS)
        )
        usable, largest = (hd.numbers(code, 6) for code in (Code.USABLE_WORKSPACE, Code.MAX_WORKSPACE))
        axes, rendered = (hd.whole_number(code) for code in (Code.INPUT_AXES, Code.OUTPUT_AXES))
        hd.hdEndFrame(self._device)
        self._refuse(hd.errors(), "can't be asked what it is", "Start it again.")
        known = next((name for word, name in _MODELS.items() if word in model.lower()), "")
        self.profile: DeviceProfile = device_profile(known) if known else weakest_profile("openhaptics")
        self.name = f"3D Systems {model or 'device'}{f' {serial}' if serial else ''}"
        self.name += "" if known else ", unknown model"
        self.note = "" if known else f"{self.name}: the least of each limit that this driver knows holds"
        self._centre, inner = _middle(usable)
        outer = [abs(side * _MM - self._centre[i % 3]) for i, side in enumerate(largest)]
        corner = math.hypot(*(max(outer[i], outer[i + 3]) for i in range(3))) if outer else 0.0
        self.traits = self.limited_traits(
            self.profile,
            f"the smaller of its own figures and those of {self.profile.name}: {self.profile.source}; {UNPUBLISHED}; "
            "mass: the data sheet of a Touch",
            radius=min(self.profile.radius, inner),
            max_force=min(self.profile.max_force, force),
            delay=2.0 / self._settings.rate,
            max_stiffness=min(self.profile.max_stiffness, stiffness / _MM),
            continuous_force=continuous,
            orients=axes >= _ALL_AXES,
            max_torque=_TORQUE if min(axes, rendered) >= _ALL_AXES else 0.0,
            reach=corner + _MARGIN if math.isfinite(corner) and corner > 0.05 else _UNSTATED_REACH,
        )

    def _calibrate(self) -> None:
        """Refuse a device whose positions are wrong; one that can be calibrated as it stands is."""
        hd = self._hd
        hd.hdBeginFrame(self._device)
        state = hd.hdCheckCalibration()
        if state == Code.NEEDS_UPDATE:
            style = c_int()
            hd.hdGetIntegerv(Code.CALIBRATION_STYLE, byref(style))
            for way in (Code.AUTOMATIC, Code.IN_INKWELL):
                if state != Code.CALIBRATED and style.value & way:
                    hd.hdUpdateCalibration(way)
                    state = hd.hdCheckCalibration()
        hd.hdEndFrame(self._device)
        errors = hd.errors()
        if state != Code.CALIBRATED or errors:
            raise DeviceError(
                f"{self.name} is not calibrated: its positions are wrong.",
                why=hd.in_words(errors[0]) if errors else f"It reports 0x{state:04x}.",
                fix="Put the stylus into its inkwell and start again, or calibrate it in the vendor's own program "
                "(Touch Diagnostic).",
            )

    def _start(self) -> None:
        """Turn the forces on, at zero, and throw the first positions away once they look right."""
        hd, rate = self._hd, int(self._settings.rate)
        hd.hdEnable(Code.FORCE_OUTPUT)
        self._refuse(hd.errors(), "doesn't turn its forces on", "Check its power supply.")
        hd.hdEnable(Code.CLAMPING)
        hd.errors()  # a help that is not relied on
        hd.hdSetSchedulerRate(rate)
        self._refuse(hd.errors(), f"doesn't run at {rate} Hz", "Try openhaptics:rate=500.")
        self._cells[servo.ORIENTS] = float(self.traits.orients)
        self._cells[servo.RENDERS] = float(self.traits.max_torque > 0.0)
        cells = self._cells.ctypes.data
        self._handle = hd.hdScheduleAsynchronous(servo.servo().address, cells, _PRIORITY)
        self._refuse(hd.errors(), "takes no callback", "Close other programs that use it.")
        hd.hdStartScheduler()
        self._running = True
        self._refuse(hd.errors(), "has no running scheduler", "Close other programs that use it.")
        end = time.monotonic() + _START
        while time.monotonic() < end and not self._cells[servo.FATAL]:
            if self._box.read(self._place)[0] >= servo.FIRST:
                break
            time.sleep(1e-3)
        if self._cells[servo.FATAL] != 0.0:
            raise self._failure()
        if (frames := self._box.read(self._place)[0]) < servo.FIRST:
            raise DeviceError(f"{self.name} gave {frames} positions in {_START:g} s.", fix="Start it again.")
        # several drivers deliver garbage at first
        for *place, u, v, w in self._box.early()[servo.FIRST // 2 :].tolist():
            far = math.hypot(*(p * _MM - c for p, c in zip(place, self._centre, strict=True)))
            speed = math.hypot(u, v, w) * _MM
            fix = "Calibrate it, and hold it still while it is opened."
            self.check_start(far, speed, self.traits.reach, fix)


def _positive(values: tuple[float, ...]) -> float:
    """Return a device's own limit; infinite where it states none."""
    return values[0] if values and math.isfinite(values[0]) and values[0] > 0.0 else math.inf


def _middle(box: tuple[float, ...]) -> tuple[tuple[float, float, float], float]:
    """Return centre and radius, m, of the sphere in a box of the library, mm; one that is none has neither."""
    sides = [(b - a) * _MM for a, b in zip(box[:3], box[3:], strict=True)]
    if not sides or not all(0.02 < side < 2.0 for side in sides):
        return (0.0, 0.0, 0.0), math.inf
    x, y, z = ((a + b) / 2.0 * _MM for a, b in zip(box[:3], box[3:], strict=True))
    return (x, y, z), min(sides) / 2.0
