"""Solves that are added batch by batch, in memory or in files that an interruption leaves whole.

While a batch is solved, its points stand in ``NAME.zarr.batch`` beside its finished parts. A later run solves the rest
of it before it chooses again.
"""

from __future__ import annotations

import json
import operator
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset, Field, Layout
from palpate.errors import UsageError
from palpate.files import restore_folder, write_file
from palpate.sweeps import Problem, Solver, sweep
from palpate.sweeps.grow_sweep import CHOSEN
from palpate.sweeps.plan import provenance
from palpate.units import Range

__all__ = ["KeptSolves"]

Groups = Sequence[np.ndarray]
"""Points (m, n) of each group that one solver solves in order: a single place, or a depth series."""


@dataclass(frozen=True, eq=False)
class _Batch:
    """A problem whose points are solved group by group, so that a small batch keeps all workers busy.

    It is pickled as the problem alone: workers keep that open from batch to batch.
    """

    problem: Any
    sizes: tuple[int, ...]

    @property
    def ranges(self) -> tuple[Range, ...]:
        return tuple(self.problem.ranges)

    @property
    def layout(self) -> Layout:
        layout: Layout = self.problem.layout
        return layout

    @property
    def schema(self) -> tuple[Field, ...]:
        return tuple(self.problem.schema)

    @property
    def symmetry(self) -> Any:
        return getattr(self.problem, "symmetry", None)

    @property
    def words(self) -> str:
        return str(getattr(self.problem, "words", ""))

    def describe(self) -> dict[str, Any]:
        return dict(self.problem.describe())

    def open(self) -> Solver:
        solver: Solver = self.problem.open()
        return solver

    def check_points(self, points: np.ndarray) -> None:
        if hasattr(self.problem, "check_points"):
            self.problem.check_points(points)

    def chains(self, points: np.ndarray) -> list[np.ndarray]:
        return np.split(np.arange(len(points)), np.cumsum(self.sizes)[:-1])

    def __reduce__(self) -> tuple[Any, ...]:
        return operator.itemgetter(0), ((self.problem,),)


@dataclass(eq=False)
class KeptSolves:
    """The solves of one purpose, to learn from or to judge by."""

    problem: Problem
    path: Path | None = None  # folder ``NAME.zarr`` of the dataset; None keeps it in memory
    design: str = CHOSEN  # for the provenance: solves chosen, or points given
    options: dict[str, Any] = field(default_factory=dict)  # of `palpate.sweep`
    data: Dataset | None = None  # all solves so far, failed ones among them

    @classmethod
    def open(cls, problem: Problem, path: Path | None, *, design: str = CHOSEN, **options: Any) -> KeptSolves:
        """Return what earlier runs of the same problem have kept, and the whole of a batch that one of them began."""
        kept = cls(problem, path, design, options)
        if path is None:
            return kept
        restore_folder(path)
        if path.exists():
            kept.data = Dataset.open(path)
            # compared as the file has it: tuples are lists there
            if kept.data.provenance.get("problem") != json.loads(json.dumps(problem.describe())):
                raise UsageError(
                    f"{path} holds solves of another problem.",
                    why="Body, probe, templates or mapping were changed after these solves.",
                    fix="Delete it, or write to another path.",
                )
        if (plan := kept._unfinished()) is not None:
            kept.add(plan)
        return kept

    def __len__(self) -> int:
        return 0 if self.data is None else len(self.data)

    @property
    def good(self) -> Dataset | None:
        """The solves that converged."""
        return None if self.data is None else self.data.ok

    @property
    def X(self) -> np.ndarray:
        """Inputs (N, n) of all solves, those that failed among them."""
        return np.empty((0, len(self.problem.ranges))) if self.data is None else self.data.X

    def add(self, groups: Groups) -> Dataset:
        """Solve further points and return them; each group is solved in order by one solver.

        It is an error where more than half of the first points fail.
        """
        points, sizes = np.concatenate(groups), tuple(len(g) for g in groups)
        folder = self._folder
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            plan = {"after": self._hash, "groups": [np.asarray(g).tolist() for g in groups]}
            write_file(folder / "points.json", json.dumps(plan))
        batch = sweep(
            _Batch(self.problem, sizes),
            points=points,
            path=None if folder is None else folder / "solves.zarr",
            # where nothing is known yet, half must be solved; a later batch may lie where none can be
            max_failed=0.5 if self.data is None else 1.0,
            **self.options,
        )
        batch = Dataset(batch.data.load())  # its folder is about to go
        joined = batch if self.data is None else Dataset.concat([self.data, batch])
        origin = provenance(self.problem, joined.X, self.design, 0)
        self.data = Dataset(joined.data.assign_attrs(provenance=json.dumps(origin, sort_keys=True)).load())
        if self.path is not None and folder is not None:
            self.data.save(self.path, overwrite=True)
            shutil.rmtree(folder, ignore_errors=True)
        return batch

    @property
    def _folder(self) -> Path | None:
        return None if self.path is None else self.path.with_name(self.path.name + ".batch")

    @property
    def _hash(self) -> str:
        return "" if self.data is None else self.data.hash

    def _unfinished(self) -> list[np.ndarray] | None:
        """Return the points of a batch that was begun after these solves; None where there is none."""
        folder = self._folder
        if folder is None or not folder.exists():
            return None
        try:
            plan = json.loads((folder / "points.json").read_text(encoding="utf-8"))
            if plan["after"] == self._hash:
                return [np.array(g, dtype=float) for g in plan["groups"]]
        except (OSError, ValueError, KeyError, TypeError):
            pass  # written by nobody, or not to its end: nothing was solved for it
        shutil.rmtree(folder, ignore_errors=True)
        return None
