"""The browser page as a device: mouse or finger in, a drawn arrow out.

The page sends some 60 positions a second, the loop runs at 1 kHz. Between two of them the position moves in a
straight line from where it is to the newest target, in the time that frames have lately taken. It can't
overshoot, being always between two points that the hand was at; the price is a delay of one frame (17 ms at
60 Hz) when the line ends, half of that on average. Extrapolating would save the delay and overshoot at every
turn of the hand.

The sign of life is the page's heartbeat and not its positions: a resting mouse is not a stall, a hidden tab
is one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.devices.device import Driver, Sample, Traits
from palpate.devices.device_options import settings_from
from palpate.devices.hand_kind import HandKind
from palpate.network.shared_memory import Block

__all__ = ["FrameInterpolator", "PageDevice", "page_patience"]

_FRAME = 1.0 / 60.0  # s, until the page's own pace is known
_SHORTEST, _LONGEST = 0.004, 0.050  # s: 240 Hz screens; longer gaps are pauses of the hand
_FREE = 0.040  # s, time constant of the drawn body's return after the hand lets go


def page_patience(period: float) -> float:
    """Return the silence, s, from which on a page with heartbeats every `period` s counts as stalled."""
    return max(0.100, 3.0 * period) if math.isfinite(period) else 0.100


class FrameInterpolator:
    """Straight lines between the frames of a slow input, one frame behind, written into an array (3,), m."""

    def __init__(self, position: np.ndarray) -> None:
        self.position = position
        self._from, self._step = np.zeros(3), np.zeros(3)
        self._arrived, self._frame = -math.inf, _FRAME

    def aim(self, target: np.ndarray, now: float) -> None:
        """Head for `target` (3,), m, of a new frame that arrived at `now`, s."""
        gap = now - self._arrived
        if gap <= _LONGEST:
            self._frame += 0.25 * (max(gap, _SHORTEST) - self._frame)  # the network's jitter, smoothed
        self._arrived = now
        if not math.isfinite(self.position.sum()):
            self.position[:] = target  # a bad frame must not poison those after it
        self._from[:] = self.position
        np.subtract(target, self._from, out=self._step)

    def start(self, target: np.ndarray, now: float) -> None:
        """Take hold at `target` (3,), m, at `now`, s: nothing leads there."""
        self._arrived = now
        self._from[:] = self.position[:] = target
        self._step[:] = 0.0

    def move(self, now: float) -> None:
        """Renew `position` for `now`, s."""
        share = min(1.0, max(0.0, (now - self._arrived) / self._frame))
        np.multiply(self._step, share, out=self.position)
        self.position += self._from

    def relax(self, elapsed: float) -> None:
        """Return towards the centre, for the eye, where nobody holds, `elapsed` s after the last call."""
        self.position *= math.exp(-max(0.0, elapsed) / _FREE)
        if not math.isfinite(self.position.sum()):
            self.position[:] = 0.0


@dataclass(frozen=True)
class _NoSettings:
    pass


class PageDevice(Driver):
    """Steered through the command block; the force leaves through the state block."""

    hand = HandKind.PAGE
    traits = Traits(0.075, 20.0, None, "no motor; the limit on the drawn force is delta.3's")

    def __init__(self, commands: Block) -> None:
        self._record = commands.record
        names = ("beat", "sequence", "grabbed", "hidden", "period")
        self._beat, self._sequence, self._grabbed, self._hidden, self._period = (
            commands.record[name] for name in names
        )
        self._target = commands.record["target"]
        self.sample = Sample(page_patience(0.0))
        self._path = FrameInterpolator(self.sample.position)
        self._seen, self._last, self._held = -1, -math.inf, False

    @classmethod
    def open(cls, commands: Block, options: Mapping[str, str]) -> PageDevice:
        """Open on the loop's command block; there are no options."""
        settings_from(_NoSettings, options)
        return cls(commands)

    def read(self, now: float) -> Sample:
        """Return the interpolated hand at `now`, s. The loop has fetched the command block before."""
        sample, path = self.sample, self._path
        sample.time = float(self._beat)
        sample.patience = page_patience(float(self._period))
        sample.asleep = bool(self._hidden)
        sample.holding = bool(self._grabbed)
        sequence = int(self._sequence)
        if sample.holding:
            if sequence != self._seen and not self._held:
                path.start(self._target, now)
            elif sequence != self._seen or not self._held:  # an old target is approached, not jumped to
                path.aim(self._target, now)
            self._seen, self._held = sequence, True
            path.move(now)
        else:
            path.relax(now - self._last)
            self._held = False
        self._last = now
        return sample

    def write(self, force: np.ndarray) -> None:
        """Do nothing: the page draws the published force."""

    def close(self) -> None:
        """Do nothing: there is nothing to let go of."""
