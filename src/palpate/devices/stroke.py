"""A scripted hand: strokes of a sine or a triangle, the same on every run.

It serves `palpate run` without hardware and measurements of the loop. Since it can be made to stall, to send no
numbers or to fail at a given second, it also tests how the loop answers a bad device.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.devices.device import Sample, ScriptedHand, Traits
from palpate.devices.device_options import DeviceOptions, number, word
from palpate.errors import DeviceError

__all__ = ["StrokeDevice", "StrokeSettings"]


@dataclass(frozen=True)
class StrokeSettings(DeviceOptions):
    """Settings of the script."""

    driver = "stroke"
    amplitude: float = number(0.03)  # A, m
    frequency: float = number(0.5)  # f, Hz
    x: float = number(0.0)  # direction, normalised, with y and z
    y: float = number(-1.0)
    z: float = number(0.0)
    shape: str = word("sine", "ramp")  # sine: A sin 2πft; ramp: the triangle through the same zeros and peaks
    stall_at: float = math.inf  # s after the first reading at which the samples stop
    nan_at: float = math.inf  # s after it at which they turn into NaN
    fail_at: float = math.inf  # s after it at which reading raises
    lasting: float = math.inf  # s, duration of each of these

    def __post_init__(self) -> None:
        super().__post_init__()
        if not math.hypot(self.x, self.y, self.z) > 0.0:
            raise self.refusal("x=0,y=0,z=0", "A direction is not zero, for example y=-1.")


class StrokeDevice(ScriptedHand):
    """Holds the body and moves it by the script. `sent` keeps the latest force, N."""

    settings_kind = StrokeSettings
    traits = Traits(0.075, 20.0, None, "a script; the force limit is delta.3's")

    def __init__(self, settings: StrokeSettings | None = None) -> None:
        s = settings or StrokeSettings()
        self._settings = s
        self._reach = s.amplitude * np.array([s.x, s.y, s.z]) / math.hypot(s.x, s.y, s.z)
        self._began: float | None = None
        super().__init__()
        self.sample.holding = True

    def read(self, now: float) -> Sample:
        """Return the script's position, m, at `now`, s."""
        if self._began is None:
            self._began = now
        t = now - self._began
        s, sample = self._settings, self.sample
        if s.fail_at <= t < s.fail_at + s.lasting:
            raise DeviceError("The scripted device failed, as its settings say.")
        if s.stall_at <= t < s.stall_at + s.lasting:
            return sample
        sample.time = now
        np.multiply(self._reach, self._wave(t), out=sample.position)
        if s.nan_at <= t < s.nan_at + s.lasting:
            sample.position[1] = math.nan
        return sample

    def _wave(self, t: float) -> float:
        phase = self._settings.frequency * t
        if self._settings.shape == "sine":
            return math.sin(2.0 * math.pi * phase)
        return 4.0 * abs((phase - 0.25) % 1.0 - 0.5) - 1.0
