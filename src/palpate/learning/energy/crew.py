"""A search in several processes at once, each with starts of its own, and the mean of what all of them judged best.

What a search finds depends on its starts, and it takes whatever time it is given: processes beside each other try as
many more of them in the same time. They are started as ``python -m palpate.learning.energy.searcher``, which imports
nothing of the caller's script, and end with the process that started them. Of one that dies only its networks are
missing.
"""

from __future__ import annotations

import contextlib
import logging
import pickle
import subprocess
import sys
import threading
import time
from types import TracebackType
from typing import Self

from palpate.errors import UsageError
from palpate.learning.energy.average import Average, average
from palpate.learning.energy.judging import restored
from palpate.learning.energy.search import EnergyTrial
from palpate.learning.energy.task import Answer, Task
from palpate.processes import available_cores, helper_environment

__all__ = ["processes_for", "sought"]

logger = logging.getLogger("palpate.learning")

_WORTH = 20.0  # s of learning; a process takes two to start
_MOST = 8  # processes: each holds a copy of the solves, and finds ten networks and more
_LATE = 30.0  # s; the last network may be judged after the time is over


def processes_for(seconds: float, wanted: int | None = None) -> int:
    """How many processes search: what is wanted, else one a core, and one alone where starting more is not worth it.

    Raises
    ------
    UsageError
        If `wanted` is below 1.
    """
    if wanted is not None and wanted < 1:
        raise UsageError(f"workers={wanted} can't learn.", fix="Give one at least, or leave it out.")
    if wanted is None and (seconds < _WORTH or not sys.executable):
        return 1
    return min(available_cores(), _MOST) if wanted is None else wanted


def sought(task: Task, networks: int, processes: int) -> tuple[Average, list[EnergyTrial]]:
    """The mean of at most so many networks, found by so many processes, and all that was tried."""
    with _Crew([task.with_other_starts(k) for k in range(1, processes)]) as others:
        search, found = task.done()
        reached = search.error <= task.target
        answers = [] if reached else others.answers(task.begun + task.seconds + _LATE)
    trials = [*search.trials, *(trial for one in answers for trial in one.trials)]
    found += [restored(task.problem, *network) for one in answers for network in one.networks]
    return average(found, networks), trials


class _Crew:
    """Processes at work on tasks; leaving the block ends them."""

    def __init__(self, tasks: list[Task]) -> None:
        self._members: list[_Member] = []
        for task in tasks:
            try:
                self._members.append(_Member(task))
            except OSError as error:  # too many processes, or too little memory
                logger.warning("A process of the search could not be started: %s.", error)
                break

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for member in self._members:
            member.end()

    def answers(self, deadline: float) -> list[Answer]:
        """Of all that have answered until then (`time.monotonic`)."""
        found = [member.answer(deadline) for member in self._members]
        return [one for one in found if one is not None]


class _Member:
    """A process, and a thread that gives it its task and takes its answer: pipes hold less than either."""

    def __init__(self, task: Task) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "palpate.learning.energy.searcher"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=helper_environment(),
            start_new_session=True,  # Ctrl-C in the terminal is for this process, which then ends it
        )
        self._told = b""
        self._thread = threading.Thread(target=self._talk, args=(pickle.dumps(task),), daemon=True)
        self._thread.start()

    def _talk(self, task: bytes) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(task)
            self._process.stdin.flush()  # left open: the process ends with it
            told = self._process.stdout.read()
        except (OSError, ValueError):  # it has ended, or was ended
            return
        if self._process.wait() == 0:  # else it may have told a part
            self._told = told

    def answer(self, deadline: float) -> Answer | None:
        self._thread.join(max(0.0, deadline - time.monotonic()))
        if self._thread.is_alive() or not self._told:
            logger.warning("A process of the search has ended or stands still: its networks are missing.")
            return None
        answer: Answer = pickle.loads(self._told)
        return answer

    def end(self) -> None:
        self._process.kill()
        self._process.wait()
        self._thread.join()
        for pipe in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):  # what it was not told any more
                assert pipe is not None
                pipe.close()
