"""A dry tick just before the real one, so that the real one finds its code and data in the caches.

Between two ticks the processor sleeps or does other people's work, and a tick that takes 15 µs when repeated
takes 70 µs after a millisecond of that. The metronome spins for the last 200 µs anyway; one tick of a second
loop, on a page device that nobody drags and in memory that nobody reads, spends part of that time and
halves the delay between the hand and the force.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from palpate.runtime.devices.page import PageDevice
from palpate.runtime.loop import Loop, Model
from palpate.runtime.safety import Limits
from palpate.runtime.shared import Shared, now
from palpate.runtime.workspace import Workspace

__all__ = ["rehearsal"]


def rehearsal(model: Model, workspace: Workspace, limits: Limits, rate: float) -> Callable[[], None]:
    """A function that performs one tick without any effect outside itself."""
    stage = Shared.private()
    stage.write_command(beat=math.inf, grabbed=True, target=(0.0, -0.1 * workspace.radius, 0.0))
    double = Loop(model, PageDevice(stage.command), stage, workspace, limits, rate=rate)
    return lambda: double.tick(now())
