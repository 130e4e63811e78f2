"""Independent pieces of work carried out by several processes, with the same results as by one.

The processes are loky's: they import nothing of the caller's script, which therefore needs no
``if __name__ == "__main__"``, and may be a notebook or come from standard input. They are started once the work has
proven to be worth it, are kept for the next piece of work, and end when they are idle or when the process that started
them ends.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from palpate.errors import ResourceError, UsageError
from palpate.processes import available_cores, helper_environment

__all__ = ["Pool"]

logger = logging.getLogger("palpate.learning")

_ALONE = 3.0  # s of work before other processes are started; each takes about two to start
_MOST = 8  # processes by default: each imports palpate and holds a copy of the samples
_IDLE = 10.0  # s after which a process that has nothing to do ends
_LOOK = 0.5  # s between two looks at whether the first process still lives

T = TypeVar("T")
R = TypeVar("R")


class Pool:
    """Processes that carry out independent pieces of work.

    By default there is one for each core, at most eight, and they are started after three seconds of work: less is
    sooner done by this process alone.
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and workers < 1:
            raise UsageError(f"workers={workers} can't learn.", fix="Give one at least, or leave it out.")
        self._lazy = workers is None
        self._workers = min(available_cores(), _MOST) if workers is None else workers
        if multiprocessing.current_process().daemon or not sys.executable:
            self._workers = 1  # such a process can't have others
        self._spent = 0.0

    def map(self, work: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """Return the result of `work` for each item, in their order.

        The work is a function of a module or a method of a value that can be pickled, and changes nothing. A process
        that ends before it has answered is a `ResourceError`.
        """
        results: list[R] = []
        while len(results) < len(items) and self._alone(len(items) - len(results)):
            began = time.monotonic()
            # as another process would have it: an array that is a part of another one is added up in another order
            called, item = _copied((work, items[len(results)]))
            results.append(_copied(called(item)))
            self._spent += time.monotonic() - began
        rest = items[len(results) :]
        return results + (self._shared(work, rest) if rest else [])

    def _alone(self, items: int) -> bool:
        return self._workers == 1 or items == 1 or (self._lazy and self._spent < _ALONE)

    def _shared(self, work: Callable[[T], R], items: Sequence[T]) -> list[R]:
        from loky import get_reusable_executor
        from loky.process_executor import BrokenProcessPool

        executor: Any = None
        try:
            executor = get_reusable_executor(
                self._workers,
                timeout=_IDLE,
                env=helper_environment(),
                initializer=_begin,
                initargs=(os.getpid(),),
            )
            # no `executor.map`: interrupted, it cancels what waits, and the thread that then ends loky's processes
            # fails at work that is cancelled already, with a traceback
            return [future.result() for future in [executor.submit(work, item) for item in items]]
        except BrokenProcessPool as error:
            raise ResourceError(
                f"One of the {self._workers} processes that learn was ended before it had answered.",
                why="It was killed: by hand, or by the system because memory ran out.",
                fix="Learn with workers=1, which needs least memory and finds the same result, or on fewer solves.",
            ) from error
        except OSError as error:  # too many processes, or too little memory
            logger.warning("No further process could be started: %s. One process learns alone.", error)
            self._workers = 1
            return self.map(work, items)
        except BaseException:  # Ctrl-C, or an error of the work: nobody waits for the others any more
            if executor is not None:
                executor.shutdown(wait=False, kill_workers=True)
            raise


def _copied(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


def _begin(parent: int) -> None:
    """Prepare a process of the pool: one thread of linear algebra; Ctrl-C is for its parent, with which it ends."""
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    import psutil

    while psutil.pid_exists(parent) and (os.name == "nt" or os.getppid() == parent):
        time.sleep(_LOOK)
    os._exit(1)
