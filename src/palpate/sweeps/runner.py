"""The chains of a sweep on Dask: handed out to workers, and collected through the loss of workers.

What a case does to the process that solves it, `palpate.sweeps.case` sees to. Here a worker may still vanish, or
the scheduler.
"""

from __future__ import annotations

import collections
import contextlib
import hashlib
import logging
import math
import queue
import signal
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from types import FrameType
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Field
from palpate.errors import ResourceError
from palpate.format import count, duration
from palpate.processes import end_by_sigterm, note_interrupt
from palpate.sweeps.case import Columns, NoTimeLeft, Task, failed_rows, solve_chain
from palpate.sweeps.cluster import LocalCluster, OnDemandCluster, Scheduler, local_cluster
from palpate.sweeps.job_queue import JobQueue
from palpate.sweeps.problem import Problem

if TYPE_CHECKING:
    import distributed

__all__ = ["Machines", "connect", "deferred_interrupt", "run", "seconds_per_case"]

_PATIENCE = 0.5  # s between looks at the workers
_FETCH = 5.0  # s; Dask's client may wait for ever for a result whose worker died just after it
_TRIES = 3  # tries of a chain on workers that vanish
_JOB_TRIES = 20  # the same where a queue ends workers for reasons of its own
_AHEAD = 4  # chains that are handed in, for each that is solved at once: their problem takes memory
_LEAST_AHEAD = 16
_LOOK = 5.0  # s between looks at how many workers there are
_SLACK = 1.5  # what the cases of a chain may take, over those of the slowest one that was seen
_KEPT = "What is solved is kept where the sweep has a path: the same command goes on."


@dataclass(frozen=True)
class Machines:
    """The machines that a sweep runs on."""

    client: distributed.Client
    revive: Callable[[], None]  # starts dead workers again
    tries: int = _TRIES  # of a chain whose worker vanishes
    slots: int = 0  # cases that may be solved at once, where that is known beforehand
    job_seconds: float = math.inf  # time that a worker has from its start to its end


@contextlib.contextmanager
def connect(cluster: Any, workers: int | None) -> Iterator[Machines]:
    """Yield a client of `cluster`, with what the sweep must know of its workers.

    A `LocalCluster`, an `OnDemandCluster` or a `JobQueue`, a `Scheduler` or its address, or a cluster or client of
    Dask's is used and left running; for ``None`` a cluster is started and ended.
    """
    import distributed

    known: dict[str, Any] = {}
    revive: Callable[[], None] = _nothing
    with contextlib.ExitStack() as stack:
        if cluster is None:
            cluster = stack.enter_context(local_cluster(workers))
        elif isinstance(cluster, JobQueue):
            known = {"tries": _JOB_TRIES, "slots": cluster.slots, "job_seconds": cluster.seconds or math.inf}
            revive = cluster.replace_lost
            cluster = cluster.start()
        elif isinstance(cluster, OnDemandCluster):
            cluster = cluster.start()
        if isinstance(cluster, LocalCluster):
            revive = cluster.revive
        if isinstance(cluster, distributed.Client):
            yield Machines(cluster, revive, **known)
        else:
            yield Machines(stack.enter_context(_closing(_client(cluster))), revive, **known)


@contextlib.contextmanager
def _closing(client: distributed.Client) -> Iterator[distributed.Client]:
    """Close a client at the end; where its scheduler is lost, an error on the way is of no account.

    A client that tries to connect again closes with whatever that ends in: Tornado's ValueError over TLS, for one.
    """
    try:
        yield client
    finally:
        connected = client.status == "running"
        logger = logging.getLogger("distributed.client")  # tells of the end of attempts to connect again
        level = logger.level
        logger.setLevel(level if connected else logging.CRITICAL)
        try:
            client.close()
        except (OSError, ValueError):
            if connected:
                raise
            client.status = "closed"  # or it closes again when it is collected, and fails aloud
        finally:
            logger.setLevel(level)


def _client(cluster: Any) -> distributed.Client:
    """Return a new client of a `LocalCluster`, of a scheduler or its address, or of one of Dask's clusters."""
    import distributed

    if isinstance(cluster, str):
        cluster = Scheduler(cluster)
    security = cluster.security() if isinstance(cluster, Scheduler) else getattr(cluster, "security", None)
    address = cluster.address if isinstance(cluster, Scheduler | LocalCluster) else cluster
    # Dask silences its loggers while a cluster of its own runs; a worker that was killed, or just ends, would be told
    logging.getLogger("distributed.batched").setLevel(logging.WARNING)
    try:
        return distributed.Client(address, security=security, set_as_default=False)
    except (OSError, ValueError) as error:  # a time-out is one of the first; a wrong address, of the second
        raise ResourceError(
            f"No scheduler answers at {address}.",
            why=f"{type(error).__name__}: {error}",
            fix="Check the address and that the scheduler runs; without one a sweep uses this machine's cores.",
        ) from error


@dataclass(frozen=True)
class _Chain:
    """Rows of a chain that a worker is asked to solve."""

    rows: np.ndarray
    tries: int = 1


def run(
    machines: Machines,
    problem: Problem,
    schema: Sequence[Field],
    points: np.ndarray,
    chains: Sequence[np.ndarray],
    accept: Callable[[np.ndarray, Columns], None],
    case_limit: float,
    slowest: float = 0.0,
) -> None:
    """Solve the chains and hand over each one's rows and answers when it is whole.

    A case that fails becomes a row with the reason, and the sweep goes on. A chain whose worker vanishes is given to
    another one; if that happens again and again, all its rows have failed. One that a worker has no time left for is
    given to another too, and that worker ends.

    The inputs `points` (N, n) are solved by `chains` of their rows, a case within `case_limit` seconds, and `accept`
    takes rows and their answers. The schema has the bookkeeping too; `slowest` is the largest mean time of a chain's
    cases in s that is known: one slow case alone does not make all chains too long for a job. A scheduler that is
    lost, and a chain that takes longer than a job may, are ResourceErrors.
    """
    client, finished = machines.client, queue.SimpleQueue[Any]()
    waiting = collections.deque(_Chain(rows) for rows in chains)
    pending: dict[Any, _Chain] = {}
    task, ahead = _task(problem, schema, case_limit), _Ahead(machines)
    refused = set[str]()  # workers that had no time left for their first chain, since the last answer

    def submit(chain: _Chain) -> None:
        own = replace(task, expected=_SLACK * slowest * chain.rows.size)
        if own.expected > machines.job_seconds:
            raise _too_short(own.expected, machines.job_seconds, chain.rows.size)
        future = client.submit(solve_chain, own, points[chain.rows], pure=False)
        pending[future] = chain
        future.add_done_callback(finished.put)

    with deferred_interrupt() as check_interrupt:
        while pending or waiting:
            while waiting and len(pending) < ahead():
                submit(waiting.popleft())
            check_interrupt()
            _require_scheduler(client)
            try:
                future = finished.get(timeout=_PATIENCE)
            except queue.Empty:
                machines.revive()
                continue
            _require_scheduler(client, future)
            chain = pending.pop(future)
            answers, error = _outcome(client, future)
            if answers is not None:
                refused.clear()
                slowest = max(slowest, seconds_per_case(answers))
                accept(chain.rows, answers)
            elif isinstance(error, NoTimeLeft):
                # at the end of many jobs at once all of their workers refuse: that says nothing of the chain
                refused.update([error.worker] if error.fresh else ())
                if len(refused) > machines.tries:
                    raise _too_short(error.expected, machines.job_seconds, chain.rows.size)
                client.retire_workers([error.worker], close_workers=True)
                waiting.appendleft(chain)
            elif chain.tries < machines.tries and (error is None or _is_death(error)):
                waiting.appendleft(_Chain(chain.rows, chain.tries + 1))
            else:
                accept(chain.rows, failed_rows(chain.rows.size, schema, _reason(error)))


class _Ahead:
    """The number of chains that are handed in at once: enough to keep all workers busy, which come and go."""

    def __init__(self, machines: Machines) -> None:
        self._machines, self._looked, self._most = machines, -math.inf, 0

    def __call__(self) -> int:
        """Return the number, from what the scheduler told some seconds ago at most."""
        if (now := time.monotonic()) - self._looked > _LOOK:
            threads = sum(self._machines.client.nthreads().values())
            self._looked = now
            self._most = max(_LEAST_AHEAD, _AHEAD * max(threads, self._machines.slots))
        return self._most


def seconds_per_case(answers: Columns) -> float:
    """Return the mean time of a solve in s over some rows; 0 where none is known."""
    seconds = answers["solve_seconds"]
    known = seconds[np.isfinite(seconds)]
    return float(known.mean()) if known.size else 0.0


def _too_short(needed: float, given: float, cases: int) -> ResourceError:
    return ResourceError(
        "The jobs of the queue are too short for this sweep.",
        why=f"{count(cases, 'case')} are solved one after the other, from each other's answers, and may take "
        f"{duration(needed)}; a job has {duration(given)} from its start to its end.",
        fix=f"Ask for a longer walltime. {_KEPT}",
    )


def _task(problem: Problem, schema: Sequence[Field], case_limit: float) -> Task:
    """Return the problem as workers get it: with its functions, which `describe` may leave out."""
    from distributed.protocol.pickle import dumps

    content = dumps(problem)
    identity = hashlib.sha256(content).hexdigest()
    return Task(content, identity, tuple(schema), case_limit, uuid.uuid4().hex)


def _require_scheduler(client: distributed.Client, future: Any = None) -> None:
    """Refuse to go on without the scheduler: a client tries to connect again, but what was asked for is forgotten.

    Its answers are cancelled first; only then does the client notice that its status is another one.
    """
    if client.status != "running" or (future is not None and future.cancelled()):
        raise ResourceError(
            "The scheduler of the sweep is lost.",
            why="It ended, was restarted, or the connection to it broke.",
            fix=f"Start it again. {_KEPT}",
        )


def _outcome(client: distributed.Client, future: Any) -> tuple[Columns | None, BaseException | None]:
    """Return the answers, or the error, or neither where the answers were lost."""
    try:
        error = None if future.status == "finished" else future.exception(timeout=_FETCH)
        return (future.result(timeout=_FETCH) if error is None else None), error
    except TimeoutError:
        return None, None
    except CancelledError:
        _require_scheduler(client, future)
        return None, None


def _is_death(error: BaseException) -> bool:
    return type(error).__name__ == "KilledWorker"


def _reason(error: BaseException | None) -> str:
    if error is None:
        return "its answer was lost on the way"
    return "its worker died" if _is_death(error) else f"{type(error).__name__}: {error}"


def _nothing() -> None:
    """Do nothing: workers of a foreign cluster are their owner's affair."""


_HANDLERS = {
    signal.SIGINT: (signal.default_int_handler, note_interrupt),
    signal.SIGTERM: (signal.SIG_DFL, end_by_sigterm),
}
"""Signals that are held back, and the handlers that are replaced: another one is somebody's decision."""


@contextlib.contextmanager
def deferred_interrupt() -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C and SIGTERM back; yield a function that ends the work, where it is safe, if one came.

    It raises KeyboardInterrupt or SystemExit. Raised at any odd moment they get lost, for example inside one of
    Dask's destructors. A second signal is not held back.
    """
    received: list[int] = []
    usual = {number: signal.getsignal(number) for number in _HANDLERS}

    def note(number: int, frame: FrameType | None) -> None:
        received.append(number)
        signal.signal(number, usual[signal.Signals(number)])

    def check() -> None:
        if received:
            if received[0] == signal.SIGINT:
                raise KeyboardInterrupt
            end_by_sigterm(received[0], None)

    main = threading.current_thread() is threading.main_thread()
    held = [number for number, own in _HANDLERS.items() if main and usual[number] in own]
    for number in held:
        signal.signal(number, note)
    try:
        yield check
    finally:
        for number in held:
            signal.signal(number, usual[number])
