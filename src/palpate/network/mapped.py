"""Memory that processes share under a name: a mapped file, in RAM where the system has ``/dev/shm``.

A plain mapped file and not `multiprocessing.shared_memory`: that one starts a tracker process, and before
Python 3.13 every process that merely attached removed the block when it ended.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import tempfile
from pathlib import Path

__all__ = ["attach", "create", "folder", "remove"]

_RAM = Path("/dev/shm")


def folder() -> Path:
    """Where the files are made."""
    return _RAM if os.access(_RAM, os.W_OK) else Path(tempfile.gettempdir())


def create(head: bytes, size: int) -> str:
    """Make a file of `size` bytes that begins with `head`, readable by its owner alone; its path is its name.

    Raises
    ------
    OSError
        If there is no room for it.
    """
    handle, name = tempfile.mkstemp(prefix="palpate-", suffix=".shm", dir=folder())
    try:
        with os.fdopen(handle, "r+b") as file:
            # every byte is written: room that is only promised ends a process that touches it
            file.write(head.ljust(size, b"\0"))
    except OSError:
        remove(name)
        raise
    return name


def attach(name: str) -> mmap.mmap:
    """Map the file of that name.

    Raises
    ------
    OSError, ValueError
        If there is none, or nothing in it.
    """
    with Path(name).open("r+b") as file:
        return mmap.mmap(file.fileno(), 0)


def remove(name: str) -> None:
    """Take the name away; who has attached keeps the memory. Harmless when repeated."""
    with contextlib.suppress(PermissionError):  # Windows removes only what nobody maps: the last to go does
        Path(name).unlink(missing_ok=True)
