"""Files and folders that are written whole or not at all, temporary folders, and errors of the system in sentences.

::

    writing          yields a path beside the file; what is written there takes its place at once, or never
    write_file       the same for bytes or a text
    writing_folder   the same for a folder, such as a Zarr store
    restore_folder   takes back a folder that a killed process had moved aside
    TemporaryFolder  a folder for scratch files; those of processes that were killed are removed by the next one
    system_errors    turns errors of the operating system into palpate's own
"""

from __future__ import annotations

import contextlib
import errno
import glob
import os
import shutil
import tempfile
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from palpate.errors import PalpateError, ResourceError, UsageError

__all__ = [
    "TemporaryFolder",
    "explain_system_error",
    "require_regular",
    "restore_folder",
    "system_errors",
    "write_file",
    "writing",
    "writing_folder",
]

_PREFIX, _LOCK = "palpate-", "in-use" if os.name != "nt" else "lock"
_SYNCHRONISED_AT_ONCE = 16  # files: a disk takes many in little more than the time of one
# pattern of the marks of unfinished files; s after which nobody writes them
_MARK, _ABANDONED = "?" * 8, 3600.0
_HALF_DONE = 0.2  # s between the two renames that replace a folder, at most
_WRONG_PATH = {
    errno.ENOENT,
    errno.EEXIST,
    errno.ENOTDIR,
    errno.EISDIR,
    errno.ENAMETOOLONG,
    errno.EINVAL,
    errno.ELOOP,
}
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_FORBIDDEN = {errno.EACCES, errno.EPERM, errno.EROFS}


@contextlib.contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a path beside `path` for a file that takes its place when it is whole; else nothing changes."""
    target = Path(path)
    # its ending stays: it tells some writers the format
    part = target.with_name(f".{target.stem}.{uuid.uuid4().hex[:8]}.part{target.suffix}")
    _remove_abandoned_parts(
        target.parent, f".{glob.escape(target.stem)}.{_MARK}.part{glob.escape(target.suffix)}"
    )
    with system_errors(f"Could not write {target}."):
        try:
            if target.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
            require_regular(target)
            yield part
            _synchronise(part)
            os.replace(part, target)
            _synchronise(target.parent)
        finally:
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)


def write_file(path: str | os.PathLike[str], content: bytes | str) -> Path:
    """Write a file of these bytes, or of this text in UTF-8, whole or not at all."""
    with writing(path) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
    return Path(path)


def require_regular(path: Path) -> None:
    """Refuse to put a file in the place of a device, a pipe or a socket; what is no longer there is no fault."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise UsageError(
            f"{path} is a device, a pipe or a socket.",
            why="A file would take its place.",
            fix="Name a file.",
        )


@contextlib.contextmanager
def writing_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a path beside `path` for a folder that takes its place when it is whole; else nothing changes.

    A folder that is there already is replaced.
    """
    target = Path(path)
    mark = uuid.uuid4().hex[:8]
    part, old = (target.with_name(f".{target.name}.{mark}.{end}") for end in ("part", "old"))
    _remove_abandoned_parts(target.parent, f".{glob.escape(target.name)}.{_MARK}.part")
    restore_folder(target)
    with system_errors(f"Could not write {target}."):
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            yield part
            from concurrent.futures import ThreadPoolExecutor

            with ThreadPoolExecutor(_SYNCHRONISED_AT_ONCE) as pool:
                list(pool.map(_synchronise, part.rglob("*")))
            if target.exists():
                os.rename(target, old)
            os.replace(part, target)
            _synchronise(target.parent)
        finally:
            if old.exists() and not target.exists():
                os.replace(old, target)
            for leftover in (part, old):
                shutil.rmtree(leftover, ignore_errors=True)


def restore_folder(path: str | os.PathLike[str]) -> None:
    """Take back the folder that a killed process had moved aside to replace it, where nothing stands in its place.

    Where the new one stands there, the old one is removed.
    """
    target = Path(path)
    with contextlib.suppress(OSError):
        moved = sorted(
            target.parent.glob(f".{glob.escape(target.name)}.{_MARK}.old"),
            key=lambda old: old.stat().st_mtime,
        )
        for old in reversed(moved):  # the latest first
            if not target.exists() and time.time() - old.stat().st_ctime < _HALF_DONE:
                time.sleep(_HALF_DONE)  # its process may be about to bring the new one
            if not target.exists():
                os.rename(old, target)
            elif time.time() - old.stat().st_ctime > _ABANDONED:
                # a rename sets that time: a younger folder may be in use
                shutil.rmtree(old, ignore_errors=True)


def _remove_abandoned_parts(folder: Path, pattern: str) -> None:
    """Remove what a killed process was writing; what is young may be another one's that writes now."""
    with contextlib.suppress(OSError):
        for part in folder.glob(pattern):
            if time.time() - part.stat().st_mtime > _ABANDONED:
                shutil.rmtree(part, ignore_errors=True) if part.is_dir() else part.unlink()


def _synchronise(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk: a full one may tell only then."""
    if path.is_dir() and os.name == "nt":
        return  # folders can't be opened there
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some network disks can't
            raise
    finally:
        os.close(handle)


@contextlib.contextmanager
def system_errors(what: str) -> Iterator[None]:
    """Turn errors of the operating system, and want of memory, into palpate's own; `what` happened, as a sentence."""
    try:
        yield
    except PalpateError:
        raise
    except (OSError, MemoryError) as error:
        raise explain_system_error(what, error) from error


def explain_system_error(what: str, error: OSError | MemoryError) -> PalpateError:
    """Return the error of palpate's own that tells of an error of the system."""
    if isinstance(error, MemoryError):
        return ResourceError(
            what,
            why="This machine has no memory left for it.",
            fix="End other programs, use fewer workers or larger elements, or take a machine with more memory.",
        )
    code, said = error.errno, f"{error.strerror or error}".rstrip(".")
    place = str(error.filename or "")
    where = f": {place}" if place and not Path(place).name.startswith(".") else ""
    if code in _FULL:
        fix = "Make room, then give the same command again: what was finished is kept."
        return ResourceError(what, why=f"The disk is full ({said}){where}.", fix=fix)
    if code in _FORBIDDEN:
        fix = "Choose a folder that you may write to, or change its permissions."
        return ResourceError(what, why=f"The place is write-protected ({said}){where}.", fix=fix)
    if code == errno.ENOMEM:
        return explain_system_error(what, MemoryError())
    if code in _WRONG_PATH:
        return UsageError(what, why=f"{said}{where}.", fix="Name a file in a folder that exists.")
    return ResourceError(what, why=f"{said}{where}.", fix="Check the disk and its connection, and try again.")


class TemporaryFolder:
    """A folder for scratch files, whose owner holds a lock in it; a context manager that yields its path.

    A process that is killed leaves its folder behind. The lock is gone with it, and the next one that makes a folder
    removes those without.
    """

    def __init__(self) -> None:
        with system_errors("A folder for temporary files could not be made."):
            base = Path(tempfile.gettempdir())
            _remove_stale(base)
            self.path = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=base))
            self._lock: Any = (self.path / "lock").open("wb")
            _try_to_lock(self._lock)
            if os.name != "nt":  # which renames no open file, and needs no lock beside its being open
                os.rename(self.path / "lock", self.path / _LOCK)  # others see it when it is locked

    def remove(self) -> None:
        """Remove the folder and all in it; removing it again does nothing."""
        self._lock.close()
        shutil.rmtree(self.path, ignore_errors=True)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.remove()


def _remove_stale(base: Path) -> None:
    for lock in base.glob(f"{_PREFIX}*/{_LOCK}"):
        try:
            with lock.open("r+b") as file:
                stale = _try_to_lock(file)
            if os.name == "nt":  # where a file that is open can't be removed
                lock.unlink()
        except OSError:  # another user's, or just removed
            continue
        if stale:
            shutil.rmtree(lock.parent, ignore_errors=True)


def _try_to_lock(file: Any) -> bool:
    """Lock an open file for as long as it is open; False where another process has locked it."""
    try:
        import fcntl
    except ImportError:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
