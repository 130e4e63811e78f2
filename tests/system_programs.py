"""System programs that some tests need."""

from __future__ import annotations

import os
import shutil

import pytest


def require_program(*names: str) -> str:
    """Path of the first system program found; skips by name where none is, fails where CI promised it."""
    for name in names:
        if path := shutil.which(name):
            return path
    message = f"needs the system program {' or '.join(names)}"
    if os.environ.get("PALPATE_CI"):
        pytest.fail(message + ", which .ci/run installs")
    pytest.skip(message)
