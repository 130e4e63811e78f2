"""Running the chains of a sweep on Dask, through failures of samples and of workers."""

from __future__ import annotations

import contextlib
import hashlib
import queue
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Field
from palpate.sweeps.answers import Columns, empty, failed_row, put, solve_chain
from palpate.sweeps.cluster import LocalCluster, local_cluster
from palpate.sweeps.interrupt import deferred_interrupt
from palpate.sweeps.problem import Problem

if TYPE_CHECKING:
    import distributed

__all__ = ["connect", "run"]

PATIENCE = 0.5  # s between looks at the workers
FETCH = 5.0  # s; Dask's client may wait for ever for a result whose worker died just after it
TRIES = 3  # a worker may die of something else than its sample
CHAIN_TRIES = (
    2  # samples solved apart differ from those of a chain in their last bits: no accident should do it
)


@contextlib.contextmanager
def connect(cluster: Any, workers: int | None) -> Iterator[tuple[distributed.Client, Callable[[], None]]]:
    """Yield a client of `cluster` and what to call to start dead workers again.

    A `LocalCluster`, a scheduler's address, or a cluster or client of Dask's is used and left running; for
    ``None`` a cluster is started and ended.
    """
    import distributed

    with contextlib.ExitStack() as stack:
        if cluster is None:
            cluster = stack.enter_context(local_cluster(workers))
        revive = cluster.revive if isinstance(cluster, LocalCluster) else _nothing
        if isinstance(cluster, distributed.Client):
            yield cluster, revive
        else:
            address = cluster.address if isinstance(cluster, LocalCluster) else cluster
            client = stack.enter_context(distributed.Client(address, set_as_default=False))
            yield client, revive


@dataclass
class _Chain:
    """A chain under way: its rows, their answers as they come, and how many are missing."""

    rows: np.ndarray
    answers: Columns
    missing: int


@dataclass(frozen=True)
class _Task:
    """Some places of a chain, given to a worker."""

    chain: _Chain
    places: np.ndarray
    tries: int = 0

    def may_be_tried_again(self, error: BaseException | None) -> bool:
        """Whether a lost answer (no error) or a death is worth another try; other errors would come again."""
        if error is not None and not _is_death(error):
            return False
        return self.tries + 1 < (TRIES if self.places.size == 1 else CHAIN_TRIES)


def run(
    client: distributed.Client,
    revive: Callable[[], None],
    problem: Problem,
    schema: Sequence[Field],
    points: np.ndarray,
    chains: Sequence[np.ndarray],
    accept: Callable[[np.ndarray, Columns], None],
) -> None:
    """Solve the chains and hand over each one's rows and answers when it is whole.

    A chain that raises, or whose worker dies again and again, is solved sample by sample, each by a new solver;
    a sample that then still does so becomes a row with the error's words. The sweep goes on.

    Parameters
    ----------
    client : distributed.Client
    revive : callable
        Starts dead workers again.
    problem : Problem
    schema : sequence of Field
        What is recorded, with the bookkeeping.
    points : (N, n) array
    chains : sequence of int arrays
        Rows of `points`.
    accept : callable
        Takes rows and their answers.
    """
    finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
    pending: dict[Any, _Task] = {}
    identity = _identity(problem)

    def submit(task: _Task) -> None:
        rows = task.chain.rows[task.places]
        future = client.submit(solve_chain, problem, identity, schema, points[rows], pure=False)
        pending[future] = task
        future.add_done_callback(finished.put)

    def settle(task: _Task, answers: Columns) -> None:
        put(task.chain.answers, task.places, answers)
        task.chain.missing -= task.places.size
        if not task.chain.missing:
            accept(task.chain.rows, task.chain.answers)

    with deferred_interrupt() as check_interrupt:
        for rows in chains:
            submit(_Task(_Chain(rows, empty(rows.size, schema), rows.size), np.arange(rows.size)))
        while pending:
            check_interrupt()
            try:
                future = finished.get(timeout=PATIENCE)
            except queue.Empty:
                revive()
                continue
            task = pending.pop(future)
            answers, error = _outcome(future)
            if answers is not None:
                settle(task, answers)
            elif task.may_be_tried_again(error):
                submit(_Task(task.chain, task.places, task.tries + 1))
            elif task.places.size > 1:
                for place in task.places:
                    submit(_Task(task.chain, place[None]))
            else:
                settle(task, failed_row(schema, _words(error)))


def _identity(problem: Problem) -> str:
    """Digest of the problem as it is sent to a worker, its functions included: what `describe` says may not do."""
    from distributed.protocol.pickle import dumps

    return hashlib.sha256(dumps(problem)).hexdigest()


def _outcome(future: Any) -> tuple[Columns | None, BaseException | None]:
    """Answers, or the error, or neither where the answers were lost."""
    try:
        error = None if future.status == "finished" else future.exception(timeout=FETCH)
        return (future.result(timeout=FETCH) if error is None else None), error
    except TimeoutError:
        return None, None


def _is_death(error: BaseException) -> bool:
    return type(error).__name__ == "KilledWorker"


def _words(error: BaseException | None) -> str:
    if error is None:
        return "its answer was lost on the way"
    return "the process that solved it died" if _is_death(error) else f"{type(error).__name__}: {error}"


def _nothing() -> None:
    """Workers of a foreign cluster are its owner's affair."""
