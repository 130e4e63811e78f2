"""Lines that `palpate touch` and `palpate sweep --until` print of an improvement, and the error at its end."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli.verdict_lines import verdict_text
from palpate.errors import AccuracyError
from palpate.format import count, duration, share

if TYPE_CHECKING:
    from palpate.cli.console import Console
    from palpate.improvement import ImprovementStep
    from palpate.options import ImprovementOptions
    from palpate.study import Study
    from palpate.study.run import Outcome, Paths
    from palpate.sweeps import JobQueue, Scheduler

__all__ = ["improve_and_print", "improve_file", "mesh_in_words", "step_line", "trial_in_words"]


def improve_file(
    file: Path,
    options: ImprovementOptions,
    scheduler: Scheduler | JobQueue | None,
    console: Console,
    *,
    refine: bool = False,
) -> None:
    """Choose the solves of a study file until a force error, such as "2%", is kept, and print where everything is.

    With `refine` finer solves decide the elements' size first.
    They are solved on a running scheduler, where there is one. Everything has been kept and printed when an
    `AccuracyError` says that the force error was not reached.
    """
    from palpate.cli.study_commands import refine_elements
    from palpate.study import read_study
    from palpate.study.run import Paths
    from palpate.study.study_lock import hold_study

    with console.patience(f"Reading {file}"):
        record = read_study(file).with_workers(options.workers)
    paths = Paths(file.parent, record.name)
    with hold_study(paths, "palpate sweep"):
        if refine:
            record = refine_elements(record, file, console, workers=options.workers, scheduler=scheduler)
        outcome, content, failure = improve_and_print(record, paths, options, console, cluster=scheduler)
    lines = [] if failure is not None else [content["reason"]]  # which the error says too
    lines.append(
        f"solves  {paths.data} ({len(outcome.train)} to learn from), {paths.random} ({len(outcome.test)} unseen)"
    )
    then = f"palpate view {paths.model}, palpate validate {file}"
    lines.append(verdict_text([outcome.validation], console, report=None, next_step=then))
    files = {"data": str(paths.data), "random": str(paths.random)}
    console.result("\n".join(lines), content | files | {"passed": outcome.validation.passed})
    if failure is not None:
        raise failure


def improve_and_print(
    study: Study, paths: Paths, options: ImprovementOptions, console: Console, *, cluster: Any = None
) -> tuple[Outcome, dict[str, Any], AccuracyError | None]:
    """Improve a study of a body under a probe, and print a line for each surrogate.

    Returns the study with its last surrogate, the steps and the files for JSON, and the error to raise where the wanted
    force error was not reached.
    """
    from palpate.study.improve_study import conclude, improve_study

    steps: list[dict[str, Any]] = []
    last: ImprovementStep | None = None
    console.say("Starting …")
    for step in improve_study(
        study,
        paths,
        options=options,
        cluster=cluster,
        progress=not console.as_json,
        log=lambda stage: console.say(f"{stage} …"),
    ):
        last = step
        # a surrogate of an earlier run is told once, when it is judged
        if step.phase == "judged" or (step.phase == "learnt" and (steps or not step.unseen)):
            console.say(step_line(step))
            if step.unseen:
                figures = {"solves": step.solves, "force_p95": step.error, "seconds": step.seconds}
                steps.append(figures | ({} if math.isnan(step.mesh) else {"mesh_part": step.mesh}))
    assert last is not None
    outcome = conclude(study, paths, last)
    content = {"steps": steps, "reached": last.reached, "reason": last.reason, "model": str(paths.model)}
    content |= outcome.model.meta.get("painted", {})  # areas in m²
    if (part := outcome.validation.mesh_part) is not None:
        content |= {"mesh_part": part, "whole_force_p95": outcome.validation.whole_force_error}
    return outcome, content, None if last.reached else _failure(study, options.until, last)


def step_line(step: Any) -> str:
    """Return the figures of an `ImprovementStep` as a line."""
    if not step.unseen or math.isnan(step.error):
        return f"{count(step.solves, 'solve')}: a first surrogate, not judged yet, after {duration(step.seconds)}"
    trial = "".join(f"; {words}" for words in (trial_in_words(step), mesh_in_words(step)) if words)
    return (
        f"{step.solves} solves: force error {share(step.median)} at the median, {share(step.error)} at the 95th "
        f"percentile of {count(step.unseen, 'unseen solve')}, after {duration(step.seconds)}{trial}"
    )


def trial_in_words(step: Any) -> str:
    """Return how a new surrogate compares with the one before it, and which was kept; "" where none was compared."""
    if math.isnan(step.before) or math.isnan(step.tried):
        return ""
    same = f"on the same {count(step.unseen, 'unseen solve')}"
    if not step.is_new:
        return f"kept, since a new one has {share(step.tried)}, not {share(step.before)}, {same}"
    verb = "improved" if step.tried < step.before else "replaced"
    return f"{verb}: {share(step.before)} → {share(step.tried)} {same}"


def mesh_in_words(step: Any) -> str:
    """Return the force error with the mesh's part of it; "" where no finer mesh was solved."""
    from palpate.validation.verdict import whole_error_in_words

    return whole_error_in_words(step.error + step.mesh, step.mesh)


def _failure(study: Study, until: float, last: ImprovementStep) -> AccuracyError:
    return AccuracyError(
        f"The force error of {study.name} is {share(last.error)} after {last.solves} solves, not {share(until)}.",
        why=f"{last.reason} Everything is kept.",
        fix="Run the same command again, which goes on, with more --minutes or a larger --until.",
    )
