"""`palpate demo`: named studies, from finite elements to a report and a model that can be touched."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from palpate.cli.console import Console
from palpate.errors import AccuracyError
from palpate.files import system_errors
from palpate.processes import CASE_LIMIT
from palpate.runtime.warm_up import WarmUp
from palpate.study import Study, preset_study
from palpate.study.run import Outcome, Paths, carry_out, report_study
from palpate.sweeps import LocalCluster, local_cluster

__all__ = ["run_demo"]


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
    console.result(_summary(outcomes, report, seconds), _content(outcomes, report, seconds))
    _judge(outcomes)
    return [Paths(folder, study.name).model for study in studies]


def _carry_out(
    study: Study, folder: Path, cluster: LocalCluster, console: Console, case_limit: float
) -> Outcome:
    return carry_out(
        study,
        Paths(folder, study.name),
        cluster=cluster,
        progress=not console.as_json,
        case_limit=case_limit,
        log=lambda stage: console.say(f"{study.name}: {stage} …"),
    )


def _summary(outcomes: Sequence[Outcome], report: Path, seconds: float) -> str:
    parts = [f"\n{o.validation}" for o in outcomes]
    last = outcomes[-1].study
    model = Paths(report.parent, last.name).model
    return "\n".join(
        [*parts, "", f"report  {report}", f"model   {model}   (palpate view {model})", f"{seconds:.0f} s"]
    )


def _content(outcomes: Sequence[Outcome], report: Path, seconds: float) -> dict[str, object]:
    return {
        "studies": {o.study.name: o.validation.as_dict() for o in outcomes},
        "report": str(report),
        "seconds": seconds,
    }


def _judge(outcomes: Sequence[Outcome]) -> None:
    for o in outcomes:
        try:
            o.validation.raise_if_failed()
        except AccuracyError as error:
            raise AccuracyError(f"{o.study.name}: {error.what}", why=error.why, fix=error.fix) from error
