"""Telling a person how far a sweep is."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from time import monotonic

__all__ = ["Report", "reporter"]

SELDOM = 10.0  # s between two lines in a log

Report = Callable[[int, int], None]
"""Called with the number of samples done and of all."""


@contextlib.contextmanager
def reporter(progress: bool | Report) -> Iterator[Report]:
    """Yield what to call: the caller's function, a bar in a terminal, else a line on standard error now and then."""
    if callable(progress):
        yield progress
    elif progress and sys.stderr.isatty():
        with _bar() as report:
            yield report
    elif progress:
        yield _lines()
    else:
        yield _silent


def _silent(done: int, total: int) -> None:
    """Report to nobody."""


def _lines() -> Report:
    """For a log: a line every so often, and at the end of what took that long."""
    last, before = monotonic(), -1

    def report(done: int, total: int) -> None:
        nonlocal last, before
        late = monotonic() - last > SELDOM
        if late or (done == total and 0 <= before < total):
            print(f"solved {done} of {total}", file=sys.stderr, flush=True)  # noqa: T201
            last, before = monotonic(), done

    return report


@contextlib.contextmanager
def _bar() -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    columns = (TextColumn("solving"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task: TaskID | None = None

        def report(done: int, total: int) -> None:
            nonlocal task
            if (
                task is None
            ):  # rows that an earlier run finished are there from the start: no part of the speed
                task = bar.add_task("solving", total=total, completed=done)
            else:
                bar.update(task, completed=done, total=total)

        yield report
