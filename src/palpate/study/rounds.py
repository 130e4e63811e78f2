"""Rounds of a study: sweep, learn and validate with more and more solves, until a force error is reached."""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from palpate.dataset import Dataset
from palpate.errors import FileFormatError, UsageError
from palpate.study.run import (
    Log,
    Outcome,
    Paths,
    learn_study,
    load_model,
    save_model,
    split_rows,
    sweep_study,
    validate_study,
    with_validation,
)
from palpate.study.study import Study
from palpate.study.study_advice import earlier_curve
from palpate.sweeps import is_begun

__all__ = ["ROUNDS", "Round", "improve_in_rounds"]

ROUNDS = (12, 24, 48, 96, 192, 384)
"""Solves to learn from, round by round."""


@dataclass(frozen=True, eq=False)
class Round:
    """Result of one round.

    Attributes
    ----------
    solves : int
        Solves to learn from.
    outcome : Outcome
        The study carried out with them.
    error : float
        Force error at the 95th percentile of the unseen solves, relative; not-a-number where none was strong enough.
    seconds : float
        Time since the first round began.
    """

    solves: int
    outcome: Outcome
    error: float
    seconds: float


def improve_in_rounds(
    study: Study,
    paths: Paths,
    *,
    until: float,
    limit: float,
    rounds: Sequence[int] = ROUNDS,
    cluster: Any = None,
    progress: Any = True,
    log: Log = lambda _: None,
) -> Iterator[Round]:
    """Yield the result of each round; the last one keeps the force error, or is the last that the limits allow.

    Everything is kept as files of the study, so that a later call goes on where this one stopped; the surrogate of each
    round stays as ``NAME-SOLVES.palpate``.

    Parameters
    ----------
    study : Study
        A study of a solid body under a probe.
    paths : Paths
        Where the files are.
    until : float
        Relative force error at the 95th percentile that ends the rounds.
    limit : float
        Time in s after which no further round begins.
    rounds : sequence of int
        Solves to learn from, round by round; those with fewer than are solved already are left out.
    cluster : optional
        A running `local_cluster`.
    progress : bool or callable
        Of each sweep: a bar on standard error, or a function (done, total).
    log : callable
        Gets one line when a part of the work begins.
    """
    began = time.monotonic()
    known = _solves_so_far(study, paths, rounds)
    for solves in [n for n in rounds if n >= known] or [known]:
        record = study.with_samples(solves)
        log(f"round with {solves} solves")
        data, further = sweep_study(record, paths, cluster=cluster, progress=progress, log=log)
        train, test = split_rows(record, data, further)
        model, history = _learnt(record, paths, train, test, log)
        validation = validate_study(record, model, test, history)
        curve = earlier_curve(paths, record.name)
        model = with_validation(model, validation, curve, len(train))
        save_model(paths, model, history)
        shutil.copyfile(paths.model, paths.model.with_name(f"{record.name}-{solves}.palpate"))
        error = validation.force.p95 if validation.force is not None else None
        seconds = time.monotonic() - began
        outcome = Outcome(record, model, train, test, validation, history)
        yield Round(solves, outcome, math.nan if error is None else float(error), seconds)
        if (error is not None and error <= until) or seconds > limit:
            return


def _solves_so_far(study: Study, paths: Paths, rounds: Sequence[int]) -> int:
    """Return the number of solves of the round that was interrupted, else of the sweep that is finished."""
    if paths.data.with_name(f"{paths.data.name}.parts").exists():
        problem = study.problem()
        for solves in rounds:
            wanted = study.with_samples(solves).sweep
            if wanted is not None and is_begun(paths.data, problem, wanted.arguments(problem)):
                return solves
    return len(Dataset.open(paths.data)) if paths.data.exists() else 0


def _learnt(record: Study, paths: Paths, train: Any, test: Any, log: Log) -> tuple[Any, Any]:
    """Return what was learnt from these rows before, else learn it now."""
    if paths.model.exists():
        try:
            return load_model(paths, train)
        except (UsageError, FileFormatError):
            pass
    return learn_study(record, train, test, log=log)
