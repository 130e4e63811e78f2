"""A study carried out: body → sweep → dataset → learning → model → validation → report.

The only module that knows all of palpate's islands. Each stage takes values and returns values; files are
written by `carry_out` and by the command line.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palpate import __version__
from palpate.dataset import Dataset
from palpate.learning import History, Settings, founding, learn_touch, node_outputs
from palpate.learning import learn as learn_samples
from palpate.study.build import body_of, loads_of, settings_of
from palpate.study.models import Study
from palpate.study.rows import train_and_test
from palpate.surrogates import TouchModel
from palpate.sweeps import sweep
from palpate.validation import Chapter, Limits, Validation, validate, write_report

__all__ = [
    "Outcome",
    "Paths",
    "carry_out",
    "judged",
    "learn_study",
    "report_study",
    "rivals_of",
    "sweep_study",
    "validate_study",
]

Say = Callable[[str], None]


@dataclass(frozen=True)
class Paths:
    """Where a study's files are: all named after the study, in one folder."""

    folder: Path
    name: str

    @property
    def data(self) -> Path:
        """The sweep's dataset."""
        return self.folder / f"{self.name}.zarr"

    @property
    def random(self) -> Path:
        """The dataset of random loads, for testing only."""
        return self.folder / f"{self.name}-random.zarr"

    @property
    def model(self) -> Path:
        """The touch model."""
        return self.folder / f"{self.name}.palpate"

    @property
    def history(self) -> Path:
        """What happened while it was learnt."""
        return self.folder / f"{self.name}.history.npz"

    @property
    def report(self) -> Path:
        """The report."""
        return self.folder / f"{self.name}.html"


@dataclass(frozen=True, eq=False)
class Outcome:
    """What carrying out a study gave.

    Attributes
    ----------
    study : Study
    touch : TouchModel
    train, test : Dataset
    validation : Validation
    history : History
    rivals : mapping of name to History
        The founding form beside ours, for studies with one input.
    timings : mapping of stage to seconds
    """

    study: Study
    touch: TouchModel
    train: Dataset
    test: Dataset
    validation: Validation
    history: History
    rivals: Mapping[str, History] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)

    def chapter(self) -> Chapter:
        """The outcome as a chapter of a report."""
        return Chapter(
            name=self.study.name,
            touch=self.touch,
            train=self.train,
            test=self.test,
            validation=self.validation,
            history=self.history,
            rivals=self.rivals,
            settings=self.study.model_dump(mode="json"),
            timings=self.timings,
        )


def sweep_study(
    study: Study, paths: Paths | None = None, *, cluster: Any = None, progress: Any = True
) -> tuple[Dataset, Dataset | None]:
    """Solve the study's design, and its random test loads.

    With `paths` given both are written as they grow, and an interrupted sweep goes on where it stopped.

    Raises
    ------
    SolverError
        If more than half of the solves fail.
    UsageError
        If another study's dataset is in the way.
    """
    common: dict[str, Any] = {
        "cluster": cluster if cluster is not None else study.sweep.scheduler,
        "workers": study.sweep.workers,
        "progress": progress,
    }
    body, loads = body_of(study), loads_of(study)
    data = sweep(
        body,
        loads,
        samples=study.sweep.samples,
        seed=study.sweep.seed,
        design=study.sweep.design,
        path=paths.data if paths else None,
        **common,
    )
    if not study.test.random:
        return data, None
    extra = sweep(
        body,
        loads,
        samples=study.test.random,
        seed=study.test.seed,
        design="random",
        path=paths.random if paths else None,
        **common,
    )
    return data, extra


def learn_study(
    study: Study,
    train: Dataset,
    test: Dataset | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[TouchModel, History]:
    """Learn the study's touch model; `test` is only watched. The model remembers the study's runtime settings."""
    touch, history = learn_touch(
        train,
        heldout=test,
        name=study.name,
        settings=settings_of(study),
        refinement=study.learning.refinement(),
        passes=study.filter.passes,
        seed=study.filter.seed,
        coupling=study.learning.coupling,
        progress=progress,
    )
    return replace(touch, meta={**touch.meta, "runtime": study.runtime.model_dump()}), history


def rivals_of(study: Study, train: Dataset, test: Dataset, passes: int) -> dict[str, History]:
    """Founding form and ours with thresholds as they are and ten times tighter, for studies of one input."""
    if len(train.ranges) != 1:
        return {}
    forms = {
        "founding form": founding(),
        "founding form, thresholds ÷ 10": tightened(founding()),
        "our form, thresholds ÷ 10": tightened(settings_of(study)),
    }
    outputs, columns = node_outputs(train)
    answers = [d.displacement[:, [i for i, _ in columns], [c for _, c in columns]] for d in (train, test)]
    return {
        name: learn_samples(
            train.X,
            answers[0],
            train.ranges,
            outputs,
            settings=settings,
            passes=passes,
            seed=study.filter.seed,
            heldout=(test.X, answers[1]),
        ).history
        for name, settings in forms.items()
    }


def tightened(settings: Settings) -> Settings:
    """Growth thresholds divided by ten: what a user does who wants more accuracy."""
    return replace(
        settings,
        error_min=settings.error_min / 10,
        error_rms_min=settings.error_rms_min / 10,
        distance_min=settings.distance_min / 10,
    )


def validate_study(
    study: Study, touch: TouchModel, test: Dataset, history: History | None = None
) -> Validation:
    """Judge the model on solves it has never seen, by the study's targets."""
    t = study.target
    limits = Limits(
        rmse=t.rmse,
        filter_rmse=t.filter_rmse or None,
        filter_outer_ratio=t.filter_outer_ratio or None,
        filter_relapse=t.filter_relapse or None,
        force_median=t.force_median,
        force_p95=t.force_p95,
    )
    return validate(touch, test, history=history, limits=limits)


def judged(touch: TouchModel, validation: Validation) -> TouchModel:
    """The model with its errors on unseen solves written into it, for whoever opens the file later."""
    refined = validation.networks["refined"]
    errors = {
        "unseen solves": validation.samples,
        "displacement RMSE / full scale": refined.relative,
        "force error, median": validation.force.median,
        "force error, 95th percentile": validation.force.p95,
        "limits kept": validation.passed,
    }
    return replace(touch, meta={**touch.meta, "validation": errors})


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
    study: Study,
    paths: Paths,
    *,
    cluster: Any = None,
    progress: Any = True,
    say: Say = lambda _: None,
    rivals: bool = True,
) -> Outcome:
    """Carry out a study up to its validation and write its dataset, model and history.

    Parameters
    ----------
    study : Study
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

    data, random = timed("sweep", lambda: sweep_study(study, paths, cluster=cluster, progress=progress))
    train, test = train_and_test(study, data, random)
    touch, history = timed("learn and refine", lambda: learn_study(study, train, test))
    history.save(paths.history)
    validation = timed("validate", lambda: validate_study(study, touch, test, history))
    touch = judged(touch, validation)
    touch.save(paths.model)
    others = timed("founding form", lambda: rivals_of(study, train, test, history.passes)) if rivals else {}
    return Outcome(study, touch, train, test, validation, history, others, timings)
