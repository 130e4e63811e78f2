"""`palpate doctor`: findings about this machine, a timing test of the loop, and advice for what is missing."""

from __future__ import annotations

import importlib.metadata
import platform
import shutil
import sys
from collections.abc import Iterator, Sequence
from typing import Any

from palpate.cli.console import Console
from palpate.cli.device_commands import findings_in_words
from palpate.devices.device_search import search
from palpate.errors import DeviceError
from palpate.runtime.machine import Check, survey
from palpate.runtime.timing_test import judge_timing, run_timing_test

__all__ = ["report"]

_RATE = 1000.0  # Hz, that of haptic devices
_PROGRAMS = {
    "chromium": ("the page's tests", ("chromium", "chromium-browser", "google-chrome", "chrome")),
}
_PACKAGES = {"NumPy": "numpy", "Numba": "numba", "NGSolve": "ngsolve"}


def report(console: Console, seconds: float = 10.0) -> None:
    """Print every finding; a miss that palpate can live without is no failure.

    The timing test takes `seconds`; 0 leaves it out.
    """
    machine = survey()  # before the test, which is itself a load
    checks = [*_software(), *machine, *_optional()]
    devices = search()
    timing = _timing(seconds, machine, console) if seconds > 0.0 else {}
    lines = ["software and machine", *_lines(checks), "", "devices", findings_in_words(devices)]
    if timing:
        lines += ["", "timing of the loop", *_timing_lines(timing)]
    content = {
        "checks": [vars(c) | ({"remedy": ""} if c.ok else {}) for c in checks],
        "devices": [vars(f) for f in devices],
        "timing": timing or None,
    }
    console.result("\n".join(lines), content)


def _lines(checks: Sequence[Check]) -> Iterator[str]:
    for c in checks:
        yield f"{'✓' if c.ok else '·'} {c.name:24} {c.detail}"
        if not c.ok and c.remedy:
            yield f"  {'':24} → {c.remedy}"


def _timing(seconds: float, machine: Sequence[Check], console: Console) -> dict[str, Any]:
    """Return verdict and figures of the timing test; a test that fails is a finding and ends nothing."""
    console.say(f"Timing test of the loop: {seconds:g} s at {_RATE:g} Hz; leave the machine alone.")
    try:
        measured = run_timing_test(seconds, _RATE)
    except DeviceError as error:
        return {"grade": None, "sentence": error.what, "reasons": [error.why, error.fix], "seconds": seconds}
    verdict = judge_timing(measured, seconds, _RATE, machine)
    return {**vars(verdict), "seconds": seconds, "rate_wanted": _RATE, "report": measured.as_dict()}


def _timing_lines(timing: dict[str, Any]) -> Iterator[str]:
    yield f"{'✓' if timing['grade'] == 'good' else '·'} {timing['sentence']}"
    if figures := timing.get("report"):
        late = (figures[f"lateness_{share}"] for share in ("p50", "p99", "p999", "max"))
        yield f"  {figures['ticks']} ticks, {100 * timing['missed']:.2g} % missed"
        yield f"  late {' / '.join(f'{1e6 * t:.0f}' for t in late)} µs (median / p99 / p99.9 / max)"
        yield f"  CPU  {1e6 * figures['work_p50']:.0f} / {1e6 * figures['work_p99']:.0f} µs a tick (median / p99)"
        yield f"  {', '.join(f'{key} {value}' for key, value in figures['obtained'].items())}"
    for reason in filter(None, timing["reasons"]):
        yield f"  → {reason}"


def _software() -> Iterator[Check]:
    from palpate.version import __version__

    yield Check("palpate", ok=True, detail=__version__)
    version = platform.python_version()
    yield Check(
        "Python", ok=sys.version_info >= (3, 11), detail=version, remedy="Install Python 3.11 or later."
    )
    for name, distribution in _PACKAGES.items():
        yield _package(name, distribution, f"pip install {distribution}")
    yield _blas()


def _package(name: str, distribution: str, remedy: str) -> Check:
    try:
        return Check(name, ok=True, detail=importlib.metadata.version(distribution))
    except importlib.metadata.PackageNotFoundError:
        return Check(name, ok=False, detail="not installed", remedy=remedy)


def _blas() -> Check:
    import numpy as np
    from threadpoolctl import threadpool_info

    np.ones((2, 2)) @ np.ones((2, 2))  # loads the library that will be asked about
    pools = [p for p in threadpool_info() if p["user_api"] == "blas"]
    detail = ", ".join(f"{p['internal_api']} {p['num_threads']}" for p in pools) or "none found"
    return Check("BLAS threads", ok=True, detail=f"{detail} (learning uses one: the matrices are small)")


def _optional() -> Iterator[Check]:
    for name, (purpose, programs) in _PROGRAMS.items():
        found = next(filter(None, map(shutil.which, programs)), None)
        remedy = f"Only {purpose} need it; install it with the system's package manager."
        yield Check(name, ok=found is not None, detail=found or "not found", remedy=remedy)
