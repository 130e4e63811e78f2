"""`palpate doctor`: findings about this machine, and advice for what is missing."""

from __future__ import annotations

import ctypes.util
import importlib.metadata
import platform
import shutil
import sys
from collections.abc import Iterator

from palpate.cli.console import Console
from palpate.runtime.realtime import Check, survey

__all__ = ["report"]

_PROGRAMS = {
    "chromium": ("the page's tests", ("chromium", "chromium-browser", "google-chrome", "chrome")),
}
_DEVICES = {
    "Force Dimension (libdhd)": ("dhd", "drd"),
    "OpenHaptics (libHD)": ("HD",),
}


def report(console: Console) -> None:
    """Print every finding; a miss that palpate can live without is no failure."""
    findings = [*_software(), *survey(), *_optional()]
    lines = []
    for c in findings:
        lines.append(f"{'✓' if c.ok else '·'} {c.name:24} {c.detail}")
        if not c.ok and c.remedy:
            lines.append(f"  {'':24} → {c.remedy}")
    console.result(
        "\n".join(lines), {"checks": [vars(c) | ({"remedy": ""} if c.ok else {}) for c in findings]}
    )


def _software() -> Iterator[Check]:
    version = platform.python_version()
    yield Check(
        "Python", ok=sys.version_info >= (3, 11), detail=version, remedy="Install Python 3.11 or later."
    )
    yield _package("NGSolve", "ngsolve", "pip install ngsolve")
    yield _package("Numba", "numba", "pip install numba")
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
    for name, libraries in _DEVICES.items():
        found = next(filter(None, map(ctypes.util.find_library, libraries)), None)
        remedy = "Nothing to do: this version has no driver for it yet; the page and scripted strokes are its devices."
        yield Check(name, ok=found is not None, detail=found or "library not found", remedy=remedy)
