"""A solver that is not palpate's, as one function from inputs to answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.dataset import Field, Layout
from palpate.sweeps.problem import Answer
from palpate.units import Range

__all__ = ["ExternalProblem"]


@dataclass(frozen=True, eq=False)
class ExternalProblem:
    """A problem made of a function: another program, a formula, a table.

    Attributes
    ----------
    ranges : tuple of Range
        The n inputs.
    layout : Layout
    schema : tuple of Field
        What the function answers; ``solid_fields(nodes, ranges)`` and ``beam_fields(nodes)`` are those that
        palpate's own bodies answer.
    function : callable
        Takes the inputs (n,) and returns a mapping with the fields of the schema, and where it likes
        ``"converged"``, ``"message"``, ``"iterations"`` and ``"residual"``. It runs in the workers. An answer
        without ``"converged"`` counts as converged if all its numbers are finite.
    description : mapping
        Everything that decides the answers, as plain data for a JSON file: a sweep takes up an interrupted one
        only if this is the same. Of use is ``{"body": {"type": ...}}``.

    Examples
    --------
    >>> spring = ExternalProblem(
    ...     ranges=(Range("h", 0.0, 0.01, "m"),),
    ...     layout=Layout(rest=np.zeros((1, 3))),
    ...     schema=(Field("potential_energy", unit="J"),),
    ...     function=lambda x: {"potential_energy": 50.0 * x[0] ** 2},
    ...     description={"body": {"type": "spring", "stiffness": 100.0}},
    ... )
    >>> spring.open().solve(np.array([0.01])).potential_energy
    0.005
    """

    ranges: tuple[Range, ...]
    layout: Layout
    schema: tuple[Field, ...]
    function: Callable[[np.ndarray], Mapping[str, Any]]
    description: Mapping[str, Any] = field(default_factory=dict)

    def describe(self) -> dict[str, Any]:
        """The description and the name of the function."""
        name = getattr(self.function, "__qualname__", type(self.function).__qualname__)
        return {**self.description, "function": name}

    def open(self) -> _Asked:
        """Get ready to solve."""
        return _Asked(self)


@dataclass(frozen=True)
class _Asked:
    problem: ExternalProblem

    def solve(self, x: np.ndarray) -> Answer:
        """What the function says at `x`, with what it leaves unsaid."""
        answers = dict(self.problem.function(x))
        numbers = [answers[f.name] for f in self.problem.schema if f.name in answers]
        finite = all(np.isfinite(np.asarray(value, dtype=float)).all() for value in numbers)
        converged = bool(answers.get("converged", finite))
        message = "converged" if converged else "no finite answer" if not finite else "did not converge"
        unsaid = {"converged": converged, "message": message, "iterations": 0, "residual": np.nan}
        return SimpleNamespace(**unsaid | answers)
