"""The chains of a sweep, run on Dask through failures of samples and of workers.

`solve_chain` is the task that a worker runs; `run` hands out the tasks and collects their answers.
"""

from __future__ import annotations

import contextlib
import hashlib
import queue
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from types import FrameType
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import BOOKKEEPING, Field
from palpate.errors import UsageError
from palpate.sweeps.cluster import LocalCluster, local_cluster
from palpate.sweeps.problem import Answer, Problem, Resettable, Solver

if TYPE_CHECKING:
    import distributed

__all__ = [
    "Columns",
    "connect",
    "deferred_interrupt",
    "empty",
    "failed_row",
    "put",
    "run",
    "solve_chain",
]

_PATIENCE = 0.5  # s between looks at the workers
_FETCH = 5.0  # s; Dask's client may wait for ever for a result whose worker died just after it
_TRIES = 3  # a worker may die of something else than its sample
# samples solved apart differ from those of a chain in their last bits: no accident should do it
_CHAIN_TRIES = 2


@contextlib.contextmanager
def connect(cluster: Any, workers: int | None) -> Iterator[tuple[distributed.Client, Callable[[], None]]]:
    """Yield a client of `cluster`, and a function that starts dead workers again.

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
    """A chain being solved: its rows, their answers as they come, and the number of missing ones."""

    rows: np.ndarray
    answers: Columns
    missing: int


@dataclass(frozen=True)
class _Task:
    """Places of a chain that a worker is asked to solve."""

    chain: _Chain
    places: np.ndarray
    tries: int = 0

    def is_worth_another_try(self, error: BaseException | None) -> bool:
        """Tell whether to try again: after a lost answer (no error) or a death; other errors would come again."""
        if error is not None and not _is_death(error):
            return False
        return self.tries + 1 < (_TRIES if self.places.size == 1 else _CHAIN_TRIES)


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
        Connection to the scheduler.
    revive : callable
        Starts dead workers again.
    problem : Problem
        The question that is asked at each point.
    schema : sequence of Field
        Fields to record, with the bookkeeping.
    points : (N, n) array
        Inputs of each sample.
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
                future = finished.get(timeout=_PATIENCE)
            except queue.Empty:
                revive()
                continue
            task = pending.pop(future)
            answers, error = _outcome(future)
            if answers is not None:
                settle(task, answers)
            elif task.is_worth_another_try(error):
                submit(_Task(task.chain, task.places, task.tries + 1))
            elif task.places.size > 1:
                for place in task.places:
                    submit(_Task(task.chain, place[None]))
            else:
                settle(task, failed_row(schema, _reason(error)))


def _identity(problem: Problem) -> str:
    """Return a digest of the problem as a worker gets it, its functions included, which `describe` may leave out."""
    from distributed.protocol.pickle import dumps

    return hashlib.sha256(dumps(problem)).hexdigest()


def _outcome(future: Any) -> tuple[Columns | None, BaseException | None]:
    """Return the answers, or the error, or neither where the answers were lost."""
    try:
        error = None if future.status == "finished" else future.exception(timeout=_FETCH)
        return (future.result(timeout=_FETCH) if error is None else None), error
    except TimeoutError:
        return None, None


def _is_death(error: BaseException) -> bool:
    return type(error).__name__ == "KilledWorker"


def _reason(error: BaseException | None) -> str:
    if error is None:
        return "its answer was lost on the way"
    return "the process that solved it died" if _is_death(error) else f"{type(error).__name__}: {error}"


def _nothing() -> None:
    """Do nothing: workers of a foreign cluster are its owner's affair."""


Columns = dict[str, np.ndarray]
"""An array for each answer of a dataset, samples first."""

_BOOKKEEPING_NAMES = {field.name for field in BOOKKEEPING}


def empty(count: int, schema: Sequence[Field]) -> Columns:
    """Make rows that hold no answer yet: NaN, not converged."""
    return {field.name: field.empty(count) for field in schema}


def put(columns: Columns, rows: np.ndarray, part: Columns) -> None:
    """Write the rows of `part` at `rows` of `columns`."""
    for name, values in columns.items():
        values[rows] = part[name]


def failed_row(schema: Sequence[Field], message: str) -> Columns:
    """Make a row that says why it has no answer."""
    row = empty(1, schema)
    row["message"][0] = message
    return row


def solve_chain(problem: Problem, identity: str, schema: Sequence[Field], points: np.ndarray) -> Columns:
    """Solve at each of the points (N, n) in turn: the task that a worker runs.

    A worker that has a problem of the same `identity` open goes on with its solver.
    """
    columns = empty(len(points), schema)
    solver = _take_solver(problem, identity)
    for row, x in enumerate(points):
        begun = time.perf_counter()
        answer = solver.solve(x)
        columns["solve_seconds"][row] = time.perf_counter() - begun
        _record(columns, schema, row, answer)
    _last_solver.entry = (identity, solver)
    return columns


class _LastSolver(threading.local):
    """The solver opened last, in each thread its own: meshing and opening cost seconds."""

    entry: tuple[str, Solver] | None = None


_last_solver = _LastSolver()


def _take_solver(problem: Problem, identity: str) -> Solver:
    """Return the solver of this problem that is open here, reset, or a new one.

    It is taken away while a chain is solved, so that none is kept which an error has left in the midst of a
    solve. One is kept at most: an opened solid takes hundreds of megabytes.
    """
    last, _last_solver.entry = _last_solver.entry, None
    if last is not None and isinstance(last[1], Resettable) and last[0] == identity:
        last[1].reset()
        return last[1]
    del last
    return problem.open()


def _record(columns: Columns, schema: Sequence[Field], row: int, answer: Answer) -> None:
    columns["converged"][row] = answer.converged
    columns["message"][row] = answer.message
    columns["iterations"][row] = answer.iterations
    columns["residual"][row] = answer.residual
    if not answer.converged:  # the fields of a failed solve stay NaN
        return
    for field in schema:
        if field.name not in _BOOKKEEPING_NAMES:
            columns[field.name][row] = _value(answer, field)


def _value(answer: Answer, field: Field) -> Any:
    if not hasattr(answer, field.name):
        if field.optional:
            return field.fill
        raise UsageError(
            f"The answer of a solve lacks {field.name!r}.",
            why="The problem's schema promises it.",
            fix="Answer it, or mark the field as optional.",
        )
    value = getattr(answer, field.name)
    if np.shape(value) != field.shape:
        raise UsageError(
            f"The answer {field.name!r} of a solve has the shape {np.shape(value)}.",
            why=f"The problem's schema promises {field.shape}.",
            fix="Make the schema and the answers fit.",
        )
    return value


@contextlib.contextmanager
def deferred_interrupt() -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C back; yield a function that raises KeyboardInterrupt, where it is safe, if one came.

    Raised at any odd moment it gets lost, for example inside one of Dask's destructors. A second Ctrl-C is not
    held back.
    """
    interrupted = threading.Event()
    usual = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        interrupted.set()
        signal.signal(signal.SIGINT, usual)

    def check() -> None:
        if interrupted.is_set():
            raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    # only Python's own handler is replaced: another one is somebody's decision
    if not main or usual is not signal.default_int_handler:
        yield check
        return
    signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, usual)
