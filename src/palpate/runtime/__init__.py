"""In the hand: a real-time process that reads a device, evaluates the learnt body and sends a force back.

    shared, records                   state out and commands in, through shared memory
    process, child, report            LoopProcess: the parent's handle, and the process behind it
    loop, publisher, rehearsal        one tick, as a list of stages
    clock, priority, histogram        being on time, and knowing how much so
    safety, faults, stability         what may reach a hand
    workspace, devices                where the hand is
    touchable, pressed                what it is laid on
    realtime                          what this machine permits

Names are loaded when asked for, so that the loop's process imports nothing it doesn't need.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.runtime.faults import Fault
    from palpate.runtime.process import LoopProcess
    from palpate.runtime.report import LoopReport
    from palpate.runtime.shared import Shared, State, now
    from palpate.runtime.workspace import Workspace

__all__ = ["Fault", "LoopProcess", "LoopReport", "Shared", "State", "Workspace", "now"]

_HOMES = {
    "Fault": "faults",
    "LoopProcess": "process",
    "LoopReport": "report",
    "Shared": "shared",
    "State": "shared",
    "Workspace": "workspace",
    "now": "shared",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
