"""Work in a child process that may crash or hang: it costs an error there, and nothing here.

A `Child` answers calls one after the other and keeps its state in between, like this process would. Where a call
ends it, or takes longer than its limit, `ChildEnded` says how, with the traceback of the moment: libraries in C may
end their process without an exception that Python could catch. The next call starts a new one.

The child's side is `palpate.supervised_child`.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any, TypeVar

from palpate.errors import FileFormatError, PalpateError, SolverError
from palpate.files import TemporaryFolder
from palpate.input_files import require_input
from palpate.processes import helper_environment, is_supervised, kill_group

__all__ = [
    "Child",
    "ChildEnded",
    "RemoteTraceback",
    "read_frame",
    "read_in_child",
    "run_in_child",
    "write_frame",
]

START = 60.0  # s in which a child has to be ready
GRACE = 5.0  # s after a call's limit in which the child ends by itself, with the traceback of the moment
_LOOK = 0.05  # s between looks at the memory of a child
_IDLE = 10.0  # s without a call after which a shared child is ended
READER = "read_requests"  # the function of a child's second thread, whose place is of no interest
_OWN_FRAMES = ("supervised_child.py", "<frozen runpy>")  # files of the frames below those of the work
_READ_SECONDS, _READ_RATE = 40.0, 5e5  # s that reading any file may take; bytes for each s more
# bytes that reading may take; more for each byte of a file, packed ones too
_READ_MEMORY, _READ_GROWTH = 1.5e9, 50.0
_HEAD = struct.Struct(">Q")
_DETAILS = 4000  # characters of the child's last words that are kept

Result = TypeVar("Result")


def _folder() -> str | None:
    """Return the working directory; nothing where it has been removed."""
    try:
        return os.getcwd()
    except FileNotFoundError:
        return None


class ChildEnded(SolverError):
    """A child process was ended by what it was asked to do."""

    overdue = False  # whether it was ended because the call took longer than its limit
    reason = ""  # the end in words: a signal, an exit code, a limit
    details = ""  # what the process wrote last, with the traceback of the moment where there is one


class RemoteTraceback(Exception):
    """The traceback of an exception in a child process, as text; the cause of the exception here."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


class Child:
    """A process beside this one that works for it, one call at a time.

    It is started by the first call, and ends with `close`, with this process, or when nobody refers to it.
    """

    def __init__(self) -> None:
        self._running: _Running | None = None
        self._lock = threading.Lock()

    @property
    def pid(self) -> int | None:
        """Process id; None while no process runs."""
        return None if self._running is None else self._running.process.pid

    def start(self) -> None:
        """Start the process now, so that the first call need not wait for it."""
        with self._lock:
            self._started()

    def call(
        self, function: Callable[..., Result], *arguments: Any, limit: float, memory: float = math.inf
    ) -> Result:
        """Call a function at the top of a module, with arguments that can be pickled, in the child.

        Relative paths start from this process's working directory. A call that takes longer than `limit` seconds, or
        more than `memory` bytes, ends the child: `ChildEnded`. What the function raises is raised here, caused by a
        `RemoteTraceback`.
        """
        import cloudpickle

        # functions of a script or a notebook cell, which no module holds, go along
        request = cloudpickle.dumps((limit, _folder(), function, arguments))
        with self._lock:
            running = self._started()
            try:
                good, answer = running.ask(request, limit, memory)
            except BaseException:  # an interruption too: nobody would take the answer any more
                self.close()
                raise
        if good:
            result: Result = answer
            return result
        error, trace = answer
        # an error of palpate's own says all in its words
        raise error from (None if isinstance(error, PalpateError) else RemoteTraceback(trace))

    def close_if_idle(self) -> None:
        """End the process unless it is at work."""
        if self._lock.acquire(blocking=False):
            try:
                self.close()
            finally:
                self._lock.release()

    def close(self) -> None:
        """End the process and remove its files; closing again does nothing."""
        running, self._running = self._running, None
        if running is not None:
            running.end()

    def _started(self) -> _Running:
        if self._running is None or self._running.process.poll() is not None:
            self.close()
            self._running = _Running()
        return self._running


class _Running:
    """One process of a child, with its scratch folder and the answers that it sent."""

    def __init__(self) -> None:
        self.folder = TemporaryFolder()
        # appended to, so that it can be emptied from here
        self._log = (self.folder.path / "child.log").open("ab")
        self.process = subprocess.Popen(
            [sys.executable, "-m", "palpate.supervised_child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            # what a crash leaves in the folder for temporary files goes with ours
            env=helper_environment(scratch=self.folder.path),
            # a group of its own: it is ended with all that it started
            start_new_session=True,
        )
        self._answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        assert self.process.stdin
        assert self.process.stdout
        self._stdin, self._ready = self.process.stdin, False
        threading.Thread(target=_receive, args=(self.process.stdout, self._answers), daemon=True).start()
        self.end = weakref.finalize(self, _end, self.process, self._log, self.folder)

    def ask(self, request: bytes, limit: float, memory: float) -> tuple[bool, Any]:
        """Return True and the result of a call, or False and its exception with the traceback."""
        if not self._ready:  # its imports are no part of the call
            self._ready = True
            self._answer(START, math.inf)
        self._log.truncate(0)
        with contextlib.suppress(OSError):  # it is gone, and its input with it: the answers end
            write_frame(self._stdin, request)
        good, result = pickle.loads(self._answer(limit, memory))
        return good, result

    def _answer(self, limit: float, memory: float) -> bytes:
        began, late = time.monotonic(), f"it took longer than {limit:g} s"
        while True:
            rest = began + limit + GRACE - time.monotonic()
            try:
                answer = self._answers.get(timeout=max(rest if memory == math.inf else min(rest, _LOOK), 0.0))
                break
            except queue.Empty:
                if rest <= 0:
                    raise self._ended(late, overdue=True) from None
                if self._memory() > memory:
                    raise self._ended(f"it took more than {memory / 1e9:.2g} GB of memory") from None
        if answer is None:
            code = self.process.wait()
            overdue = time.monotonic() - began >= limit
            raise self._ended(late if overdue else _describe_exit(code), overdue=overdue)
        return answer

    def _memory(self) -> float:
        """Return the number of bytes of memory that the process has in use."""
        import psutil

        try:
            return float(psutil.Process(self.process.pid).memory_info().rss)
        except psutil.Error:  # it has just ended
            return 0.0

    def _ended(self, reason: str, *, overdue: bool = False) -> ChildEnded:
        details = self._last_words()
        error = ChildEnded(f"A process that worked for this one was ended: {reason}.", why=details)
        error.overdue, error.reason, error.details = overdue, reason, details
        return error

    def _last_words(self) -> str:
        text = Path(self._log.name).read_text(encoding="utf-8", errors="replace").strip()
        for mark in ("Fatal Python error", "Windows fatal exception", "Timeout ("):
            if (place := text.rfind(mark)) >= 0:
                threads = [t for t in text[place:].split("\n\n") if READER not in t]
                lines = "\n".join(threads).splitlines()
                text = "\n".join(line for line in lines if not any(own in line for own in _OWN_FRAMES))
                return text[:_DETAILS]
        return text[-_DETAILS:]


def _end(process: subprocess.Popen[bytes], log: IO[bytes], folder: TemporaryFolder) -> None:
    kill_group(process)
    for pipe in (process.stdin, process.stdout, log):
        with contextlib.suppress(OSError):
            if pipe is not None:
                pipe.close()
    folder.remove()


def _receive(pipe: IO[bytes], answers: queue.SimpleQueue[bytes | None]) -> None:
    with contextlib.suppress(OSError, ValueError):  # closed here
        while (frame := read_frame(pipe)) is not None:
            answers.put(frame)
    answers.put(None)


def write_frame(pipe: IO[bytes], content: bytes) -> None:
    """Write one message: its length, then its bytes."""
    pipe.write(_HEAD.pack(len(content)))
    pipe.write(content)
    pipe.flush()


def read_frame(pipe: IO[bytes]) -> bytes | None:
    """Read one message; None at the end of the input."""
    head = pipe.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    (size,) = _HEAD.unpack(head)
    content = pipe.read(size)
    return content if len(content) == size else None


def _describe_exit(code: int) -> str:
    if code >= 0:
        shown = f"0x{code:X}" if code > 255 else str(code)  # Windows' own codes are read in hexadecimal
        return f"its process ended with exit code {shown}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    memory = ", which a system sends that has no memory left" if name == "SIGKILL" else ""
    return f"its process was ended by {name}{memory}"


def run_in_child(
    function: Callable[..., Result], *arguments: Any, limit: float, memory: float = math.inf
) -> Result:
    """Call a function in a child process, or here where this process is a child already.

    The parameters and exceptions are those of `Child.call`.
    """
    if is_supervised():
        return function(*arguments)
    return _shared.call(function, *arguments, limit=limit, memory=memory)


def read_in_child(function: Callable[..., Result], path: Path, *arguments: Any) -> Result:
    """Return what a reader in C or C++ makes of a file or folder in a child process: a damaged file may crash it.

    Time and memory that it may take grow with the file's size. The reader is defined at the top of a module; it takes
    the path and the arguments.
    """
    parts = [part for part in path.iterdir() if not part.is_dir()] if path.is_dir() else [path]
    for part in parts:
        require_input(part)
    size = sum(part.stat().st_size for part in parts)
    limit, memory = _READ_SECONDS + size / _READ_RATE, _READ_MEMORY + _READ_GROWTH * size
    try:
        return run_in_child(function, path, *arguments, limit=limit, memory=memory)
    except ChildEnded as error:
        raise FileFormatError(
            f"{path} can't be read.",
            why=f"Its reader was ended: {error.reason}. The file is damaged, or not what it says it is.",
            fix="Open it in the program that made it and export it again.",
        ) from error


class _SharedChild:
    """A child for calls without a child of their own; it ends when nobody has called for a while."""

    def __init__(self) -> None:
        self._child, self._timer = Child(), threading.Timer(0.0, _nothing)

    def call(self, function: Callable[..., Result], *arguments: Any, limit: float, memory: float) -> Result:
        self._timer.cancel()
        try:
            return self._child.call(function, *arguments, limit=limit, memory=memory)
        finally:
            self._timer = threading.Timer(_IDLE, self._child.close_if_idle)
            self._timer.daemon = True
            self._timer.start()


def _nothing() -> None:
    """Do nothing: the timer before the first call."""


_shared = _SharedChild()
