"""Problems whose answers are numbers of another program, which a mapping names: what all of them share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.dataset import Field, Layout
from palpate.dataset.readers.mapping import ImportMapping
from palpate.errors import SolverError
from palpate.sweeps.answer_files import SavedCase
from palpate.sweeps.problem import Answer
from palpate.units import Range

__all__ = ["CaseFailure", "MappedProblem", "MappedSolver"]


class CaseFailure(SolverError):
    """A case that has no answer; its words become the message of its row."""


class MappedProblem:
    """A problem of a dataclass with `ranges` and `mapping`, which adds where its answers come from."""

    ranges: tuple[Range, ...]
    mapping: ImportMapping  # meaning of the answers

    @property
    def first(self) -> SavedCase:
        """A case that says what the others look like."""
        raise NotImplementedError

    def source(self) -> dict[str, Any]:
        """Return what decides the answers besides the mapping, as plain data."""
        raise NotImplementedError

    def values(self, x: np.ndarray) -> Mapping[str, np.ndarray]:
        """Return the answers by name for the inputs `x` (n,); a `CaseFailure` where there are none."""
        raise NotImplementedError

    @property
    def words(self) -> str:
        """Name of the body."""
        return self.mapping.name

    @property
    def layout(self) -> Layout:
        """Nodes and surface of the first case."""
        return self.first.layout

    @property
    def schema(self) -> tuple[Field, ...]:
        """Fields that the mapping names, with the sizes of the first case."""
        return self.first.fields

    def describe(self) -> dict[str, Any]:
        """Return everything that decides the answers, as plain data."""
        mapping = self.mapping
        words = mapping.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        return {
            "body": {"type": "imported", "name": mapping.name, "mirrored": mapping.mirrored, **mapping.body},
            "interactions": [dict(entry) for entry in mapping.interactions],
            "solver": {**self.source(), "mapping": words},
        }

    def chains(self, points: np.ndarray) -> list[np.ndarray]:
        """Return each row of `points` (N, n) as a chain of its own: no solve starts from another."""
        return [np.array([row]) for row in range(len(points))]

    def open(self) -> MappedSolver:
        """Make a solver."""
        return MappedSolver(self)

    def tidy(self) -> None:
        """Remove what was kept for an interruption: nothing, unless the kind of problem says otherwise."""


@dataclass(frozen=True)
class MappedSolver:
    """A solver of such a problem; a case without an answer becomes a row with its reason."""

    problem: MappedProblem

    def reset(self) -> None:
        """Forget earlier cases, of which nothing is kept anyway."""

    def solve(self, x: np.ndarray) -> Answer:
        """Return the answers for the inputs `x` (n,)."""
        ended: dict[str, Any] = {"iterations": 0, "residual": math.nan}
        try:
            values = self.problem.values(x)
        except CaseFailure as error:
            return SimpleNamespace(converged=False, message=f"{error.what}\n{error.why}".rstrip(), **ended)
        return SimpleNamespace(converged=True, message="solved", **ended, **values)
