"""Memory that processes share under a name: a mapped file, in RAM where the system has ``/dev/shm``.

A plain mapped file and not `multiprocessing.shared_memory`: that one starts a tracker process, and before
Python 3.13 every process that merely attached removed the block when it ended.

A `Block` is a record in shared bytes with one writer, any number of readers, and nobody who waits. The writer makes
a counter odd, copies, makes it even; a reader who sees an odd or a changed counter tries again (Boehm 2012, "Can
seqlocks get along with programming language memory models?"). Processors with weakly ordered memory may still reorder
the copies and Python has no fence, so the block also carries a checksum: a torn record never leaves `Block.fetch`.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import tempfile
import zlib
from pathlib import Path

import numpy as np

from palpate.errors import DeviceError

__all__ = [
    "Block",
    "attach",
    "attach_to",
    "create",
    "create_for",
    "folder",
    "remove",
]

_RAM = Path("/dev/shm")


def folder() -> Path:
    """The folder in which the files are made."""
    return _RAM if os.access(_RAM, os.W_OK) else Path(tempfile.gettempdir())


def create(head: bytes, size: int) -> str:
    """Make a file of `size` bytes that begins with `head`, readable by its owner alone; its path is its name.

    An OSError says that there is no room for it.
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


def attach(name: str, head: bytes, size: int = 0) -> mmap.mmap:
    """Map the file of that name, which begins with `head` and, unless 0, is `size` bytes long.

    An OSError says that there is none, a ValueError that it is empty or something else.
    """
    with Path(name).open("r+b") as file:
        memory = mmap.mmap(file.fileno(), 0)
    if memory[: len(head)] != head or (size and len(memory) != size):
        memory.close()
        raise ValueError("Another program or another version of palpate made it.")
    return memory


def create_for(what: str, head: bytes, size: int) -> str:
    """Make a file as `create` does; a system that gives no room is a DeviceError that says for what."""
    try:
        return create(head, size)
    except OSError as error:
        raise DeviceError(
            f"No shared memory for {what}.", why=str(error), fix=f"Free some space in {folder()}."
        ) from error


def attach_to(what: str, name: str, head: bytes, size: int = 0) -> mmap.mmap:
    """Map a file as `attach` does; one that isn't there, or is something else, is a DeviceError that says what."""
    try:
        return attach(name, head, size)
    except (OSError, ValueError) as error:
        raise DeviceError(
            f"There is no {what} named {name!r}.",
            why=str(error),
            fix="Its owner has ended, or is of another installation; start again.",
        ) from error


def remove(name: str) -> None:
    """Take the name away; who has attached keeps the memory. Harmless when repeated."""
    with contextlib.suppress(PermissionError):  # Windows removes only what nobody maps: the last to go does
        Path(name).unlink(missing_ok=True)


class Block:
    """One record in shared bytes: a single writer publishes, readers fetch, nobody waits.

    `record` (shape ()) and the views taken of it are this side's private copy: the writer fills it and calls
    `publish`; a reader calls `fetch` and finds it renewed. Of a record that is seldom full only the beginning
    need travel.
    """

    HEADER = 16

    def __init__(self, memory: memoryview, dtype: np.dtype[np.void]) -> None:
        self._sequence = np.ndarray((), np.int64, memory, 0)
        self._checksum = np.ndarray((), np.uint32, memory, 8)
        self._size = np.ndarray((), np.uint32, memory, 12)
        self._shared = np.ndarray(dtype.itemsize, np.uint8, memory, self.HEADER)
        self._private = np.zeros(dtype.itemsize, np.uint8)
        self._scratch = np.zeros(dtype.itemsize, np.uint8)
        self._fetched = -1
        self.record = self._private.view(dtype).reshape(())

    def publish(self, size: int | None = None) -> None:
        """Copy the private record, or its first `size` bytes, out: a few µs, never blocks."""
        size = self._private.size if size is None else size
        sequence = int(self._sequence) | 1  # odd also where the writer before us died while writing
        self._sequence[()] = sequence
        self._shared[:size] = self._private[:size]
        self._size[()] = size
        self._checksum[()] = zlib.crc32(self._private.data[:size])
        self._sequence[()] = sequence + 1

    def fetch(self) -> bool:
        """Renew the private record; False, and no change, if a write was under way."""
        sequence = int(self._sequence)
        if sequence & 1:
            return False
        if sequence == self._fetched:
            return True
        size = min(int(self._size), self._private.size)
        self._scratch[:size] = self._shared[:size]
        if int(self._sequence) != sequence or zlib.crc32(self._scratch.data[:size]) != int(self._checksum):
            return False
        self._private[:size] = self._scratch[:size]
        self._fetched = sequence
        return True

    def release(self) -> None:
        """Let go of the shared bytes, so that the map can be closed; the private record stays."""
        size = self._private.size
        self._sequence = np.zeros((), np.int64)
        self._checksum, self._size = np.zeros((), np.uint32), np.zeros((), np.uint32)
        self._shared = np.zeros(size, np.uint8)
