"""A finished sweep that is asked for more samples: what is solved stays, and only the rest is solved."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import FileFormatError
from palpate.files import restore_folder, system_errors
from palpate.sweeps.ledger import Ledger
from palpate.sweeps.plan import Plan, make_plan

__all__ = ["CHOSEN", "grow", "is_begun"]

CHOSEN = "chosen"
"""Name of the design of solves that were chosen batch by batch, each by what was known then."""


def grow(path: str | os.PathLike[str], problem: Any, arguments: Mapping[str, Any]) -> Dataset | None:
    """Turn a finished sweep into the beginning of a larger one, or return it where it is large enough.

    A design whose first points are those of a smaller one, as Sobol's and depth series are, can be continued. The
    solved rows go to the parts of the larger sweep, where `sweep` takes them up.

    Parameters
    ----------
    path : path
        Dataset of a finished sweep; where there is none, nothing happens.
    problem : Problem
        Problem of the sweep.
    arguments : mapping
        Arguments of `sweep` that say where to solve: `samples` or `points`, `seed`, `design`.

    Returns
    -------
    Dataset or None
        The finished dataset where it holds all of the points and more, or solves of this problem that were chosen one
        by one, which no design continues; None where `sweep` has to look: nothing is
        there, exactly this sweep, another one, or one that it can now continue.
    """
    path, plan = Path(path), _plan(problem, arguments)
    try:
        restore_folder(path)
        finished = Dataset.open(path) if path.exists() else None
    except FileFormatError:
        finished = None  # `sweep` says what is wrong with it
    if finished is None:
        return None
    if finished.provenance.get("config_hash") == plan.config or not _is_same_problem(finished, plan):
        return None
    begins_alike = _begins_alike(finished, plan)
    if finished.provenance.get("design") == CHOSEN or (begins_alike and len(finished) > len(plan.points)):
        return finished
    if not begins_alike:
        return None
    ledger = Ledger(path, plan.config)
    ledger.begin(len(plan.points))
    ledger.add(finished)
    with system_errors(f"The folder {path} could not be removed, to make room for the larger sweep."):
        shutil.rmtree(path)
    return None


def is_begun(path: str | os.PathLike[str], problem: Any, arguments: Mapping[str, Any]) -> bool:
    """Return whether a run of this very sweep was interrupted, so that `sweep` goes on with it.

    Parameters
    ----------
    path : path
        Dataset that the sweep writes.
    problem : Problem
        Problem of the sweep.
    arguments : mapping
        Arguments of `sweep` that say where to solve.
    """
    return Ledger(Path(path), _plan(problem, arguments).config).is_begun


def _plan(problem: Any, arguments: Mapping[str, Any]) -> Plan:
    return make_plan(
        problem,
        None,
        arguments.get("samples"),
        arguments.get("seed", 0),
        arguments.get("design"),
        arguments.get("points"),
    )


def _is_same_problem(finished: Dataset, plan: Plan) -> bool:
    # compared as the file has it: tuples are lists there
    return bool(finished.provenance.get("problem") == json.loads(json.dumps(plan.problem.describe())))


def _begins_alike(finished: Dataset, plan: Plan) -> bool:
    """Return whether the points of the smaller of two sweeps of one problem are the first of the larger."""
    known = finished.X
    n = min(len(known), len(plan.points))
    return len(known) != len(plan.points) and bool(np.array_equal(known[:n], plan.points[:n]))
