"""Running the chunks of a sweep on Dask, through failures of samples and of workers."""

from __future__ import annotations

import contextlib
import queue
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.sweeps.answers import Columns, failed_row, solve_chunk
from palpate.sweeps.cluster import LocalCluster, local_cluster
from palpate.sweeps.interrupt import deferred_interrupt
from palpate.sweeps.problem import Problem

if TYPE_CHECKING:
    import distributed

__all__ = ["connect", "run"]

PATIENCE = 0.5  # s between looks at the workers
FETCH = 5.0  # s; Dask's client may wait for ever for a result whose worker died just after it
TRIES = 3  # a sample whose worker died may have died of its neighbour


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


def run(
    client: distributed.Client,
    revive: Callable[[], None],
    problem: Problem,
    points: np.ndarray,
    chunks: Sequence[np.ndarray],
    accept: Callable[[np.ndarray, Columns], None],
) -> None:
    """Solve the chunks and hand over each one's rows and answers as they come in.

    A chunk that raises, or whose worker dies, is solved again sample by sample; a sample that then still does
    so becomes a row with the error's words. The sweep goes on.

    Parameters
    ----------
    client : distributed.Client
    revive : callable
        Starts dead workers again.
    problem : Problem
    points : (N, n) array
    chunks : sequence of int arrays
        Rows of `points`.
    accept : callable
        Takes rows and their answers.
    """
    finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
    pending: dict[Any, tuple[np.ndarray, int]] = {}

    def submit(rows: np.ndarray, tries: int = 0) -> None:
        future = client.submit(solve_chunk, problem, points[rows], pure=False)
        pending[future] = (rows, tries)
        future.add_done_callback(finished.put)

    with deferred_interrupt() as check_interrupt:
        for rows in chunks:
            submit(rows)
        while pending:
            check_interrupt()
            try:
                future = finished.get(timeout=PATIENCE)
            except queue.Empty:
                revive()
                continue
            rows, tries = pending.pop(future)
            answers, error = _outcome(future)
            if answers is not None:
                accept(rows, answers)
            elif tries + 1 < TRIES and (error is None or (rows.size == 1 and _is_death(error))):
                submit(rows, tries + 1)
            elif rows.size > 1:
                for row in rows:
                    submit(row[None])
            else:
                accept(rows, failed_row(len(problem.rest), _words(error)))


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
