"""Running the chunks of a sweep on Dask, through failures of samples and of workers."""

from __future__ import annotations

import contextlib
import queue
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.sweeps.answers import Columns, failed_row, solve_chunk
from palpate.sweeps.cluster import LocalCluster, local_cluster
from palpate.sweeps.problem import Problem

if TYPE_CHECKING:
    import distributed

__all__ = ["connect", "run"]

PATIENCE = 0.5  # s between looks at the workers
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
) -> Iterator[tuple[np.ndarray, Columns]]:
    """Solve the chunks and yield each one's rows and answers as they come in.

    A chunk that raises, or whose worker dies, is solved again sample by sample; a sample that then still does
    so is yielded as a row with the error's words. The sweep goes on.

    Parameters
    ----------
    client : distributed.Client
    revive : callable
        Starts dead workers again.
    problem : Problem
    points : (N, n) array
    chunks : sequence of int arrays
        Rows of `points`.
    """
    finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
    pending: dict[Any, tuple[np.ndarray, int]] = {}

    def submit(rows: np.ndarray, tries: int = 0) -> None:
        future = client.submit(solve_chunk, problem, points[rows], pure=False)
        pending[future] = (rows, tries)
        future.add_done_callback(finished.put)

    for rows in chunks:
        submit(rows)
    while pending:
        try:
            future = finished.get(timeout=PATIENCE)
        except queue.Empty:
            revive()
            continue
        rows, tries = pending.pop(future)
        error = None if future.status == "finished" else future.exception()
        if error is None:
            yield rows, future.result()
        elif rows.size > 1:
            for row in rows:
                submit(row[None])
        elif type(error).__name__ == "KilledWorker" and tries + 1 < TRIES:
            submit(rows, tries + 1)
        else:
            yield rows, failed_row(len(problem.rest), _words(error))


def _words(error: BaseException) -> str:
    if type(error).__name__ == "KilledWorker":
        return "the process that solved it died"
    return f"{type(error).__name__}: {error}"


def _nothing() -> None:
    """Workers of a foreign cluster are its owner's affair."""
