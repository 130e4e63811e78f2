"""`palpate sweep`, `learn` and `validate`: the stages of a study, and the judgement of a file that was learnt."""

from __future__ import annotations

import contextlib
import statistics
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli.console import Console
from palpate.cli.verdict_lines import raise_misses, verdict_text
from palpate.errors import UsageError
from palpate.format import count, duration
from palpate.input_files import open_input
from palpate.processes import CASE_LIMIT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from palpate.study import Study
    from palpate.sweeps import JobQueue, Scheduler
    from palpate.validation.touch_comparison import TouchComparison

__all__ = [
    "is_archive",
    "learn_dataset_file",
    "learn_file",
    "learn_path",
    "refine_elements",
    "sweep_file",
    "validate_model",
    "validate_study_file",
]

_CORRECTED = (
    "Corrected by {} measured touches: it is of the specimen, and differs from solves of the model on purpose. "
    "`palpate correct` says how well it follows the specimen, on measurements that it left out."
)
TEST_SETS = ("-test.zarr", "-random.zarr", "-unseen.palpate")
"""Ends of the names of test sets, which begin with the name of the model."""


def sweep_file(
    study: Path,
    workers: int | None,
    console: Console,
    scheduler: Scheduler | JobQueue | None = None,
    *,
    case_limit: float = CASE_LIMIT,
    samples: int | None = None,
    refine: bool = False,
) -> None:
    """Solve what a study file describes, here or on a scheduler, and print where the solves are.

    The workers are by default those of the study; a single solve has failed after `case_limit` seconds. `samples` go in
    place of the study's own number; a finished sweep is continued. With `refine` finer solves decide the elements' size
    first.
    """
    from palpate.study import read_study
    from palpate.study.run import Paths, sweep_study
    from palpate.study.study_lock import hold_study
    from palpate.sweeps import Scheduler

    with console.patience(f"Reading {study}"):
        record = read_study(study).with_workers(workers).with_samples(samples)
    paths = Paths(study.parent, record.name)
    began = time.monotonic()
    if paths.data.with_name(paths.data.name + ".parts").exists():
        console.say(f"Going on with the interrupted sweep in {paths.data} …")
    if scheduler is None and record.sweep is not None and record.sweep.scheduler is not None:
        scheduler = Scheduler(record.sweep.scheduler)
    if scheduler is not None and record.sweep is None:
        raise UsageError(
            "The histories of this study are solved in this process, not on a scheduler.",
            fix="Leave --scheduler out.",
        )
    if scheduler is not None and scheduler.warning:
        console.say(f"Warning: {scheduler.warning}")
    with hold_study(paths, "palpate sweep"):
        if refine:
            record = refine_elements(record, study, console, workers=workers, scheduler=scheduler)
        data, further = sweep_study(
            record,
            paths,
            cluster=scheduler,
            progress=not console.as_json,
            case_limit=case_limit,
            log=lambda stage: console.say(f"Solving: {stage} …"),
        )
    target, other = paths.data, paths.random
    parts = [data] if further is None else [data, further]
    failed = sum(len(part) - len(part.ok) for part in parts)
    failures = f", {failed} did not converge" if failed else ""
    lines = [str(data)] if console.verbose else []
    lines.append(f"{target}: {data.size_in_words} to learn from{failures}")
    if further is not None:
        lines.append(f"{other}: {further.size_in_words} for testing")
    seconds = [float(s) for part in parts for s in part["solve_seconds"]]
    if seconds:
        lines.append(
            f"{count(len(seconds), 'solve')}, {duration(statistics.median(seconds))} each at the median; "
            f"this took {duration(time.monotonic() - began)}"
        )
    lines.append(f"next    palpate learn {study}")
    content = {"data": str(target), "random": None if further is None else str(other)}
    console.result("\n".join(lines), content | {"rows": sum(map(len, parts)), "failed": failed})


def refine_elements(
    study: Study,
    file: Path,
    console: Console,
    *,
    workers: int | None = None,
    scheduler: Scheduler | JobQueue | None = None,
) -> Study:
    """Return a study with elements of the size that finer solves choose, as its file says it afterwards.

    A study that has solves keeps its elements.
    """
    from palpate.study.mesh_check import refine_study
    from palpate.study.run import Paths
    from palpate.sweeps import local_cluster

    if Paths(file.parent, study.name).is_begun:
        console.say("Its solves are there already, or begun, and their elements stay as they are.")
        return study
    with contextlib.ExitStack() as stack:
        cluster = stack.enter_context(local_cluster(workers)) if scheduler is None else scheduler
        return refine_study(
            study,
            file,
            cluster=cluster,
            progress=not console.as_json,
            log=lambda stage: console.say(f"{stage} …"),
        )


def learn_path(
    study: Path, effort: float | None, console: Console, *, watch: bool, leave_out: Sequence[int] = ()
) -> None:
    """Learn a study file, or a dataset, a folder ``NAME.zarr``.

    The effort is of a dataset's search; `watch` shows the growth of a study's sequential filter. The solves numbered in
    `leave_out` are not learnt from.
    """
    if not study.is_dir():
        if effort is not None:
            from palpate.study.toml import key_line

            with open_input(study) as file:
                number, line = key_line(file.read().decode(errors="replace"), "learning", "effort")
            raise UsageError(
                f"A study file states its own effort, and --effort asks for {effort:g}.",
                why=f"Line {number} of {study} says {line}" if number else f"{study} has the default, 1.",
                fix="Change it there, in [learning], and leave out --effort.",
            )
        learn_file(study, console, watch=watch, leave_out=leave_out)
        return
    if watch:
        raise UsageError("The growth is watched of a study.", fix="Name the study file, or omit --watch.")
    learn_dataset_file(study, 1.0 if effort is None else effort, console, leave_out)


def learn_file(study: Path, console: Console, *, watch: bool = False, leave_out: Sequence[int] = ()) -> None:
    """Learn the dataset of a study file, judge the result, write it and print how good it is.

    `watch` shows the growth of the sequential filter, and writes the page that plays it; the training solves numbered
    in `leave_out` are not learnt from.
    """
    from palpate.cli.growth_view import watch_growth
    from palpate.cli.learning_steps import LearningSteps
    from palpate.study import read_study
    from palpate.study.mesh_check import load_finer
    from palpate.study.run import Paths, learn_study, load_data, save_model, validate_study, with_validation
    from palpate.study.study_advice import earlier_curve
    from palpate.study.study_lock import hold_study

    with console.patience(f"Reading {study}"):
        record = read_study(study)
    paths = Paths(study.parent, record.name)
    page = paths.folder / f"{record.name}.growth.html" if watch else None
    with hold_study(paths, "palpate learn"):
        train, test = load_data(record, paths)
        console.say(f"Learning from {train.size_in_words} …")
        with watch_growth(page, record.name, console) as recorder, console.patience("Learning"):
            model, history = learn_study(
                record,
                train,
                test,
                log=lambda stage: console.say(f"{stage} …"),
                watch=recorder,
                leave_out=leave_out,
                on_step=LearningSteps(console).begin,
            )
        validation = validate_study(record, model, test, history, load_finer(record, paths))
        curve = earlier_curve(paths, record.name)
        model = with_validation(model, validation, curve, len(train) if record.memory is None else 0)
        save_model(paths, model, history)
    lines = [f"  {check}" for check in validation.checks if check.criterion.key in _HEADLINES]
    values = {check.criterion.key: check.measured for check in validation.checks}
    console.result(
        "\n".join([str(model), str(history), *lines, *([str(page)] if page else []), str(paths.model)]),
        {"model": str(paths.model), "passed": validation.passed, "measured": values, **_suspects(model)}
        | ({"growth": str(page)} if page else {}),
    )
    console.say(f"Next: palpate validate {study}, palpate view {paths.model}")


def _suspects(model: Any) -> dict[str, Any]:
    """Return the solves that contradict their neighbours, for --json."""
    meta = getattr(model, "meta", None) or {}
    return {"suspects": meta.get("suspects", []), "left_out": meta.get("excluded", [])}


_HEADLINES = {"rmse", "filter_rmse", "force_median", "force_p95", "history_force_median", "history_force_p95"}
"""Values of a validation that `palpate learn` prints."""


def validate_study_file(study: Path, report: bool, console: Console, traces: Sequence[Path] = ()) -> None:
    """Judge the model of a study file by its unseen solves, print, and write the report.

    Beside the recorded touches of `traces` the full model is solved for the report. Of a missed limit an
    `AccuracyError` tells after everything has been printed and written.
    """
    from palpate.study import read_study
    from palpate.study.mesh_check import load_finer
    from palpate.study.run import Outcome, Paths, load_data, load_model, report_study, validate_study
    from palpate.study.study_advice import advice_after
    from palpate.validation.report.body_words import solid_words

    with console.patience(f"Reading {study}"):
        record = read_study(study)
    paths = Paths(study.parent, record.name)
    train, test = load_data(record, paths)
    model, history = load_model(paths, train)
    validation = validate_study(record, model, test, history, load_finer(record, paths))
    advice = advice_after(record, model, train, validation, study)
    if advice:
        validation = replace(validation, notes=(f"{advice}.", *validation.notes))
    beside = _beside_full_model(record, traces, console)
    if report:
        outcome = Outcome(record, model, train, test, validation, history, comparisons=beside)
        report_study(paths.report, [outcome])
    written = paths.report if report else None
    then = f"palpate view {paths.model}" if validation.passed else ""
    text = verdict_text([validation], console, report=written, next_step=then)
    content = validation.as_dict() | {"report": str(written) if written else None, "advice": advice}
    if beside:
        content["traces"] = [comparison.as_dict() for comparison in beside]
    lines = [solid_words(train), *(str(c) if console.verbose else c.verdict() for c in beside), text]
    console.result("\n".join(filter(None, lines)), content)
    then = f", then palpate learn {study}" if "--samples" in advice else "."
    raise_misses(validation, console, advice + then if advice else "")


def _beside_full_model(record: Study, traces: Sequence[Path], console: Console) -> list[TouchComparison]:
    if not traces:
        return []
    from palpate.devices.trace_file import read_trace
    from palpate.validation.full_model import compare_full_model

    problem = record.problem(whole=True)
    made = []
    for path in traces:
        console.say(f"Solving the full model under the hand of {path} …")
        made.append(compare_full_model(read_trace(path), problem))
    return made


def learn_dataset_file(path: Path, effort: float, console: Console, leave_out: Sequence[int] = ()) -> None:
    """Learn a dataset, a folder ``NAME.zarr``, write the model beside it, and print how it was learnt.

    The effort multiplies the counts of candidates and iterations of the searches. The rows numbered in `leave_out` are
    not learnt from.
    """
    from palpate.cli.learning_steps import LearningSteps
    from palpate.dataset import Dataset
    from palpate.learning import learn_dataset

    data = Dataset.open(path)
    console.say(f"Learning from {data.ok.size_in_words} …")
    model, history = learn_dataset(
        data,
        name=path.stem,
        effort=effort,
        leave_out=leave_out,
        log=lambda stage: console.say(f"{stage} …"),
        on_step=LearningSteps(console).begin,
    )
    target = path.with_suffix(".palpate")
    model.save(target)
    console.result(
        "\n".join([str(model), str(history), str(target)]), {"model": str(target), **_suspects(model)}
    )
    console.say(f"Next: palpate validate {target} --test DATA.zarr, palpate view {target}")


def is_archive(path: Path) -> bool:
    """Return whether a file is something learnt and not a study, by its first bytes, or by its name if it is missing.

    A study is text; an archive begins with eight bytes of a length, the last of them zero (safetensors).
    """
    if not path.is_file():
        return path.suffix == ".palpate"
    with open_input(path) as file:
        return b"\0" in file.read(8)


def validate_model(
    path: Path, test: Path | None, refined: Path | None, report: bool, console: Console
) -> None:
    """Judge a learnt file by unseen solves, print, and write the report beside the file.

    `test` are unseen solves or load histories, by default the test set beside the file; `refined` are solves on a finer
    mesh. Of a missed limit an `AccuracyError` tells after everything has been printed and written.
    """
    from palpate.dataset import Dataset
    from palpate.surrogates import Surrogate
    from palpate.surrogates.training_record import correction_count
    from palpate.validation import Chapter, validate, write_report
    from palpate.validation.report.body_words import solid_words

    model = Surrogate.load(path)
    data, fine = _test_set(path, test), None if refined is None else Dataset.open(refined)
    validation = replace(validate(model, data, refined=fine), name=path.stem)
    if touches := correction_count(model.meta):
        validation = replace(validation, notes=(*validation.notes, _CORRECTED.format(touches)))
    target = path.with_suffix(".html") if report else None
    if target is not None:
        origin = getattr(data, "provenance", {})
        target = write_report(
            target, [Chapter(path.stem, model, data, validation, settings=model.meta, provenance=origin)]
        )
    then = f"palpate view {path}" if validation.passed else ""
    text = verdict_text([validation], console, report=target, next_step=then)
    console.result(
        f"{solid_words(data)}\n{text}".lstrip(),
        validation.as_dict() | {"report": str(target) if target else None},
    )
    raise_misses(validation, console, _CORRECTED.format(touches) if touches else "")


def _test_set(path: Path, test: Path | None) -> Any:
    """Return the dataset, or for a body with memory the load histories, that lies beside a model or was named."""
    from palpate.dataset import Dataset
    from palpate.learning.loading import load_histories

    beside = [path.with_name(path.stem + end) for end in TEST_SETS]
    found = test or next((file for file in beside if file.exists()), None)
    if found is None:
        raise UsageError(
            f"There are no solves to judge {path} by.",
            why=f"None of {', '.join(file.name for file in beside)} lies beside it.",
            fix="Name a dataset of solves that it was not learnt from: --test DATA.zarr",
        )
    return load_histories(found) if found.suffix == ".palpate" else Dataset.open(found)
