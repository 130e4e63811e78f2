"""Where the figures come from: processor, system, Python and library versions, date."""

from __future__ import annotations

import datetime
import os
import platform
from importlib import metadata
from pathlib import Path

__all__ = ["gigabytes", "machine_line", "machine_record"]

_LIBRARIES = ("palpate", "ngsolve", "numpy", "scipy", "numba", "scikit-learn", "dask", "distributed")


def machine_record() -> dict[str, str]:
    """Each as text, in the order in which they are printed."""
    return {
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "processor": f"{_processor()}, {_cores()} core{'s' * (_cores() != 1)}",
        "load": _load(),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        **{name: _version(name) for name in _LIBRARIES},
        "BLAS threads": "1",
    }


def machine_line() -> str:
    """All of it as one line."""
    record = machine_record()
    rest = ", ".join(
        f"{k} {v}" for k, v in record.items() if k not in {"date", "processor", "system", "load"}
    )
    return f"{record['date']}; {record['processor']} ({record['load']}); {record['system']}; {rest}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _load() -> str:
    return f"load average {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "load not known"


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        if name == "palpate":
            import palpate

            return palpate.__version__
        return "not installed"


def gigabytes(name: str) -> float:
    """A figure of this process' memory by Linux's name for it, GB."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next((float(line.split()[1]) / 1e6 for line in lines if line.startswith(f"{name}:")), 0.0)
