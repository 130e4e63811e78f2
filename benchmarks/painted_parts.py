"""Organs touched wherever they were painted: the error over all of the painted area, what is not trained being missed.

    python -m benchmarks.painted_parts [PART …] [--solves 60] [--unseen 30] [--folder DIR] [--out FILE.json]

PART is kidney, liver, heart, prostate, one of `scripted_parts`, or a file. Each gets the study that `palpate touch`
makes of it; solves are chosen as there, until there are so many. Then presses that nothing was learnt from are solved,
drawn evenly over the painted area and all depths. A press outside the trained region counts as missed, and its error
counts no less. Not one of the tables that run by themselves: an organ takes a quarter of an hour.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import scripted_parts

SAMPLES = ("kidney", "liver", "heart", "prostate")
SEED = 99  # of the presses that judge
FLOOR = 0.05  # of the largest force: what errors of smaller forces are over


def judge(problem: Any, surrogate: Any, unseen: int = 30, *, seed: int = SEED) -> dict[str, float]:
    """Return the errors of a surrogate's force on presses all over the painted area, and how many are not trained.

    Presses that can't be solved are left out, and counted.
    """
    from palpate.sweeps import sweep

    acting = problem.interactions[0]
    points = acting.random_presses(problem.body.geometry, unseen, seed)
    solved = sweep(problem, points=points, progress=False).ok
    force = np.asarray(solved.force)
    size = np.linalg.norm(force, axis=1)
    errors = np.linalg.norm(surrogate.energy.force(solved.X) - force, axis=1)
    errors = errors / np.maximum(size, FLOOR * size.max())
    inside, deviation = surrogate.energy.inside(solved.X), surrogate.energy.deviation(solved.X)
    return {
        "presses": len(solved),
        "unsolved": unseen - len(solved),
        "missed": float(1 - inside.mean()),
        "median": float(np.median(errors)),
        "p95": float(np.quantile(errors, 0.95)),
        "largest": float(errors.max()),
        "p95_trained": float(np.quantile(errors[inside], 0.95)) if inside.any() else float("nan"),
        # the interval of 90 % of a normal law
        "coverage": float((errors <= 1.645 * deviation).mean()),
    }


def part_file(name: str, folder: Path) -> Path:
    """Return the file of a part by its name, written where it is not there yet."""
    from palpate.physics.shapes.sample_part import write_sample_part

    if Path(name).exists():
        return Path(name)
    if name in SAMPLES:
        path = folder / f"{name}.stl"
        return path if path.exists() else write_sample_part(path)
    return Path(getattr(scripted_parts, name)(folder))


def touch(part: Path, solves: int, unseen: int) -> dict[str, Any]:
    """Return what the surrogate of so many solves of a part is worth all over its paint."""
    from palpate.options import ImprovementOptions
    from palpate.study.improve_study import improve_study
    from palpate.study.part_study import part_study, part_text, study_file
    from palpate.study.run import Paths
    from palpate.study.toml import read_study

    file = study_file(part)
    if not file.exists():
        file.write_text(part_text(*part_study(part)), encoding="utf-8")
    study, began = read_study(file), time.perf_counter()
    last = None
    for step in improve_study(
        study,
        Paths(part.parent, study.name),
        options=ImprovementOptions(until=1e-3, most=solves),
        progress=False,
    ):
        last = step
    assert last is not None
    assert last.surrogate is not None
    row: dict[str, Any] = {"part": part.stem, "solves": last.solves, "seconds": time.perf_counter() - began}
    row |= last.surrogate.meta.get("painted", {})
    return row | judge(study.problem(), last.surrogate, unseen)


def main() -> None:
    """Judge the parts that are named, or the kidney and the liver, and write their figures after each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=["kidney", "liver"])
    parser.add_argument("--solves", type=int, default=60)
    parser.add_argument("--unseen", type=int, default=30)
    parser.add_argument("--folder", type=Path, default=Path("parts"))
    parser.add_argument("--out", type=Path, default=Path("painted_parts.json"))
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in given.parts:
        rows.append(touch(part_file(name, given.folder), given.solves, given.unseen))
        given.out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        print(rows[-1])


if __name__ == "__main__":
    main()
