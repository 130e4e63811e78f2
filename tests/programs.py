"""Programs that stand in the documentation, run as a user runs them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def run_program(text: str, folder: Path, timeout: float, *, site: Path | None = None) -> str:
    """What a program prints, run as a file in a folder; `site` holds modules that come before the installed ones.

    Fails with the end of its errors where it does not end well; `timeout` is in s.
    """
    (folder / "program.py").write_text(text, encoding="utf-8")
    places = [str(site)] if site else []
    path = os.pathsep.join([*places, *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "program.py"],
        check=False,
        cwd=folder,
        capture_output=True,
        text=True,
        encoding="utf-8",
        env=os.environ | {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8"},
        stdin=subprocess.DEVNULL,
        timeout=timeout,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout
