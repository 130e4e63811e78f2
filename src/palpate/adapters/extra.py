"""Packages that an adapter needs and palpate does not: imported when they are used, missed in words."""

from __future__ import annotations

import importlib
from typing import Any

from palpate.errors import UsageError

__all__ = ["import_extra"]


def import_extra(package: str, extra: str) -> Any:
    """Return a package that an extra of palpate installs, or say how to install it."""
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise UsageError(
            f"This adapter needs the package {package}, which can't be imported.",
            why=str(error),
            fix=f"Install it with palpate: pip install 'palpate[{extra}]'.",
        ) from error
