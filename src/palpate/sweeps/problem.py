"""The contract between a sweep and the problem that it asks.

A problem of one's own has the five members of `Problem`, and a solver the one of `Solver`. Where that is more
than needed, `ExternalProblem` makes a problem of one function, for example of another program's solver.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, Protocol, TypeGuard, runtime_checkable

import numpy as np

from palpate.dataset import Field, Layout
from palpate.units import Range

__all__ = [
    "Answer",
    "Chained",
    "Checking",
    "Designed",
    "ExternalProblem",
    "Problem",
    "Resettable",
    "Solver",
    "has_chains",
    "missing_members",
    "own_design",
]


class Answer(Protocol):
    """One solve's answer, a value also where the solve failed.

    Besides these it has an attribute for each field of the problem's schema, of that field's shape; they are
    only read where `converged`.
    """

    @property
    def converged(self) -> bool:
        """True where the answer is an equilibrium within the model's reach; only then the rest means anything."""

    @property
    def message(self) -> str:
        """Reason why the solver stopped."""

    @property
    def iterations(self) -> int:
        """Number of Newton iterations."""

    @property
    def residual(self) -> float:
        """Relative error left."""


class Solver(Protocol):
    """An opened problem, which may keep what helps the next solve."""

    def solve(self, x: np.ndarray) -> Answer:
        """Solve for the inputs `x`, shape (n,)."""


@runtime_checkable
class Resettable(Protocol):
    """A solver that a worker keeps open from one chain to the next."""

    def solve(self, x: np.ndarray) -> Answer:
        """Solve for the inputs `x`, shape (n,)."""

    def reset(self) -> None:
        """Forget all earlier solves: what follows has the same bits as after opening."""


class Problem(Protocol):
    """A question with n inputs: a value that can be pickled. Opening it may be dear: it is done once per chain."""

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each input."""

    @property
    def layout(self) -> Layout:
        """Nodes at rest, axes and surface, which all answers have in common."""

    @property
    def schema(self) -> tuple[Field, ...]:
        """Fields that each solve answers, such as `beam_fields` or `solid_fields` of `palpate.dataset`."""

    def describe(self) -> dict[str, Any]:
        """Return everything that decides the answers, as plain data for a JSON file."""

    def open(self) -> Solver:
        """Make a solver."""


@runtime_checkable
class Chained(Protocol):
    """A problem that knows in which order its samples are solved well."""

    def chains(self, points: np.ndarray) -> list[np.ndarray]:
        """Return the rows of `points` (N, n) in chains, each of which one solver solves in order.

        A chain starts from a solver just opened or reset. The chains may depend on nothing but the problem and
        the points.
        """


@runtime_checkable
class Designed(Protocol):
    """A problem that knows where it is sampled well.

    It may have a `design_name`; None says that just this problem leaves design and chains to the sweep.
    """

    def design(self, samples: int, seed: int) -> np.ndarray:
        """Place at most `samples` points, shape (N, n)."""


@runtime_checkable
class Checking(Protocol):
    """A problem that refuses points at which no answer can be expected."""

    def check_points(self, points: np.ndarray) -> None:
        """Raise a `UsageError` for such points (N, n)."""


def own_design(problem: Problem) -> str | None:
    """Return the name of the problem's own design, or None."""
    if not isinstance(problem, Designed):
        return None
    name: str | None = getattr(problem, "design_name", "the problem's own")
    return name


def has_chains(problem: Problem) -> TypeGuard[Chained]:
    """Tell whether the problem arranges its points in chains itself."""
    return isinstance(problem, Chained) and getattr(problem, "design_name", "") is not None


def missing_members(thing: object) -> list[str]:
    """Return the members of a `Problem` that `thing` lacks; none is evaluated, for a layout may take a mesh."""
    members = ("ranges", "layout", "schema", "describe", "open")
    nothing = object()
    return [name for name in members if inspect.getattr_static(thing, name, nothing) is nothing]


@dataclass(frozen=True, eq=False)
class ExternalProblem:
    """A problem made of a function: another program, a formula, a table.

    Attributes
    ----------
    ranges : tuple of Range
        The n inputs.
    layout : Layout
        Nodes, axes and surface of the body.
    schema : tuple of Field
        Fields that the function answers; ``solid_fields(nodes, ranges)`` and ``beam_fields(nodes)`` are those that
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
        """Return the description with the name of the function."""
        name = getattr(self.function, "__qualname__", type(self.function).__qualname__)
        return {**self.description, "function": name}

    def open(self) -> _FunctionSolver:
        """Make a solver."""
        return _FunctionSolver(self)


@dataclass(frozen=True)
class _FunctionSolver:
    problem: ExternalProblem

    def solve(self, x: np.ndarray) -> Answer:
        """Call the function at `x` and complete its answer."""
        answers = dict(self.problem.function(x))
        numbers = [answers[f.name] for f in self.problem.schema if f.name in answers]
        finite = all(np.isfinite(np.asarray(value, dtype=float)).all() for value in numbers)
        converged = bool(answers.get("converged", finite))
        message = "converged" if converged else "no finite answer" if not finite else "did not converge"
        defaults = {"converged": converged, "message": message, "iterations": 0, "residual": np.nan}
        return SimpleNamespace(**defaults | answers)
