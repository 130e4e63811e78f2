"""A study carried out: body → sweep → dataset → learning → model → validation → report.

With the stages of each kind of body the only place that knows all of palpate's islands. Each stage takes values and
returns values; files are written by `carry_out` and by the command line.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate import __version__
from palpate.dataset import Dataset
from palpate.study.models import Study
from palpate.study.paths import Paths
from palpate.study.stages import AnyStudy, Rows, stages_of
from palpate.validation import write_report

__all__ = [
    "Outcome",
    "Paths",
    "carry_out",
    "judged",
    "learn_study",
    "report_study",
    "sweep_study",
    "validate_study",
]

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What carrying out a study gave.

    Attributes
    ----------
    study : Study, TouchStudy or HeldStudy
    touch : TouchModel, TouchedBody or HeldBody
    train, test : Dataset or HeldPaths
    validation : Validation, SurrogateValidation or HeldValidation
    history : History, TouchHistory, Fit or None
    rivals : mapping of name to History
        The founding form beside ours, for studies with one input.
    timings : mapping of stage to seconds
    """

    study: AnyStudy
    touch: Any
    train: Rows
    test: Rows
    validation: Any
    history: Any = None
    rivals: Mapping[str, Any] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)

    def chapter(self) -> Any:
        """The outcome as a chapter of a report."""
        return stages_of(self.study).chapter(self)


def sweep_study(
    study: AnyStudy, paths: Paths | None = None, *, cluster: Any = None, progress: Any = True
) -> tuple[Dataset, Dataset | None]:
    """Solve the study's design, and what is solved for testing only.

    With `paths` given both are written as they grow, and an interrupted sweep goes on where it stopped.

    Raises
    ------
    SolverError
        If more than half of the solves fail.
    UsageError
        If another study's dataset is in the way.
    """
    return stages_of(study).swept(study, paths, cluster, progress)


def learn_study(
    study: AnyStudy,
    train: Dataset,
    test: Dataset | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    say: Say = lambda _: None,
) -> tuple[Any, Any]:
    """Learn the study's model; `test` is only watched. The model remembers the study's runtime settings."""
    return stages_of(study).learnt(study, train, test, progress, say)


def validate_study(study: AnyStudy, touch: Any, test: Dataset, history: Any = None) -> Any:
    """Judge the model on solves it has never seen, by the study's targets."""
    return stages_of(study).validated(study, touch, test, history)


def judged(study: AnyStudy, touch: Any, validation: Any) -> Any:
    """The model with its errors on unseen solves written into it, for whoever opens the file later."""
    return stages_of(study).judged(touch, validation)


def report_study(path: Path, outcomes: Sequence[Outcome], **options: Any) -> Path:
    """Write one report on several outcomes."""
    return write_report(path, [o.chapter() for o in outcomes], machine=_machine(), **options)


def _machine() -> dict[str, str]:
    """What the report says of where it was made."""
    return {
        "system": f"{platform.system()} {platform.release()}",
        "processor": f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores",
        "Python": platform.python_version(),
        "palpate": __version__,
    }


def carry_out(
    study: AnyStudy,
    paths: Paths,
    *,
    cluster: Any = None,
    progress: Any = True,
    say: Say = lambda _: None,
    rivals: bool = True,
) -> Outcome:
    """Carry out a study up to its validation and write its datasets, model and history.

    Parameters
    ----------
    study : Study, TouchStudy or HeldStudy
    paths : Paths
    cluster : optional
        A running `local_cluster`, to share between studies.
    progress : bool or callable
        For the sweep.
    say : callable
        Told what begins, as one line.
    rivals : bool
        Whether to run the founding form beside ours.
    """
    timings: dict[str, float] = {}

    def timed(stage: str, work: Callable[[], Any]) -> Any:
        say(stage)
        began = time.perf_counter()
        result = work()
        timings[stage] = time.perf_counter() - began
        return result

    stages = stages_of(study)
    data, random = timed("sweep", lambda: stages.swept(study, paths, cluster, progress))
    train, test = stages.train_and_test(study, data, random)
    touch, history = timed("learn and refine", lambda: stages.learnt(study, train, test, None, _silent))
    validation = timed("validate", lambda: stages.validated(study, touch, test, history))
    touch = stages.judged(touch, validation)
    stages.save(paths, touch, history)
    others: dict[str, Any] = {}
    if rivals and isinstance(study, Study):
        others = timed("founding form", lambda: stages.rivals(study, train, test, history))
    return Outcome(study, touch, train, test, validation, history, others, timings)


def _silent(_: str) -> None:
    """Nobody is told."""
