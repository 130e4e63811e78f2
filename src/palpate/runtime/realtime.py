"""What this machine allows a real-time process, and what to do about each miss; for `palpate doctor`."""

from __future__ import annotations

import os
import platform
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from palpate.runtime.shared import now

__all__ = ["Check", "survey"]


@dataclass(frozen=True)
class Check:
    """One finding.

    Attributes
    ----------
    name : str
    ok : bool
    detail : str
        What was found.
    remedy : str
        What to do about it; empty where all is well.
    """

    name: str
    ok: bool
    detail: str
    remedy: str = ""


def survey() -> tuple[Check, ...]:
    """Look at scheduling, wake-up accuracy, CPUs, governor and kernel; changes nothing, takes 50 ms."""
    return (_scheduling(), _wake_up(), _processors(), _governor(), _kernel())


def _scheduling() -> Check:
    name = "real-time scheduling"
    if sys.platform != "linux":
        return Check(
            name, ok=False, detail=f"not used on {platform.system()}", remedy="Use Linux for hardware."
        )
    granted: list[bool] = []
    # a thread of its own: on Linux the policy is the calling thread's, and ends with it
    thread = threading.Thread(target=lambda: granted.append(_may_use_fifo()))
    thread.start()
    thread.join()
    if granted == [True]:
        return Check(name, ok=True, detail="SCHED_FIFO is permitted")
    return Check(
        name,
        ok=False,
        detail="SCHED_FIFO is not permitted",
        remedy="Add '@users - rtprio 60' to /etc/security/limits.d/palpate.conf and log in again; in a "
        "container pass --cap-add SYS_NICE.",
    )


def _may_use_fifo() -> bool:
    if sys.platform != "linux":
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    return True


def _wake_up() -> Check:
    late = []
    for _ in range(25):
        began = now()
        time.sleep(0.001)
        late.append(now() - began - 0.001)
    median, worst = sorted(late)[len(late) // 2], max(late)
    return Check(
        "wake-up from sleep",
        ok=median < 200e-6,  # what the loop spins for
        detail=f"{1e6 * median:.0f} µs late at the median, {1e6 * worst:.0f} µs at worst of {len(late)}",
        remedy="" if median < 200e-6 else "Close other programs; the loop's spin can't cover this.",
    )


def _processors() -> Check:
    count = os.cpu_count() or 1
    remedy = "" if count > 1 else "The loop needs a CPU of its own: give the machine a second one."
    return Check("CPUs", ok=count > 1, detail=f"{count}", remedy=remedy)


def _governor() -> Check:
    text = _read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
    if text is None:
        return Check("CPU governor", ok=True, detail="not readable here")
    slow = text == "powersave"
    remedy = "cpupower frequency-set -g performance" if slow else ""
    return Check("CPU governor", ok=not slow, detail=text, remedy=remedy)


def _kernel() -> Check:
    realtime = _read("/sys/kernel/realtime") == "1"
    detail = f"{platform.system()} {platform.release()}" + (", PREEMPT_RT" if realtime else "")
    return Check("kernel", ok=True, detail=detail)


def _read(path: str) -> str | None:
    try:
        return Path(path).read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return None
