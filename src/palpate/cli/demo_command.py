"""`palpate demo`: named studies, from finite elements to a report and a model that can be touched."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from palpate.cli.console import Console
from palpate.cli.verdict_lines import raise_misses, verdict_text
from palpate.files import system_errors
from palpate.format import duration
from palpate.processes import CASE_LIMIT
from palpate.runtime.warm_up import WarmUp
from palpate.study import Study, preset_study
from palpate.study.run import Outcome, Paths, carry_out, report_study
from palpate.study.study_lock import hold_study
from palpate.sweeps import LocalCluster, local_cluster

__all__ = ["run_demo"]

_ORGAN = "and an organ of your own: palpate init --sample kidney.stl, palpate touch kidney.stl"


def run_demo(
    names: Sequence[str],
    folder: Path,
    workers: int | None,
    console: Console,
    *,
    quick: bool = False,
    case_limit: float = CASE_LIMIT,
) -> list[Path]:
    """Carry out studies one after the other on one cluster, report on all together, and return the models' files.

    If a study missed its target, an `AccuracyError` says so after everything is written.
    """
    studies = [preset_study(name, quick=quick).with_workers(workers) for name in names]
    with system_errors(f"The folder {folder} could not be made."):
        folder.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    console.say("Starting workers …")
    kinds = sorted({"pressed" if study.presses else "held" for study in studies})
    # the kernels of what is learnt are compiled beside the solves
    with WarmUp(*kinds), local_cluster(workers) as cluster:
        outcomes = [_carry_out(study, folder, cluster, console, case_limit) for study in studies]
    console.say("report …")
    # one study's has its name, as `palpate validate` writes it, so that the next demo leaves it alone
    name = studies[0].name if len(studies) == 1 else "report"
    report = report_study(folder / f"{name}.html", outcomes)
    seconds = time.perf_counter() - began
    models = [Paths(folder, study.name).model for study in studies]
    judged = [outcome.validation for outcome in outcomes]
    console.say(f"done in {duration(seconds)}")
    text = verdict_text(judged, console, report=report, next_step=f"palpate view {models[-1]}")
    console.result(f"{text}\n{_ORGAN}", _content(outcomes, report, seconds))
    for validation in judged:
        raise_misses(validation, console)
    return models


def _carry_out(
    study: Study, folder: Path, cluster: LocalCluster, console: Console, case_limit: float
) -> Outcome:
    paths = Paths(folder, study.name)
    with hold_study(paths, "palpate demo"):
        return carry_out(
            study,
            paths,
            cluster=cluster,
            progress=not console.as_json,
            case_limit=case_limit,
            log=lambda stage: console.say(f"{study.name}: {stage} …"),
        )


def _content(outcomes: Sequence[Outcome], report: Path, seconds: float) -> dict[str, object]:
    return {
        "studies": {o.study.name: o.validation.as_dict() for o in outcomes},
        "report": str(report),
        "seconds": seconds,
    }
