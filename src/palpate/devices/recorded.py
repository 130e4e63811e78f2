"""A recorded hand as a device: it goes where it went, on any body, by the loop's own clock.

The place is that of the recorded hand, after its device's axes and clutch, in straight lines between the recorded
ticks; it holds the body where the recorded hand did. A force moves it no more than it can move the past.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.devices.device import Sample, ScriptedHand, Traits
from palpate.devices.device_options import DeviceOptions, number, settings_from, switch, word
from palpate.devices.hand_kind import HandKind
from palpate.devices.trace_file import read_stroke

__all__ = ["RecordedHand", "RecordedSettings"]


@dataclass(frozen=True)
class RecordedSettings(DeviceOptions):
    """Settings of a recorded hand."""

    driver = "trace"
    file: str = word("", meaning="the file of a recorded touch, as palpate run --record FILE writes it")
    speed: float = number(1.0, 0.0, 100.0, above=True)  # times as fast as it was recorded
    repeat: float = switch(0.0)  # 1 begins again at the end; with 0 the hand lets go there


class RecordedHand(ScriptedHand):
    """Moves as a recorded hand did. `sent` keeps the latest force, N."""

    settings_kind = RecordedSettings
    hand = HandKind.RECORDING
    traits = Traits(0.075, 20.0, None, "a recorded hand, which no force moves")

    def __init__(self, settings: RecordedSettings) -> None:
        trace = read_stroke(settings.file)
        header = trace.header
        self.traits = Traits(
            float(header["workspace"]["radius"]),
            float(header["limits"]["max_force"]),
            None,
            type(self).traits.source,
            name=f"recorded hand of {trace.path.name}",
        )
        self._times = np.ascontiguousarray(trace.time / settings.speed)
        self._hand = np.ascontiguousarray(trace.ticks["hand"])
        self._holds = trace.flag("holding") & ~trace.flag("clutched") & ~trace.flag("read_failed")
        self._repeat, self._k, self._began = settings.repeat > 0.0, 0, math.nan
        super().__init__()

    @classmethod
    def traits_of(cls, options: Mapping[str, str]) -> Traits:
        """Return the traits of the hand in a file, those of the kind where none is named."""
        if "file" not in options:
            return cls.traits
        return cls(settings_from(RecordedSettings, options)).traits

    def read(self, now: float) -> Sample:
        """Return where the recorded hand was, m, as long after its first tick as `now` (s) is after the first call."""
        if math.isnan(self._began):
            self._began = now
        times, sample = self._times, self.sample
        t, last = now - self._began, float(times[-1])
        if self._repeat and t > last:
            self._began, self._k, t = now, 0, 0.0
        sample.time = now
        sample.holding = t <= last and bool(self._holds[self._at(t)])
        k = self._k
        share = min(1.0, max(0.0, (t - float(times[k])) / (float(times[k + 1]) - float(times[k]))))
        np.subtract(self._hand[k + 1], self._hand[k], out=sample.position)
        sample.position *= share
        sample.position += self._hand[k]
        return sample

    def _at(self, t: float) -> int:
        """Return the last tick at or before t, s; the next call goes on from there."""
        times, most = self._times, len(self._times) - 2
        if t < times[self._k]:
            self._k = 0
        while self._k < most and times[self._k + 1] <= t:
            self._k += 1
        return self._k

    def close(self) -> None:
        """Let go."""
        super().close()
        self._holds = np.zeros(len(self._holds), dtype=bool)
