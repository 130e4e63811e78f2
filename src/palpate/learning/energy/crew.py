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
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Literal, Self

import numpy as np

from palpate.cores import available_cores, helper_environment
from palpate.errors import UsageError
from palpate.learning.energy.average import Average, average
from palpate.learning.energy.judging import judged, restored
from palpate.learning.energy.search import EnergyTrial, Problem
from palpate.learning.energy.strategy import SEARCH_SHARE, searched
from palpate.learning.refinement.refine import Refined
from palpate.network.radial import RadialFunction

__all__ = ["Answer", "Task", "processes_for", "sought"]

logger = logging.getLogger("palpate.learning")

_WORTH = 20.0  # s of learning; a process takes two to start
_MOST = 8  # processes: each holds a copy of the solves, and a mean is of four networks
_KEPT = 8  # networks of each process
_LATE = 30.0  # s; the last network may be judged after the time is over

Judged = tuple[Refined, np.ndarray, np.ndarray]
"""A network, and what it misses of solves: refined again without them, and by the closed form."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What one process found.

    Attributes
    ----------
    trials : list of EnergyTrial
    networks : list of `Judged`
        The best ones.
    reached : bool
        Whether the search ended at its target, and not with its time.
    """

    trials: list[EnergyTrial]
    networks: list[Judged]
    reached: bool


@dataclass(frozen=True, eq=False)
class Task:
    """A search, and the time that it may take.

    Attributes
    ----------
    problem : Problem
    begun, seconds : float
        Of `time.monotonic`, and from then on.
    form, radial, units_max, target, seed
        As in `palpate.learning.energy.learn_surrogate`.
    """

    problem: Problem
    begun: float
    seconds: float
    form: str
    radial: RadialFunction | Literal["auto"]
    units_max: int
    target: float
    seed: int

    def averages(self) -> tuple[list[EnergyTrial], list[Average], bool]:
        """Trials, networks judged, and whether the target was reached."""
        until = self.begun + SEARCH_SHARE * self.seconds
        search = searched(self.problem, until, self.form, self.radial, self.units_max, self.target, self.seed)
        return search.trials, judged(search, self.begun + self.seconds), search.error <= self.target

    def answer(self) -> Answer:
        """What is told to another process, without the large matrices that it can make itself."""
        trials, found, reached = self.averages()
        best = sorted(found, key=lambda one: one.error)[:_KEPT]
        return Answer(trials, [(o.members[0], o.left_out.errors, o.closed.errors) for o in best], reached)

    def with_other_starts(self, number: int) -> Task:
        """The same search by process `number`; 0 is this one."""
        if number == 0:
            return self
        return replace(self, seed=int(np.random.SeedSequence([self.seed, number]).generate_state(1)[0]))


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
        trials, found, reached = task.averages()
        answers = [] if reached else others.answers(task.begun + task.seconds + _LATE)
    for one in answers:
        trials = trials + one.trials
        found = found + [restored(task.problem, *network) for network in one.networks]
    return average(found, networks), trials


class _Crew:
    """Processes at work on tasks; leaving the block ends them."""

    def __init__(self, tasks: list[Task]) -> None:
        self._members: list[_Member] = []
        for task in tasks:
            try:
                self._members.append(_Member(task))
            except OSError as error:  # too many processes, or too little memory
                logger.warning("Fewer processes search than there are cores: %s.", error)
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
