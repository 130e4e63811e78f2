"""The mesh's stated part in the force error, beside what other touches show on a mesh twice as fine.

    python -m benchmarks.mesh_parts block breast-dome kidney     or any other named study; 1 to 10 minutes each

As `palpate sweep` does, three unseen touches of a study are solved on its elements and on those half as large around
them, and the mesh's part is stated from them. The rival is what the statement speaks of: the 95th percentile of other
unseen touches, alike on both meshes, one after the other. A stated part within a factor of two of theirs is right.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from palpate.physics.shapes.sample_part import write_sample_part
from palpate.physics.solid.finer_problem import finer_problem
from palpate.study.mesh_check import LIGHT
from palpate.study.named_studies import preset_names, preset_study
from palpate.study.part_study import part_study
from palpate.study.stage_records import ProbeTestRecord
from palpate.study.study import Study
from palpate.validation.figures.mesh_error import WHOLE, part_of_mesh

__all__ = ["mesh_parts"]

TOUCHES, STATED, OTHERS = 10, 3, 5  # unseen touches; those that state the part, and that judge the statement


def mesh_parts(study: Study) -> tuple[float, float]:
    """Return the mesh's part in the force error of a study as it is stated, and as other touches show it."""
    problem, sampled = study.problem(), study.test
    assert isinstance(sampled, ProbeTestRecord)
    places = problem.design(TOUCHES, sampled.seed, depths=1)
    ordinary = _forces(problem, places)
    size = np.linalg.norm(ordinary, axis=1)
    heavy = [int(row) for row in np.argsort(size) if size[row] > LIGHT * size.max()]
    rows = [heavy[int((k + 0.5) / STATED * len(heavy))] for k in range(STATED)]
    others = [row for row in heavy if row not in rows]
    others = [others[k] for k in np.linspace(0, len(others) - 1, OTHERS).round().astype(int)]

    stated = _differences(ordinary[rows], _forces(finer_problem(problem, places[rows]), places[rows]))
    finer = [_forces(finer_problem(problem, places[[row]]), places[[row]])[0] for row in others]
    shown = _differences(ordinary[others], np.array(finer))
    print(f"  stated by {np.round(100 * stated, 2)} %, others {np.round(100 * shown, 2)} %", flush=True)
    part = part_of_mesh(stated)
    assert part is not None
    return part, float(WHOLE * np.quantile(shown, 0.95))


def _differences(ordinary: np.ndarray, finer: np.ndarray) -> np.ndarray:
    """Return relative differences (N,) of forces (N, 3)."""
    return np.asarray(np.linalg.norm(ordinary - finer, axis=1) / np.linalg.norm(finer, axis=1))


def _forces(problem: Any, places: np.ndarray) -> np.ndarray:
    """Return forces (N, 3) in N at places (N, 3) in m."""
    solver = problem.open()
    return np.array([solver.solve(place).response[:3] for place in places])


def _study(name: str) -> Study:
    """A named study, or that of a sample part."""
    if name.removesuffix("-quick") in preset_names():
        return preset_study(name.removesuffix("-quick"), quick=name.endswith("-quick"))
    folder = Path(tempfile.mkdtemp())
    return part_study(write_sample_part(folder / f"{name}.stl", name))[0]


def main() -> None:
    """Print both parts of each study that is named."""
    for name in sys.argv[1:] or ("block", "breast-dome", "kidney"):
        stated, shown = mesh_parts(_study(name))
        print(f"{name}: stated {stated:.1%}, shown {shown:.1%}, ratio {stated / shown:.2f}", flush=True)


if __name__ == "__main__":
    main()
