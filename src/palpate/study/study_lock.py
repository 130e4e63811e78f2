"""Lock of a study: one command at a time solves and learns into its files.

The lock is a file beside them, which the operating system frees when its process ends, however it ends. What the file
says, process and address of the page, is for the message of the next command; only its user can read it.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from palpate.errors import UsageError
from palpate.files import system_errors
from palpate.study.study_paths import Paths

__all__ = ["StudyLock", "hold_study", "work_on"]

_OWNER_ONLY = 0o600  # the address of a page has its token in it
_HELD = {
    errno.EWOULDBLOCK,
    errno.EACCES,
    errno.EDEADLK,
}  # of another process; other codes: a disk without locks
_FAR = 1 << 30  # byte that Windows locks, behind the text: a locked byte can't be read there


class StudyLock:
    """Lock that this process holds on a study."""

    def __init__(self, handle: int, work: str) -> None:
        self._handle = handle
        self._says = {"work": work, "process": os.getpid(), "address": ""}
        self.set_address("")

    def set_address(self, address: str) -> None:
        """Write the address of the page on which the study can be touched, "" for none, into the lock."""
        self._says["address"] = address
        os.ftruncate(self._handle, 0)
        os.lseek(self._handle, 0, os.SEEK_SET)
        os.write(self._handle, json.dumps(self._says).encode())


@contextlib.contextmanager
def hold_study(paths: Paths, work: str) -> Iterator[StudyLock]:
    """Hold the lock of a study while the context lasts; `work` names the command, such as "palpate sweep".

    Where another process holds it, a `UsageError` tells what that does and where its page is. The lock of a process
    that has ended, or that was killed, is taken over.
    """
    path = paths.lock
    with system_errors(f"Could not write {path}."):
        handle = _open_locked(path)
        if handle is None:
            raise _refusal(paths)
        own = StudyLock(handle, work)
    try:
        yield own
    finally:
        if os.name != "nt":  # where an open file can't be removed
            path.unlink(missing_ok=True)
        os.close(handle)
        if os.name == "nt":
            with contextlib.suppress(OSError):  # the next command has it open already
                path.unlink(missing_ok=True)


def work_on(paths: Paths) -> str:
    """Return which command works on a study, such as "palpate sweep, process 17"; "" for none.

    A lock that a killed command left behind counts for none.
    """
    says: dict[str, Any] = {}
    with contextlib.suppress(OSError, ValueError):
        says = json.loads(paths.lock.read_text(encoding="utf-8"))
    if not says or not _is_locked(paths.lock):
        return ""
    return f"{says['work']}, process {says['process']}"


def _is_locked(path: Path) -> bool:
    try:
        handle = os.open(path, os.O_RDWR)
    except FileNotFoundError:
        return False
    except PermissionError:  # another user's
        return True
    try:
        return not _lock(handle)
    finally:
        os.close(handle)


def _open_locked(path: Path) -> int | None:
    """Return the handle of the lock's file, which this process has locked; None where another one has."""
    while True:
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, _OWNER_ONLY)
        except PermissionError:
            if path.exists():  # another user's
                return None
            raise
        if not _lock(handle):
            os.close(handle)
            return None
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(handle), os.stat(path)):
                return handle
        os.close(handle)  # its process removed it between the two calls


def _lock(handle: int) -> bool:
    """Lock an open file until it is closed; return False where another process has locked it."""
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(handle, _FAR, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in _HELD
    return True


def _refusal(paths: Paths) -> UsageError:
    """Return the error that tells which command works on the study."""
    says: dict[str, Any] = {}
    with contextlib.suppress(OSError, ValueError):  # another user's, or being written
        says = json.loads(paths.lock.read_text(encoding="utf-8"))
    address, process = says.get("address", ""), says.get("process", 0)
    who = f"`{says['work']}`, process {process}" if says else "another command"
    ways = "Open that page" if address else "Wait until it has ended"
    return UsageError(
        f"palpate already works on {paths.name}{f', at {address}' if address else ''}.",
        why=f"It is {who}, which writes into the files of {paths.name} in {paths.folder.resolve()}.",
        fix=f"{ways}, or press Ctrl-C in its terminal and give this command again: it goes on with what is solved.",
    )
