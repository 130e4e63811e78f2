"""Dry ticks just before the real ones, which bring code and data into the caches.

Between two ticks the processor sleeps or does other people's work, and a tick that takes 15 µs when repeated takes
70 µs after a millisecond of that. The metronome spins for the last 200 µs anyway; one tick of a second loop, on a page
device that nobody drags and in memory that nobody reads, spends part of that time and halves the delay between the hand
and the force.
"""

from __future__ import annotations

import math

from palpate.devices.page import PageDevice
from palpate.runtime.hand_evaluator import HandEvaluator, Model
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits
from palpate.runtime.shared_state import Shared, now
from palpate.runtime.workspace import Workspace

__all__ = ["Rehearsal"]


class Rehearsal:
    """Performs dry ticks, of the real loop's workspace, limits and rate (Hz), without any effect outside itself."""

    def __init__(self, model: Model, workspace: Workspace, limits: Limits, rate: float) -> None:
        stage = Shared.private()
        stage.write_command(beat=math.inf, grabbed=True, target=(0.0, -0.1 * workspace.radius, 0.0))
        self._double = Loop(model, PageDevice(stage.command), stage, workspace, limits, rate=rate)

    def __call__(self) -> None:
        """Perform one tick."""
        self._double.tick(now())

    def take(self, evaluator: HandEvaluator) -> None:
        """Rehearse with another surrogate from now on; the evaluator is this rehearsal's own."""
        evaluator.rest_zone = self._double.evaluator.rest_zone
        self._double.evaluator = evaluator
