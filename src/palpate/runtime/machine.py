"""A survey of the machine under a real-time loop, for `palpate doctor`: scheduling, CPUs, governor, container, load.

Everything is read below a root folder, so that a test can lay out a machine of its own; nothing is changed.
"""

from __future__ import annotations

import math
import os
import platform
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from palpate.runtime.shared_state import now

__all__ = ["Check", "survey"]

_ROOT = Path("/")
_SPUN = 200e-6  # s, which the loop spins for
_IDLE = 0.5  # load per CPU up to which the loop finds a CPU that nobody else wants


@dataclass(frozen=True)
class Check:
    """One finding."""

    name: str  # what was looked at
    ok: bool  # as a real-time loop wants it
    detail: str  # what was found
    remedy: str = ""  # what to do about it; empty where all is well


def survey(root: Path = _ROOT) -> tuple[Check, ...]:
    """Look at scheduling, wake-up accuracy, CPUs, governor, container, load and kernel; takes 50 ms.

    ``/proc`` and ``/sys`` are read below `root`.
    """
    checks = (_processors(), _governor(root), _container(root), _load(root), _kernel(root))
    return (_scheduling(), _wake_up(), *checks)


def _finding(name: str, ok: bool, detail: str, remedy: str = "") -> Check:
    """Return a finding, with what to do about it where it is not as a loop wants it."""
    return Check(name, ok=ok, detail=detail, remedy="" if ok else remedy)


def _scheduling() -> Check:
    name = "real-time scheduling"
    if sys.platform != "linux":
        return _finding(name, False, f"not used on {platform.system()}", "Use Linux for hardware.")
    granted: list[bool] = []
    # a thread of its own: on Linux the policy is the calling thread's, and ends with it
    thread = threading.Thread(target=lambda: granted.append(_may_use_fifo()))
    thread.start()
    thread.join()
    return _finding(
        name,
        granted == [True],
        f"SCHED_FIFO is {'' if granted == [True] else 'not '}permitted",
        "Add '@users - rtprio 60' to /etc/security/limits.d/palpate.conf and log in again; in a container pass "
        "--cap-add SYS_NICE.",
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
    detail = f"{1e6 * median:.0f} µs late at the median, {1e6 * worst:.0f} µs at worst of {len(late)}"
    remedy = "Close other programs; the loop's spin can't cover this."
    return _finding("wake-up from sleep", median < _SPUN, detail, remedy)


def _processors() -> Check:
    count = os.cpu_count() or 1
    return _finding(
        "CPUs", count > 1, f"{count}", "The loop needs a CPU of its own: give the machine a second one."
    )


def _governor(root: Path) -> Check:
    text = _read(root / "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
    if text is None:
        return _finding("CPU governor", True, "not readable here")
    return _finding("CPU governor", text != "powersave", text, "cpupower frequency-set -g performance")


def _container(root: Path) -> Check:
    """A container is no harm by itself; a limit on its CPU time stops the loop for tens of milliseconds."""
    quota, _, period = (_read(root / "sys/fs/cgroup/cpu.max") or "max").partition(" ")
    limit = math.inf
    if quota.isdecimal() and period.isdecimal() and int(period):
        limit = int(quota) / int(period)
    marks = [mark for mark in (".dockerenv", "run/.containerenv") if (root / mark).exists()]
    groups = _read(root / "proc/1/cgroup") or ""
    inside = bool(marks) or any(word in groups for word in ("docker", "kubepods", "libpod", "lxc"))
    detail = "yes" if inside else "none found"
    if limit < math.inf:
        detail += f", with a limit of {limit:.3g} CPUs"
    remedy = (
        "Lift the limit of CPU time (--cpus of Docker): once it is used up, every thread stops for a while."
    )
    return _finding("container", limit == math.inf, detail, remedy)


def _load(root: Path) -> Check:
    words = (_read(root / "proc/loadavg") or "").split()
    try:
        load = float(words[0])
    except (IndexError, ValueError):
        return _finding("load", True, "not readable here")
    share = load / (os.cpu_count() or 1)
    detail = f"{load:.1f} over the last minute, {share:.1f} per CPU"
    remedy = "Close other programs, or wait until they have ended, and look again."
    return _finding("load", share <= _IDLE, detail, remedy)


def _kernel(root: Path) -> Check:
    realtime = _read(root / "sys/kernel/realtime") == "1"
    detail = f"{platform.system()} {platform.release()}" + (", PREEMPT_RT" if realtime else "")
    return _finding("kernel", True, detail)


def _read(path: Path) -> str | None:
    try:
        return path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return None
