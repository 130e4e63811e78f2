"""The stages of a study: sweep, load the data, learn, validate, report.

Each stage takes values and returns values, and is the same for every body: `Study` says what differs. Files are
written by `carry_out` and by the command line.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.format import count
from palpate.learning import History, Settings, founding, learn_dataset, node_outputs
from palpate.learning import learn as learn_samples
from palpate.learning.learn_dataset import LearningHistory, filter_record
from palpate.learning.loading import load_histories
from palpate.processes import CASE_LIMIT
from palpate.study.memory_kind import sweep_histories, with_elastic
from palpate.study.mesh_check import load_finer, solve_finer
from palpate.study.relaxation_stage import with_relaxation
from palpate.study.study import Study
from palpate.study.study_paths import Paths
from palpate.surrogates import Surrogate
from palpate.sweeps import OnDemandCluster, grow, sweep
from palpate.sweeps.grow_sweep import CHOSEN
from palpate.validation import Chapter, Validation, validate, write_report
from palpate.validation.more_solves import learning_curve
from palpate.validation.touch_comparison import TouchComparison

__all__ = [
    "Outcome",
    "Paths",
    "carry_out",
    "learn_study",
    "load_data",
    "load_model",
    "report_study",
    "save_model",
    "split_rows",
    "sweep_study",
    "validate_study",
    "with_validation",
]

Log = Callable[[str], None]
Record: TypeAlias = LearningHistory | History
"""Record of learning: all of it, or that of the sequential filter, which a file keeps."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a study that was carried out."""

    study: Study
    model: Surrogate  # with its errors on unseen solves written into it
    train: Dataset  # solves that were learnt from
    test: Dataset  # solves that were not
    validation: Validation  # figures of the surrogate on the unseen solves
    history: Record | None = None  # record of learning
    # the founding form of the filter beside ours, by name, for studies with one input
    rivals: Mapping[str, Any] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)  # duration of each stage in s
    comparisons: Sequence[TouchComparison] = ()  # recorded touches beside the full model

    def chapter(self) -> Chapter:
        """Return the outcome as a chapter of a report."""
        from palpate.study.study_advice import advice_after

        file = Path(f"{self.study.name}.toml")
        return Chapter(
            name=self.study.name,
            model=self.model,
            test=self.test,
            validation=self.validation,
            train=self.train,
            history=self.history,
            rivals=self.rivals,
            settings=self.study.model_dump(mode="json", exclude_none=True),
            timings=self.timings,
            comparisons=self.comparisons,
            advice=advice_after(self.study, self.model, self.train, self.validation, file),
        )


def sweep_study(
    study: Study,
    paths: Paths | None = None,
    *,
    cluster: Any = None,
    progress: Any = True,
    case_limit: float = CASE_LIMIT,
    log: Log = lambda _: None,
) -> tuple[Dataset, Dataset | None]:
    """Solve the study's design, and what is solved for testing only.

    Datasets are written to `paths` as they grow, and an interrupted sweep goes on where it stopped. A solve has
    failed after `case_limit` s; SolverError if more than half fail. The second result is None where nothing more is
    solved for testing. Without `cluster`, processes of its own serve both sweeps.
    """
    problem = study.problem()
    if study.sweep is None or study.test is None:
        train, test = sweep_histories(study, problem)
        if paths is not None:
            train.save(paths.data, overwrite=True)
            test.save(paths.random, overwrite=True)
        return train, test
    with contextlib.ExitStack() as stack:
        if cluster is None:
            # one for both sweeps: to start workers takes seconds, and so does to open a body
            own = OnDemandCluster(study.sweep.workers)
            cluster = study.sweep.scheduler or stack.enter_context(own)
        common: dict[str, Any] = {"cluster": cluster, "progress": progress, "case_limit": case_limit}
        log(f"{count(study.sweep.samples, 'solve')} to learn from{_solved_part(study, problem)}")
        wanted = study.sweep.arguments(problem)
        data = grow(paths.data, problem, wanted) if paths else None
        if data is None:
            data = sweep(problem, path=paths.data if paths else None, **wanted, **common)
        elif paths and data.provenance.get("design") == CHOSEN:
            log(f"{paths.data} holds {count(len(data), 'solve')} that were chosen; they stay as they are")
        further = study.test.arguments(problem)
        if further is None:
            return data, None
        log("further solves for testing only, which learning never sees")
        unseen = grow(paths.random, problem, further) if paths else None
        if unseen is None:
            unseen = sweep(problem, path=paths.random if paths else None, **further, **common)
        if paths is not None:
            solve_finer(study, paths, unseen, log=log, **common)
        return data, unseen


def _solved_part(study: Study, problem: Any) -> str:
    """Return in words that only a part of the touched surface is solved, where symmetry gives the rest."""
    given = getattr(problem, "symmetry", None)
    images = len(given["isometries"]) if given and study.sweep and study.sweep.symmetric else 1
    if images < 2:
        return ""
    return f"; the body is symmetric, so only a part of it is touched, and a solve stands for up to {images} places"


def load_data(study: Study, paths: Paths) -> tuple[Dataset, Dataset]:
    """Read the training and the unseen rows of a study from its files.

    Files of another body or of other loads are refused: the study was changed since they were solved.
    """
    if study.test is None and not paths.data.exists() and paths.histories.exists():
        return load_histories(paths.histories), load_histories(paths.unseen_histories)
    problem = study.problem()
    # compared as the file has it: tuples are lists there
    wanted = json.loads(json.dumps(problem.describe()))
    further = None if study.test is not None and study.test.arguments(problem) is None else paths.random
    parts = []
    for path in filter(None, (paths.data, further)):
        parts.append(Dataset.open(path))
        if parts[-1].provenance["problem"] != wanted:
            raise UsageError(
                f"{path} is not of this study's body and loads.",
                why="The study was changed after the sweep.",
                fix="Delete it and run `palpate sweep`, or give the changed study another name.",
            )
    return split_rows(study, parts[0], parts[1] if further else None)


def split_rows(study: Study, data: Dataset, further: Dataset | None) -> tuple[Dataset, Dataset]:
    """Split what was solved into training rows and rows that the network never sees."""
    good = data.ok
    parts = [] if further is None else [further.ok]
    if study.test is not None and study.test.every:
        unseen = _unseen_rows(study, len(good), study.test.every)
        parts.insert(0, good.take(np.flatnonzero(unseen)))
        good = good.take(np.flatnonzero(~unseen))
    if not parts:
        raise UsageError(
            f"The study {study.name!r} keeps nothing for testing.",
            why="Both test.every and test.random are 0.",
            fix="Set one of them: a network is judged on solves that it has never seen.",
        )
    return good, Dataset.concat(parts)


def _unseen_rows(study: Study, count: int, every: int) -> np.ndarray:
    """Return which of the sweep's rows (count,) are kept for testing: one in `every`.

    Of a grid every n-th; of other designs random ones. A Sobol sequence fills space in turns, so that every n-th
    of its points lie in one corner, and the network would never see that corner.
    """
    if getattr(study.sweep, "design", None) == "grid":
        return np.asarray(np.arange(count) % every == every - 1)
    unseen = np.zeros(count, dtype=bool)
    rng = np.random.default_rng((study.test.seed if study.test else 0, count))
    unseen[rng.choice(count, count // every, replace=False)] = True
    return unseen


def learn_study(
    study: Study,
    train: Dataset,
    test: Dataset | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    log: Log = lambda _: None,
    watch: Any = None,
    leave_out: Sequence[int] = (),
    on_step: Log = lambda _: None,
) -> tuple[Surrogate, LearningHistory]:
    """Learn the study's surrogate, which keeps the study's runtime settings.

    Rows of `test` are only watched while a filter learns; `progress` counts its observations, and `watch` (a
    GrowthRecorder) keeps frames of a sequential filter's growth. Rows of `train` numbered in `leave_out` are not learnt
    from. `on_step` is told each step of the search for the energy. Returns what `palpate.learn` returns.
    """
    if watch is not None and study.filter is None:
        raise UsageError(
            f"No network of the study {study.name!r} grows sample by sample.",
            why="Its energy is found by a search among many networks at once.",
            fix="Watch a study of a beam under loads, such as that of palpate init --preset beam-nylon.",
        )
    if leave_out and study.memory is not None:
        raise UsageError(
            f"The study {study.name!r} learns from histories, of which none can be left out.",
            fix="Omit --leave-out.",
        )
    options = _options(study, train, test, progress, log) | ({} if watch is None else {"watch": watch})
    whole = with_elastic(study, train)
    model, history = learn_dataset(whole, leave_out=leave_out, on_step=on_step, **options)
    model = with_relaxation(study, model, log)
    if study.runtime.friction is not None:
        model = model.with_friction(study.runtime.friction, study.runtime.static_friction)
    if whole is not train:  # it is recognised by what its file holds
        model = _with_meta(model, {"dataset": model.meta["dataset"] | {"hash": train.hash}})
    return _with_meta(model, {"runtime": study.runtime.model_dump()}), history


def _options(study: Study, train: Dataset, test: Dataset | None, progress: Any, log: Log) -> dict[str, Any]:
    """Return the options of `palpate.learn` for a study."""
    options: dict[str, Any] = {"name": study.name, **(study.learning.options() if study.learning else {})}
    if study.filter:
        watched = {"heldout": test, "progress": progress}
        form = {"settings": study.filter.build(len(train.ranges)), "passes": study.filter.passes}
        return {**options, **form, **watched, "seed": study.filter.seed, "log": log}
    if study.sweep and study.sweep.symmetric:
        # shown on a mesh that is fine wherever the body is touched, not in the part that is solved alone
        options["layout"] = study.problem(whole=True).layout
    return {**options, "log": log}


def _with_meta(model: Surrogate, more: Mapping[str, Any]) -> Surrogate:
    """Return what was learnt with more said of it, for whoever opens the file later."""
    return replace(model, meta={**model.meta, **more})


def validate_study(
    study: Study, model: Surrogate, test: Dataset, history: Record | None = None, finer: Dataset | None = None
) -> Validation:
    """Judge what was learnt by solves that it has never seen, by the study's targets.

    `finer` are some of them on finer elements, which tell the mesh's part in the error.
    """
    assert study.target is not None  # every kind of study has one
    return validate(model, test, history=filter_record(history), refined=finer, limits=study.target.limits())


def with_validation(
    model: Surrogate, validation: Validation, curve: Sequence[Mapping[str, Any]] = (), solves: int = 0
) -> Surrogate:
    """Return what was learnt with its errors on unseen solves written into it.

    `curve` is the learning curve of the surrogate that it replaces; `solves` is the number that it was learnt from,
    0 where the curve is not kept.
    """
    more: dict[str, Any] = {"validation": validation.summary()}
    if solves:
        more["learning_curve"] = learning_curve(curve, solves, validation)
    return _with_meta(model, more)


def save_model(paths: Paths, model: Surrogate, history: Record | None) -> None:
    """Write what was learnt, and the record of its filter where there is one."""
    model.save(paths.model)
    if (own := filter_record(history)) is not None:
        own.save(paths.history)


def load_model(paths: Paths, train: Dataset) -> tuple[Surrogate, History | None]:
    """Read what was learnt, and the record of its filter where there is one.

    It was learnt from just these rows, or from the first of them where all of them gave no better one: then the
    ``no_better`` of its dataset is the hash of all.

    What was learnt from other rows is refused: rows that it has seen might be taken for unseen ones.
    """
    model = Surrogate.load(paths.model)
    origin = model.meta.get("dataset", {})
    # a body with memory of before does not tell its histories
    if origin and train.hash not in (origin.get("hash"), origin.get("no_better")):
        raise UsageError(
            f"{paths.model} was learnt from other solves than this study trains with.",
            why="The sweep or its split was changed since, and what is unseen here may have been seen there.",
            fix="Run `palpate learn` again.",
        )
    return model, History.load(paths.history) if paths.history.exists() else None


def report_study(path: Path, outcomes: Sequence[Outcome], **options: Any) -> Path:
    """Write one report on several outcomes; `options` are those of `palpate.write_report`."""
    return write_report(path, [o.chapter() for o in outcomes], machine=_machine(), **options)


def _machine() -> dict[str, str]:
    """Return what the report says of where it was made."""
    return {
        "system": f"{platform.system()} {platform.release()}",
        "processor": f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores",
        "Python": platform.python_version(),
        "palpate": importlib.metadata.version("palpate"),
    }


def carry_out(
    study: Study,
    paths: Paths,
    *,
    cluster: Any = None,
    progress: Any = True,
    log: Log = lambda _: None,
    rivals: bool = True,
    case_limit: float = CASE_LIMIT,
) -> Outcome:
    """Carry out a study up to its validation and write its datasets, model and history.

    A single solve of the sweep has failed after `case_limit` s; `rivals` says whether to run the founding form of
    the filter beside ours, where there is a filter.
    """
    timings: dict[str, float] = {}

    def timed(stage: str, work: Callable[[], Any]) -> Any:
        log(stage)
        began = time.perf_counter()
        result = work()
        timings[stage] = time.perf_counter() - began
        return result

    sweeping = {"cluster": cluster, "progress": progress, "case_limit": case_limit}
    data, further = timed("sweep", lambda: sweep_study(study, paths, **sweeping))
    train, test = split_rows(study, data, further)
    model, history = timed("learn and refine", lambda: learn_study(study, train, test))
    finer = load_finer(study, paths)
    validation = timed("validate", lambda: validate_study(study, model, test, history, finer))
    model = with_validation(model, validation)
    save_model(paths, model, history)
    others: dict[str, Any] = {}
    if rivals and (own := filter_record(history)) is not None:
        others = timed("founding form", lambda: _rivals(study, train, test, own.passes))
    return Outcome(study, model, train, test, validation, history, others, timings)


def _rivals(study: Study, train: Dataset, test: Dataset, passes: int) -> dict[str, History]:
    """Return runs of the founding form and ours, as they are and ten times tighter, for studies of one input."""
    if len(train.ranges) != 1 or study.filter is None:
        return {}
    forms = {
        "founding form": founding(),
        "founding form, thresholds ÷ 10": _tightened(founding()),
        "our form, thresholds ÷ 10": _tightened(study.filter.build(1)),
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


def _tightened(settings: Settings) -> Settings:
    """Return settings with growth thresholds divided by ten: what a user does who wants more accuracy."""
    return replace(
        settings,
        error_min=settings.error_min / 10,
        error_rms_min=settings.error_rms_min / 10,
        distance_min=settings.distance_min / 10,
    )
