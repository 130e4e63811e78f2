"""Lines that `palpate touch` and `palpate sweep --until` print of an improvement, and the error at its end."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import AccuracyError, UsageError
from palpate.format import count, duration, share
from palpate.units import parse_quantity

if TYPE_CHECKING:
    from palpate.cli.console import Console
    from palpate.improvement import ImprovementStep
    from palpate.study import Study
    from palpate.study.run import Outcome, Paths
    from palpate.sweeps import Scheduler

__all__ = ["improve_and_print", "improve_file", "share_of", "step_line"]


def improve_file(
    file: Path,
    until: str,
    minutes: float | None,
    samples: int | None,
    workers: int | None,
    scheduler: Scheduler | None,
    console: Console,
    *,
    case_limit: float,
) -> None:
    """Choose the solves of a study file until a force error, such as "2%", is kept, and print where everything is.

    `samples` are at most learnt from; a single solve has failed after `case_limit` seconds. It is solved on the
    scheduler, else on so many workers of this machine, by default those of the study. An `AccuracyError`, if the error
    was not reached, comes after everything has been kept and printed.
    """
    from palpate.study import read_study
    from palpate.study.run import Paths

    with console.patience(f"Reading {file}"):
        record = read_study(file).with_workers(workers)
    paths = Paths(file.parent, record.name)
    options: dict[str, Any] = {"cluster": scheduler, "case_limit": case_limit}
    if samples is not None:
        options["most"] = samples
    limit = math.inf if minutes is None else 60.0 * minutes
    outcome, content, failure = improve_and_print(record, paths, share_of(until), limit, console, **options)
    lines = [
        content["reason"],
        f"{paths.data}: {count(len(outcome.train), 'solve')} to learn from",
        f"{paths.random}: {count(len(outcome.test), 'unseen solve')}",
        f"{paths.model}",
    ]
    files = {"data": str(paths.data), "random": str(paths.random)}
    console.result("\n".join(lines), content | files | {"passed": outcome.validation.passed})
    console.say(f"Next: palpate validate {file}, palpate view {paths.model}")
    if failure is not None:
        raise failure


def improve_and_print(
    study: Study, paths: Paths, until: float, limit: float, console: Console, **options: Any
) -> tuple[Outcome, dict[str, Any], AccuracyError | None]:
    """Improve a study of a body under a probe, and print a line for each surrogate.

    `until` is the wanted relative force error, `limit` the time in s after which no further batch begins; the options
    are further ones of `improve_study`. Returned are the study with its last surrogate, the steps and files for JSON,
    and the error to raise where the wanted one was not reached.
    """
    from palpate.study.improve_study import conclude, improve_study

    steps: list[dict[str, Any]] = []
    last: ImprovementStep | None = None
    console.say("Starting …")
    for step in improve_study(
        study,
        paths,
        until=until,
        limit=limit,
        progress=not console.as_json,
        log=lambda stage: console.say(f"{stage} …"),
        **options,
    ):
        last = step
        # a surrogate of an earlier run is told once, when it is judged
        if step.phase == "judged" or (step.phase == "learnt" and (steps or not step.unseen)):
            console.say(step_line(step))
            if step.unseen:
                steps.append({"solves": step.solves, "force_p95": step.error, "seconds": step.seconds})
    assert last is not None
    outcome = conclude(study, paths, last)
    content = {"steps": steps, "reached": last.reached, "reason": last.reason, "model": str(paths.model)}
    return outcome, content, None if last.reached else _failure(study, until, last)


def step_line(step: Any) -> str:
    """Return the figures of an `ImprovementStep` as a line."""
    if not step.unseen or math.isnan(step.error):
        return f"{count(step.solves, 'solve')}: a first surrogate, not judged yet, after {duration(step.seconds)}"
    kept = "" if step.is_new or step.phase == "judged" else "; the surrogate before is better and stays"
    return (
        f"{step.solves} solves: force error {share(step.median)} at the median, {share(step.error)} at the 95th "
        f"percentile of {count(step.unseen, 'unseen solve')}, after {duration(step.seconds)}{kept}"
    )


def _failure(study: Study, until: float, last: ImprovementStep) -> AccuracyError:
    return AccuracyError(
        f"The force error of {study.name} is {share(last.error)} after {last.solves} solves, not {share(until)}.",
        why=f"{last.reason} Everything is kept.",
        fix="Run the same command again, which goes on, with more --minutes or a larger --until.",
    )


def share_of(text: str) -> float:
    """Return a share: of "2%" 0.02."""
    value = parse_quantity(text, "", "--until")
    if 0 < value < 1:
        return value
    raise UsageError(f"--until: {text!r} is no force error.", fix="Give a share such as 2% or 0.02.")
