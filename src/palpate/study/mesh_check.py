"""The mesh's own error of a study: a few unseen touches, solved again with elements half as large."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.files import restore_folder, write_file
from palpate.format import count, millimetres, share
from palpate.physics.solid.finer_problem import FINER, finer_problem
from palpate.processes import CASE_LIMIT
from palpate.study.probe_kind import ProbeTestRecord
from palpate.study.stage_records import PressSweepRecord, TouchTargetRecord
from palpate.study.study import Study
from palpate.study.study_paths import Paths
from palpate.sweeps import sweep
from palpate.validation.figures.mesh_error import own_errors, part_of_mesh
from palpate.validation.unseen_solves import TouchSolves

__all__ = ["load_finer", "mesh_part", "refine_study", "solve_finer"]

LIGHT = 0.05  # share of the largest force: a touch below it says little of a relative error
PILOTS = 3  # touches by which the size of the elements is chosen
LIMIT = 0.035  # largest part of the mesh where a study asks for none


def solve_finer(
    study: Study,
    paths: Paths | None,
    unseen: Dataset | None,
    *,
    cluster: Any = None,
    progress: Any = True,
    case_limit: float = CASE_LIMIT,
    log: Callable[[str], None] = lambda _: None,
) -> Dataset | None:
    """Solve some of the unseen touches of a study with elements half as large; what is kept at `paths` is returned.

    They are taken evenly over the forces, of places of their own as far as there are any. None where the study asks for
    none, or such a mesh can't be made.
    """
    if unseen is None or not isinstance(study.test, ProbeTestRecord) or not study.test.finer:
        return None
    places = _spread_rows(unseen.ok, study.test.finer)
    if not len(places):
        return None
    if paths is not None and (kept := load_finer(study, paths)) is not None and _are_in(kept.X, unseen.X):
        return kept
    log(f"{count(len(places), 'unseen touch', 'unseen touches')} once more, on elements half as large")
    try:
        data = sweep(
            finer_problem(study.problem(), places),
            points=places,
            cluster=cluster,
            progress=progress,
            max_failed=1.0,
            case_limit=case_limit,
        )
    except UsageError as error:  # so many elements are refused
        log(f"the mesh's own error stays unknown: {error.what}")
        return None
    if paths is not None:
        data.save(paths.finer, overwrite=True)
    return data if len(data.ok) else None


def refine_study(
    study: Study,
    file: Path,
    *,
    cluster: Any = None,
    progress: Any = True,
    log: Callable[[str], None] = lambda _: None,
) -> Study:
    """Return a study whose elements keep the mesh's part within half the limit, and write their size into its file.

    A few touches are solved on its elements and on those half as large. The error goes with the square of the size, so
    the size follows from it; elements that are fine enough stay, and none becomes smaller than half. A study in which
    no ball touches is refused.
    """
    if not isinstance(study.sweep, PressSweepRecord) or not isinstance(study.target, TouchTargetRecord):
        raise UsageError(
            f"The elements of {study.name} can't be chosen by touches.",
            why="No ball touches its body.",
            fix="Leave --element auto out.",
        )
    problem = study.problem()
    places = problem.design(PILOTS, study.sweep.seed, depths=1)
    options = {"points": places, "cluster": cluster, "progress": progress, "max_failed": 1.0}
    log(f"{count(PILOTS, 'touch', 'touches')} on two meshes, for the size of the elements")
    ordinary, finer = (sweep(p, **options) for p in (problem, finer_problem(problem, places)))
    part, wanted = mesh_part(ordinary.ok, finer.ok), (study.target.mesh_force or LIMIT) / 2
    size = study.sweep.element or min(part.element for part in problem.refinements)
    if not part > wanted:
        log(f"elements of {millimetres(size)} do: the mesh's part is {share(part)}")
        return study
    smaller = float(f"{size * max(FINER, math.sqrt(wanted / part)):.2g}")
    left = part * (smaller / size) ** 2
    log(
        f"elements of {millimetres(smaller)}, since the mesh's part is {share(part)} with {millimetres(size)}; about "
        f"{share(left)} is left"
        + (", for which the file can ask for smaller ones" if left > 2 * wanted else "")
    )
    document = tomlkit.parse(file.read_text(encoding="utf-8"))
    document.setdefault("sweep", tomlkit.table())["element"] = smaller
    write_file(file, tomlkit.dumps(document))
    return study.model_copy(update={"sweep": study.sweep.model_copy(update={"element": smaller})})


def mesh_part(unseen: Dataset | None, finer: Dataset | None) -> float:
    """Return the mesh's part in the relative force error of unseen solves; not-a-number where it is not known."""
    if unseen is None or finer is None:
        return math.nan
    spans = np.array([r.high - r.low for r in unseen.ranges])
    ordinary, refined = (TouchSolves.of(data, data.ranges) for data in (unseen, finer))
    part = part_of_mesh(own_errors(ordinary, refined, spans))
    return math.nan if part is None else part


def load_finer(study: Study, paths: Paths) -> Dataset | None:
    """Return the finer solves that are kept of just this study's body and ball; None where there are none."""
    if not isinstance(study.test, ProbeTestRecord):
        return None
    restore_folder(paths.finer)
    if not paths.finer.exists():
        return None
    data = Dataset.open(paths.finer)
    # compared as the file has it: tuples are lists there
    wanted = json.loads(json.dumps(finer_problem(study.problem(), data.X).describe()))
    return data if data.provenance.get("problem") == wanted and len(data.ok) else None


def _spread_rows(unseen: Dataset, number: int) -> np.ndarray:
    """Return inputs (≤ number, n) of unseen solves from a light touch to the strongest, evenly by rank of the force."""
    size = np.linalg.norm(TouchSolves.of(unseen, unseen.ranges).force, axis=1)
    heavy = np.flatnonzero(size > LIGHT * size.max(initial=0.0))
    order = heavy[np.argsort(size[heavy], kind="stable")]
    ranks = (np.arange(min(number, len(order))) + 0.5) / max(number, 1) * len(order)
    return np.asarray(unseen.X[order[ranks.astype(int)]])


def _are_in(X: np.ndarray, unseen: np.ndarray) -> bool:
    """Return whether all of the inputs (M, n) are among those of unseen solves (N, n)."""
    return bool((X[:, None] == unseen[None]).all(axis=2).any(axis=1).all())
