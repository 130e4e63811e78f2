"""A study whose solves are chosen batch by batch, until a force error is reached; everything is kept in its files."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from palpate.dataset import Dataset
from palpate.errors import FileFormatError, UsageError
from palpate.files import restore_folder
from palpate.improvement import ImprovementStep, improve
from palpate.improvement.improve import Interest
from palpate.options import ImprovementOptions, takes
from palpate.study.mesh_check import load_finer, mesh_part, solve_finer
from palpate.study.run import (
    Log,
    Outcome,
    Paths,
    learn_study,
    load_model,
    save_model,
    split_rows,
    validate_study,
    with_validation,
)
from palpate.study.stage_records import PressSweepRecord
from palpate.study.study import Study
from palpate.study.study_advice import earlier_curve
from palpate.sweeps import local_cluster

__all__ = ["conclude", "improve_study"]


@takes(ImprovementOptions)
def improve_study(
    study: Study,
    paths: Paths,
    *,
    cluster: Any = None,
    interest: Interest | None = None,
    progress: Any = True,
    log: Log = lambda _: None,
    options: ImprovementOptions,
) -> Iterator[ImprovementStep]:
    """Yield each step of `palpate.improve` for a study; its solves and surrogates are kept as the study's files.

    A later call goes on where this one stopped, from whatever solves the study has. The surrogate of each step stays as
    ``NAME-SOLVES.palpate``, and the newest as ``NAME.palpate``; a step tells its file as `model_path`. All solves that
    ``[test]`` asks for have judged the surrogate by the time its error counts as reached. Some of these are solved on
    finer elements too, once a first surrogate is judged: each step then tells the mesh's part in the error.

    Seed and workers are those of the study. `interest` takes inputs (C, n) of places and returns how much an error
    there counts, (C,), such as where a hand goes. `progress` is of each batch.
    """
    if not isinstance(study.sweep, PressSweepRecord) or study.test is None:
        raise UsageError(
            f"The solves of {study.name!r} can't be chosen one by one.",
            why="That takes a solid body under a probe, whose force is learnt from each place.",
            fix="Leave --until out; --samples asks for a number of solves.",
        )
    problem = study.problem()
    wanted = study.test.arguments(problem)
    assert wanted is not None  # a probe's test is never empty
    restore_folder(paths.data)
    finished = Dataset.open(paths.data).ok if paths.data.exists() else None
    with contextlib.ExitStack() as stack:
        if cluster is None:
            cluster = study.sweep.scheduler or stack.enter_context(local_cluster(study.sweep.workers))
        steps = improve(
            problem,
            options=replace(options, seed=study.sweep.seed, workers=study.sweep.workers),
            unseen=wanted["points"],
            path=paths.data,
            unseen_path=paths.random,
            learner=lambda data, effort: learn_study(_with_effort(study, effort), data, log=log),
            known=_known(paths, finished),
            cluster=cluster,
            interest=interest,
            progress=progress,
            log=log,
        )
        finer, is_asked = load_finer(study, paths), False
        for step in steps:
            # two or three touches that tell of the mesh: as soon as there are others to compare with, and time
            if step.phase == "judged" and not is_asked and step.seconds < options.limit:
                is_asked = True
                solving = {"cluster": cluster, "progress": progress is True, "log": log}
                finer = solve_finer(study, paths, step.test, case_limit=options.case_limit, **solving)
            part = mesh_part(step.test, finer)
            yield replace(step, model_path=_keep(study, paths, step), mesh=part)


def conclude(study: Study, paths: Paths, step: ImprovementStep) -> Outcome:
    """Judge the surrogate of the last step by all of the study's targets, and write that into its file."""
    if step.surrogate is None or step.train is None or step.test is None:
        raise UsageError("This step has no solves yet.", fix="Conclude with the last step.")
    train, test = split_rows(study, step.train, step.test)
    validation = validate_study(study, step.surrogate, test, step.history, load_finer(study, paths))
    surrogate = step.surrogate
    origin = surrogate.meta.get("dataset", {})
    if step.phase != "solved" and origin.get("hash") != train.hash:
        # a surrogate of all solves was learnt, and was worse; this one of fewer has not seen the unseen ones either
        surrogate = replace(
            surrogate, meta={**surrogate.meta, "dataset": {**origin, "no_better": train.hash}}
        )
    model = with_validation(surrogate, validation, earlier_curve(paths, study.name), step.solves)
    save_model(paths, model, step.history)
    return Outcome(study, model, train, test, validation, step.history)


def _with_effort(study: Study, effort: float) -> Study:
    """Return the study with its own effort multiplied."""
    assert study.learning is not None
    own: float = getattr(study.learning, "effort", 1.0)
    return study.model_copy(update={"learning": study.learning.model_copy(update={"effort": effort * own})})


def _known(paths: Paths, train: Dataset | None) -> tuple[Any, Any] | None:
    """Return the surrogate that was learnt from just these solves, if there is one."""
    if train is None or not paths.model.exists():
        return None
    try:
        return load_model(paths, train)
    except (UsageError, FileFormatError):
        return None


def _keep(study: Study, paths: Paths, step: ImprovementStep) -> Any:
    """Write a new surrogate with its learning curve, and return the file of the newest one."""
    if step.is_new and step.surrogate is not None:
        point = {"solves": step.solves, "force_median": step.median, "force_p95": step.error}
        curve = [p for p in earlier_curve(paths, study.name) if p["solves"] != step.solves]
        if step.unseen:
            curve = sorted([*curve, point], key=lambda p: int(p["solves"]))
        model = replace(step.surrogate, meta={**step.surrogate.meta, "learning_curve": curve})
        save_model(paths, model, step.history)
        shutil.copyfile(paths.model, paths.model.with_name(f"{study.name}-{step.solves}.palpate"))
    return paths.model if paths.model.exists() else None
