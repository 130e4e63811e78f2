"""The work behind the page of `palpate touch`, in a process of its own: ``python -m palpate.study.part_work``.

A study is improved here beside the page and the real-time loop, at a lower priority, and one core is left to the loop
once there is something to touch. First comes a *rough* surrogate, of twelve solves on elements as large as the ball,
which takes a fraction of the time; then the study itself, whose surrogates take the rough one's place. The study's own
first solves, which the rough surrogate has not learnt from, tell its error until then.

Standard input brings one line of JSON with what to do, then perhaps the line ``stop``: no further batch of solves
begins, and what there is is concluded. Its end ends this process and all that it started. Standard output carries lines
of JSON, each with one or more of

    log        a part of the work begins, in words
    progress   solves of this batch that are done, and their number
    step       `palpate.improvement.ImprovementStep`, without what can't be written
    body       file of a surrogate to touch
    judged     relative force error of a surrogate of an earlier run, as its file states it, and its number of solves
    ended      whether the wanted error was reached, why it ended, report and figures in words
    failed     what, why and fix of an error
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import PalpateError
from palpate.file_kinds import part_kind
from palpate.processes import available_cores, end_by_sigterm, end_group
from palpate.study.part_records import PartRecord
from palpate.study.part_tools import rough_element
from palpate.study.run import Paths
from palpate.study.stage_records import PressSweepRecord
from palpate.study.study import Study
from palpate.study.tool_kind import ToolRecord

__all__ = ["main", "rough_study", "work_on"]

Say = Callable[[dict[str, Any]], None]

_NICE = 5  # niceness: below the page and everything else that somebody waits for
_GRACE = 5.0  # s in which the work ends in good order


def rough_study(study: Study) -> Study | None:
    """Return the study ``NAME-rough`` on elements as large as the ball, or as a tool's edge allows.

    None where its file's mesh can't be coarser, or a scan's triangles were picked, which coarser ones would not be.

    On a kidney of 110 mm a solve takes a fifteenth of the time, and forces are off by 2 to 9 %.
    """
    body, acting = study.body, study.interaction
    if not (isinstance(body, PartRecord) and isinstance(study.sweep, PressSweepRecord)):
        return None
    kind = part_kind(body.file)
    if kind == "mesh" or (kind == "scan" and any(surface.triangles for surface in body.surfaces)):
        return None
    size = (
        rough_element(acting.build_tool().shape)
        if isinstance(acting, ToolRecord)
        else getattr(acting, "radius", None)
    )
    changes: dict[str, Any] = {"sweep": study.sweep.model_copy(update={"element": size})}
    if kind == "scan":  # whose tissues' surfaces have a size of their own
        changes["body"] = body.model_copy(update={"element": size})
    return study.model_copy(update={"name": f"{study.name}-rough", **changes})


def work_on(
    study: Study,
    paths: Paths,
    say: Say,
    *,
    until: float,
    limit: float,
    workers: int | None = None,
    stopped: Callable[[], bool] = lambda: False,
    refine: Path | None = None,
) -> None:
    """Improve a study until a force error is kept, and say all that a page shows of it.

    `say` takes what the module's text lists. `until` is the wanted relative force error at the 95th percentile of
    unseen solves; after `limit` s, or once `stopped` returns true, no further batch of solves begins. `workers` is
    by default one for each core, one fewer once there is something to touch. `refine` is the study's file where finer
    solves are to decide the size of its elements; what is solved already stays.
    """
    from palpate.study.improve_study import improve_study
    from palpate.study.mesh_check import refine_study
    from palpate.sweeps import local_cluster

    began = time.monotonic()
    rough = rough_study(study)
    in_hand: Path | None = None  # a rough surrogate
    if (own := _find_surrogate(study, paths)) is not None:
        say({"body": str(own)} | _judgement(own))
    elif rough is not None:
        in_hand = _find_surrogate(rough, Paths(paths.folder, rough.name))
        if in_hand is not None:
            say({"body": str(in_hand)})
        else:
            with local_cluster(workers) as cluster:
                in_hand = _first_touch(
                    rough.with_workers(workers), Paths(paths.folder, rough.name), cluster, say
                )
    if stopped():
        say(
            {
                "ended": {
                    "reached": False,
                    "reason": "It was stopped before the study's own solves.",
                    "report": "",
                }
            }
        )
        return
    fewer = workers or max(1, available_cores() - 1)
    with local_cluster(fewer) as cluster:
        if refine is not None and not paths.is_begun:
            study = refine_study(
                study, refine, cluster=cluster, progress=False, log=lambda w: say({"log": w})
            )
        steps = improve_study(
            study.with_workers(fewer),
            paths,
            until=until,
            limit=max(1e-3, limit - (time.monotonic() - began)),
            cluster=cluster,
            **_callbacks(say),
        )
        _carry_out(study, paths, steps, say, stopped, in_hand)


def _find_surrogate(study: Study, paths: Paths) -> Path | None:
    """Return the file of a study's surrogate, where there is one that was learnt from this very body and ball."""
    from palpate.surrogates import Surrogate

    if not paths.model.exists():
        return None
    try:
        origin = Surrogate.load(paths.model).meta.get("dataset", {}).get("provenance", {})
        wanted = study.problem().describe()
    except PalpateError:  # what is wrong with the study is said when it is solved
        return None
    # compared as the file has it: tuples are lists there
    return paths.model if origin.get("problem") == json.loads(json.dumps(wanted)) else None


def _judgement(model: Path) -> dict[str, Any]:
    """Return the line that says how an earlier run judged a surrogate; empty where its file does not tell."""
    from palpate.surrogates import Surrogate

    curve = Surrogate.load(model).meta.get("learning_curve") or [{}]
    solves, median, p95 = (curve[-1].get(name, math.nan) for name in ("solves", "force_median", "force_p95"))
    if not math.isfinite(p95):
        return {}
    return {"judged": {"solves": int(solves), "median": float(median), "error": float(p95)}}


def _first_touch(rough: Study, paths: Paths, cluster: Any, say: Say) -> Path | None:
    """Learn a first surrogate on large elements, and return its file; what fails here is left to the study itself."""
    from palpate.study.improve_study import improve_study

    say({"log": "a rough surrogate first, on elements as large as the ball"})
    try:
        for step in improve_study(rough, paths, cluster=cluster, **_callbacks(say)):
            if step.phase == "learnt":
                say({"body": str(step.model_path)})
                return step.model_path
            say({"step": _figures(step)})
    except PalpateError as error:
        say({"log": f"no rough surrogate: {error.what}"})
    return None


def _errors_of(rough: Path | None, step: Any) -> dict[str, float]:
    """Return the force error of a rough surrogate in the hand, until the study's own is judged beside it.

    It was learnt on other elements: all solves of the study are unseen to it.
    """
    from palpate.improvement.stop_rule import relative_errors
    from palpate.surrogates import Surrogate

    judged = step.phase == "judged"
    data = step.test if judged else step.train
    if rough is None or data is None or (step.surrogate is not None and not judged):
        return {}
    errors = relative_errors(Surrogate.load(rough), data)
    median, p95 = np.quantile(errors, (0.5, 0.95)) if errors.size else (math.nan, math.nan)
    if judged:
        return {"before": float(p95), "tried": step.error, "is_new": True}
    return {"error": float(p95), "median": float(median)}


def _carry_out(
    study: Study,
    paths: Paths,
    steps: Iterator[Any],
    say: Say,
    stopped: Callable[[], bool],
    in_hand: Path | None,
) -> None:
    """Go through the steps, and conclude with the last."""
    from palpate.study.improve_study import conclude
    from palpate.study.run import report_study
    from palpate.validation.verdict import verdict

    last: Any = None
    for step in steps:
        last = step
        say({"step": _figures(step) | _errors_of(in_hand, step)})
        if step.is_new and step.model_path is not None:
            own = step.model_path.with_name(f"{study.name}-{step.solves}.palpate")
            say({"body": str(own if own.exists() else step.model_path)})
        if stopped() and step.phase in {"learnt", "judged"}:  # what was solved has been learnt from
            break
    reason = last.reason or "It was stopped."
    if last.train is None or not last.unseen or last.surrogate is None:
        say({"ended": {"reached": False, "reason": reason, "report": ""}})
        return
    outcome = conclude(study, paths, last)
    report = report_study(paths.report, [outcome])
    words = "\n".join(verdict(outcome.validation))
    say({"ended": {"reached": last.reached, "reason": reason, "report": str(report), "validation": words}})


def _figures(step: Any) -> dict[str, Any]:
    names = (
        "phase",
        "solves",
        "unseen",
        "error",
        "median",
        "seconds",
        "is_new",
        "reached",
        "reason",
        "before",
        "tried",
        "mesh",
    )
    painted = {} if step.surrogate is None else step.surrogate.meta.get("painted", {})
    return {name: getattr(step, name) for name in names} | {"places": step.places.tolist()} | painted


def _callbacks(say: Say) -> dict[str, Any]:
    return {
        "progress": lambda done, total: say({"progress": [int(done), int(total)]}),
        "log": lambda words: say({"log": words}),
    }


def main() -> int:
    """Carry out what the standard input asks for; the exit code is that of the error, 0 without one."""
    with contextlib.suppress(OSError, AttributeError):
        os.nice(_NICE)
    # Ctrl-C reaches the whole terminal: the page's process decides
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, end_by_sigterm)
    say, stopping = _speaker(), threading.Event()
    asked = _wishes(stopping)
    _import_all()
    wish = asked()
    from palpate.physics.advice import ModelWarning
    from palpate.study.toml import read_study

    warnings.simplefilter("ignore", ModelWarning)  # the page's process has read the same part, and told them

    try:
        file = Path(wish["study"])
        study = read_study(file)
        work_on(
            study,
            Paths(file.parent, study.name),
            say,
            until=wish["until"],
            limit=wish["limit"],
            workers=wish["workers"],
            stopped=stopping.is_set,
            refine=file if wish.get("refine") else None,
        )
    except PalpateError as error:
        say({"failed": {"what": error.what, "why": error.why, "fix": error.fix}})
        return error.exit_code
    return 0


def _speaker() -> Say:
    """Return what writes lines of JSON to the standard output, which libraries find closed to them from now on."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    lock = threading.Lock()

    def say(words: dict[str, Any]) -> None:
        with lock, contextlib.suppress(OSError, ValueError):
            out.write(json.dumps(words) + "\n")
            out.flush()

    return say


def _wishes(stopping: threading.Event) -> Callable[[], dict[str, Any]]:
    """Listen to the standard input; return what waits for the line that says what to do."""
    lines: list[str] = []
    come = threading.Event()

    def listen() -> None:
        rest = b""
        while data := os.read(0, 65536):
            *whole, rest = (rest + data).split(b"\n")
            for line in whole:
                if line == b"stop":
                    stopping.set()
                else:
                    lines.append(line.decode())
                    come.set()
        os.kill(os.getpid(), signal.SIGTERM)  # who asked for the work is gone
        time.sleep(_GRACE)
        end_group()

    threading.Thread(target=listen, daemon=True).start()

    def first() -> dict[str, Any]:
        while not come.wait(0.5):  # in steps: signals are heard between them
            pass
        return dict(json.loads(lines[0]))

    return first


def _import_all() -> None:
    """Import what takes seconds, while a person still chooses."""
    import distributed  # noqa: F401
    import ngsolve  # noqa: F401

    import palpate.learning
    import palpate.study.improve_study  # noqa: F401


if __name__ == "__main__":
    sys.exit(main())
