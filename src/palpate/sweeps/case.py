"""The cases of a sweep: one answer each, found by a process that may crash or hang.

`solve_chain` runs in a worker and hands case after case to a child process, which `open_problem` and `solve_case`
run in. What ends the child costs the case that did it: the others go on in a new child.
"""

from __future__ import annotations

import collections
import contextlib
import os
import pickle
import threading
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from palpate.dataset import BOOKKEEPING, Field
from palpate.errors import UsageError
from palpate.input_files import plain_text
from palpate.supervised import Child, ChildEnded
from palpate.sweeps.job_queue import JOB_END
from palpate.sweeps.problem import Answer, Resettable, Solver

__all__ = [
    "Columns",
    "Failure",
    "NoTimeLeft",
    "Task",
    "empty",
    "failed_rows",
    "open_problem",
    "prepare_child",
    "put",
    "solve_case",
    "solve_chain",
]

OPEN_LIMIT = 600.0
"""Time in s that opening a problem may take at least: it meshes, and imports what it needs."""
_TRIES = 2  # tries of a case: the first may have ended for a reason of its own, such as want of memory
_LEAST_LEFT = 10.0  # s that a job must have left for any chain
_TRACE = 3000  # characters that a row keeps of the end of a traceback

Columns: TypeAlias = dict[str, np.ndarray]
"""An array for each answer of a dataset, samples first."""

_BOOKKEEPING_NAMES = {field.name for field in BOOKKEEPING}


def empty(count: int, schema: Sequence[Field]) -> Columns:
    """Make rows that hold no answer yet: NaN, not converged."""
    return {field.name: field.empty(count) for field in schema}


def put(columns: Columns, rows: Any, part: Columns) -> None:
    """Write the rows of `part` at `rows` of `columns`."""
    for name, values in columns.items():
        values[rows] = part[name]


def failed_rows(count: int, schema: Sequence[Field], message: str) -> Columns:
    """Make rows that say why they have no answer."""
    rows = empty(count, schema)
    rows["message"][:] = message
    return rows


@dataclass(frozen=True)
class Task:
    """The problem of a sweep, as workers get it."""

    problem: bytes  # pickled with its functions
    identity: str  # a digest of these bytes: a child that has the same problem open goes on with its solver
    schema: tuple[Field, ...]  # fields to record, with the bookkeeping
    limit: float  # time in s that a case may take
    run: str  # a name of this sweep's run, which no other run has
    expected: float = 0.0  # time in s that the chain may take, by what was seen; 0 where nothing is known


@dataclass(frozen=True)
class Failure:
    """An exception of the problem's own, as text."""

    reason: str  # its kind and its words
    trace: str  # its traceback

    def __str__(self) -> str:
        return f"{self.reason}\n\n{self.trace[-_TRACE:]}".rstrip()


class NoTimeLeft(Exception):
    """A worker whose job ends before a chain would."""

    def __init__(self, worker: str, expected: float, fresh: bool) -> None:
        super().__init__(worker, expected, fresh)
        self.worker = worker  # its address
        self.expected = expected  # s that it should have left
        self.fresh = fresh  # whether it has not begun any chain before


class _Chains:
    """Chains of this process, one in each of its threads."""

    changed = threading.Condition()
    begun = running = 0


@contextlib.contextmanager
def _counted() -> Iterator[None]:
    """Count a chain among those of this process."""
    with _Chains.changed:
        _Chains.begun += 1
        _Chains.running += 1
    try:
        yield
    finally:
        with _Chains.changed:
            _Chains.running -= 1
            _Chains.changed.notify_all()


def _require_time(task: Task) -> None:
    """Refuse a chain that would outlast the job that this process belongs to, if it belongs to one.

    The job ends by that, and so it waits for the chains of other threads.
    """
    end, expected = os.environ.get(JOB_END), max(task.expected, _LEAST_LEFT)
    if end is not None and time.time() + expected > float(end):
        from distributed import get_worker

        with _Chains.changed:
            _Chains.changed.wait_for(lambda: _Chains.running == 0)
        raise NoTimeLeft(str(get_worker().address), expected, _Chains.begun == 0)


class _Local(threading.local):
    """The state that each thread keeps from one chain to the next.

    Its child has the last problem open: meshing and opening cost seconds. `refused` is the last run whose problem
    could not be opened, and why.
    """

    child: Child | None = None
    refused: tuple[str, str] = ("", "")


_local = _Local()


def prepare_child() -> Child:
    """Return this thread's child, started if it is new."""
    if _local.child is None:
        _local.child = Child()
    _local.child.start()
    return _local.child


def solve_chain(task: Task, points: np.ndarray) -> Columns:
    """Solve at each of the points (N, n) in turn: the task that a worker runs.

    A case gets two tries at most. After a crash its chain is solved again from where the solver was new, so that an
    accident changes no bit of the answers; an exception is tried again with a new solver, and a case that takes
    longer than the limit not at all. After a case that failed for good the others go on with a new solver.
    """
    _require_time(task)
    with _counted():
        return _solve_rows(task, points)


def _solve_rows(task: Task, points: np.ndarray) -> Columns:
    columns = empty(len(points), task.schema)
    child = prepare_child()
    failures: collections.Counter[int] = collections.Counter()
    first = row = 0  # the solver was new at the row `first`
    opened = False
    while row < len(points):
        if not opened and (reason := _open(child, task)):
            rest = slice(row, None)
            put(columns, rest, failed_rows(len(points) - row, task.schema, reason))
            break
        opened = True
        try:
            answer = child.call(solve_case, points[row], limit=task.limit)
        except ChildEnded as error:
            opened = False
            failures[row] += 1
            if failures[row] < _TRIES and not error.overdue:
                row = first
                continue
            answer = failed_rows(1, task.schema, _last_words(error, failures[row]))
        if isinstance(answer, Failure):
            opened = False
            failures[row] += 1
            if failures[row] < _TRIES:
                first = row
                continue
            answer = failed_rows(1, task.schema, str(answer))
        put(columns, slice(row, row + 1), answer)
        row += 1
        first = first if opened else row
    return columns


def _open(child: Child, task: Task) -> str:
    """Open the problem in the child; return why that is not possible, else an empty text."""
    if _local.refused[0] == task.run:
        return _local.refused[1]
    reason, limit = "", max(task.limit, OPEN_LIMIT)
    for tries in range(1, _TRIES + 1):
        try:
            failure = child.call(open_problem, task.identity, task.problem, task.schema, limit=limit)
        except ChildEnded as error:
            reason = f"The model could not be opened: {_last_words(error, tries)}"
            if error.overdue:
                break
        else:
            if failure is None:
                return ""
            reason = str(failure)
            break
    _local.refused = (task.run, reason)
    return reason


def _last_words(error: ChildEnded, tries: int) -> str:
    again = f", in each of {tries} tries" if tries > 1 else ""
    return f"{error.reason}{again}\n\n{error.details[:_TRACE]}".rstrip()


@dataclass(frozen=True)
class _Opened:
    """The solver that is open in this process, and the schema of its answers."""

    identity: str
    solver: Solver
    schema: tuple[Field, ...]


class _Session:
    """The one solver that a child has open: an opened solid takes hundreds of megabytes."""

    opened: _Opened | None = None


def open_problem(identity: str, problem: bytes, schema: tuple[Field, ...]) -> Failure | None:
    """Open a problem in this process, or reset the solver where it is open already; return what went wrong."""
    last, _Session.opened = _Session.opened, None
    try:
        if last is not None and isinstance(last.solver, Resettable) and last.identity == identity:
            last.solver.reset()
            _Session.opened = last
        else:
            del last
            _Session.opened = _Opened(identity, pickle.loads(problem).open(), schema)
    except BaseException as error:  # noqa: BLE001 - the problem is the user's own, which may also call sys.exit
        return _failure(error)
    return None


def solve_case(x: np.ndarray) -> Columns | Failure:
    """Solve at inputs x (n,) in this process; return one row, or what went wrong, after which no solver is open."""
    opened, _Session.opened = _Session.opened, None  # an error leaves it in the midst of a solve
    assert opened is not None
    row = empty(1, opened.schema)
    begun = time.perf_counter()
    try:
        answer = opened.solver.solve(x)
        row["solve_seconds"][0] = time.perf_counter() - begun
        _record(row, opened.schema, answer)
    except BaseException as error:  # noqa: BLE001 - as above
        return _failure(error)
    _Session.opened = opened
    return row


def _failure(error: BaseException) -> Failure:
    """Return an exception as text. Ctrl-C never comes here: it is for the process that started this one."""
    report = traceback.TracebackException.from_exception(error)
    report.stack = traceback.StackSummary.from_list([f for f in report.stack if f.filename != __file__])
    if isinstance(error, SystemExit):
        reason = f"called sys.exit({'' if error.code is None else repr(error.code)})"
    else:  # by the report, which takes exceptions that can't be written as text
        reason = "".join(report.format_exception_only()).strip().removeprefix("builtins.")
        reason = reason if isinstance(error, Exception) else f"raised {reason}"
    return Failure(plain_text(reason), plain_text("".join(report.format())))


def _record(row: Columns, schema: Sequence[Field], answer: Answer) -> None:
    row["converged"][0] = answer.converged
    row["message"][0] = plain_text(str(answer.message))
    row["iterations"][0] = answer.iterations
    row["residual"][0] = answer.residual
    if not answer.converged:  # the fields of a failed solve stay NaN
        return
    answers = {field.name: _value(answer, field) for field in schema if field.name not in _BOOKKEEPING_NAMES}
    if wrong := [
        name
        for name in answers
        if answers[name] is not None and not _is_finite(_drop_unstated(name, answers))
    ]:
        row["converged"][0] = False
        row["message"][0] = (
            f"the solver calls it converged, but {', '.join(wrong)} {'is' if len(wrong) == 1 else 'are'} not finite"
        )
        return
    for name, value in answers.items():
        if value is not None:
            row[name][0] = value


def _drop_unstated(name: str, answers: Mapping[str, Any]) -> Any:
    """Return a quantity without what its solver does not state.

    A family of bodies does not state how the force varies with a material's numbers: these rows and columns of the
    gradient are not-a-number altogether. Of a layer's thickness or the probe's radius it does not state the slope of
    the energy either, which is that entry of the response. Without any number nothing is left out.
    """
    value, gradient = answers[name], answers.get("response_gradient")
    if name not in {"response", "response_gradient"} or gradient is None or not np.isfinite(gradient).any():
        return value
    value, known = np.asarray(value), np.isfinite(gradient)
    if name == "response_gradient":
        return value[np.ix_(known.any(axis=1), known.any(axis=0))]
    return value[known.any(axis=1) | ~np.isnan(value)]


def _is_finite(value: Any) -> bool:
    numbers = np.asarray(value)
    return numbers.dtype.kind not in "fc" or bool(np.isfinite(numbers).all())


def _value(answer: Answer, field: Field) -> Any:
    """Return the answer for a field; None for an optional one that is not answered, or by NaN throughout."""
    if not hasattr(answer, field.name):
        if field.optional:
            return None
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
    if field.optional and not isinstance(value, str) and np.isnan(np.asarray(value, dtype=float)).all():
        return None
    return value
