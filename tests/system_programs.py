"""System programs and packages of extras that some tests need."""

from __future__ import annotations

import importlib
import os
import shutil
from typing import Any, NoReturn

import pytest


def require_program(*names: str, path: str | None = None) -> str:
    """Path of the first system program found; skips by name where none is, fails where CI promised it.

    They are looked for in `path`, by default the user's own.
    """
    for name in names:
        if path := shutil.which(name, path=path):
            return path
    return _go_without(f"needs the system program {' or '.join(names)}")


def require_package(name: str, extra: str) -> Any:
    """The package of an extra, imported; skips by name where it is not installed, fails where CI promised it."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return _go_without(f"needs palpate[{extra}]")


def _go_without(message: str) -> NoReturn:
    if os.environ.get("PALPATE_CI"):
        pytest.fail(message + ", which .ci/run installs")
    pytest.skip(message)
