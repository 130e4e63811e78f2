"""Telling a person how far a sweep is."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

__all__ = ["Report", "reporter"]

Report = Callable[[int, int], None]
"""Called with the number of samples done and of all."""


@contextlib.contextmanager
def reporter(progress: bool | Report) -> Iterator[Report]:
    """Yield what to call: the caller's function, a bar on standard error if it is a terminal, or a no-op."""
    if callable(progress):
        yield progress
    elif progress and sys.stderr.isatty():
        with _bar() as report:
            yield report
    else:
        yield _silent


def _silent(done: int, total: int) -> None:
    """Report to nobody."""


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
