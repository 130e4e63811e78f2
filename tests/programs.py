"""Programs that stand in the documentation, run as a user runs them."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """Give programs that begin here one core, so that they start no workers: as many tests run as there are cores.

    That programs with workers need no guard is shown in `test_processes.py` and `test_pool.py`.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = sorted(os.sched_getaffinity(0))
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    os.sched_setaffinity(0, {cores[worker % len(cores)]})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def run_program(
    text: str, folder: Path, timeout: float, *, site: Path | None = None, alone: bool = True
) -> str:
    """What a program prints, run as a file in a folder; `site` holds modules that come before the installed ones.

    Fails with the end of its errors where it does not end well; `timeout` is in s. `alone` means on one core.
    """
    (folder / "program.py").write_text(text, encoding="utf-8")
    places = [str(site)] if site else []
    path = os.pathsep.join([*places, *filter(None, [os.environ.get("PYTHONPATH")])])
    return run_file(folder / "program.py", folder, timeout, alone=alone, PYTHONPATH=path)


def run_file(file: Path, folder: Path, timeout: float, *, alone: bool = True, **environment: str) -> str:
    """What a program in a file prints, run in a folder; see `run_program`."""
    with one_core() if alone else contextlib.nullcontext():
        done = subprocess.run(
            [sys.executable, str(file)],
            check=False,
            cwd=folder,
            capture_output=True,
            text=True,
            encoding="utf-8",
            env=os.environ | {"PYTHONIOENCODING": "utf-8"} | environment,
            stdin=subprocess.DEVNULL,
            timeout=timeout,
        )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout
