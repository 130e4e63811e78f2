"""The child of `palpate.supervised`: ``python -m palpate.supervised_child``, which does what it is asked.

Requests come on standard input and answers go to standard output; whatever else writes there goes to standard
error, which is a file. When the input closes, the process that started this one is gone, and this one ends with all
that it started itself. A watchdog in C ends it when a call takes longer than its limit, also where no line of Python
runs any more; it and crashes leave the traceback of the moment on standard error.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import pickle
import queue
import signal
import threading
import traceback
from typing import IO, Any

from palpate.processes import become_supervised, end_group
from palpate.supervised import READER, read_frame, write_frame

__all__ = ["main", "read_requests"]


def read_requests(pipe: IO[bytes], requests: queue.SimpleQueue[bytes]) -> None:
    """Collect requests while they come, also in the midst of a call; then end this process."""
    while (frame := read_frame(pipe)) is not None:
        requests.put(frame)
    end_group()


assert read_requests.__name__ == READER


def main() -> None:
    """Answer requests until the input closes."""
    pipes = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)  # what the work prints is no answer
    _forbid_core_dumps()
    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started this one
    become_supervised()
    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=read_requests, args=(pipes[0], requests), daemon=True).start()
    write_frame(pipes[1], b"ready")
    while True:
        write_frame(pipes[1], _answer(requests.get()))


def _forbid_core_dumps() -> None:
    """Let a crash write no image of the memory, which takes seconds and the room of the whole process."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def _answer(request: bytes) -> bytes:
    """Return the pickled answer: True and the result, or False and the exception with its traceback."""
    try:
        limit, folder, function, arguments = pickle.loads(request)
        if folder is not None and os.path.isdir(folder):
            os.chdir(folder)  # the caller may have moved since the child was started
        faulthandler.dump_traceback_later(limit, exit=True)
        try:
            result = function(*arguments)
        finally:
            faulthandler.cancel_dump_traceback_later()
        return pickle.dumps((True, result), protocol=pickle.HIGHEST_PROTOCOL)
    except BaseException as error:  # noqa: BLE001 - whatever it is, it is the caller's to judge
        return _failure(error)


def _failure(error: BaseException) -> bytes:
    trace = "".join(traceback.format_exception(error)).rstrip()
    try:
        content = pickle.dumps((False, (error, trace)))
        pickle.loads(content)  # some exceptions go in and don't come out
    except Exception:  # noqa: BLE001 - a foreign exception's own methods run here
        words: Any = RuntimeError(f"{type(error).__name__}: {error}")
        content = pickle.dumps((False, (words, trace)))
    return content


if __name__ == "__main__":
    main()
