"""What a sweep expects of whatever it asks.

A problem of one's own has the five members of `Problem`, and a solver the one of `Solver`. Where that is more
than needed, `ExternalProblem` makes a problem of one function.
"""

from __future__ import annotations

import inspect
from typing import Any, Protocol, TypeGuard, runtime_checkable

import numpy as np

from palpate.dataset import Field, Layout
from palpate.units import Range

__all__ = [
    "Answer",
    "Chained",
    "Checking",
    "Designed",
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
        """Whether the rest means anything: an equilibrium within the model's reach."""

    @property
    def message(self) -> str:
        """Why the solver stopped."""

    @property
    def iterations(self) -> int:
        """What it cost."""

    @property
    def residual(self) -> float:
        """Relative error left."""


class Solver(Protocol):
    """An opened problem, which may keep what helps the next solve."""

    def solve(self, x: np.ndarray) -> Answer:
        """Answer for the inputs `x`, shape (n,)."""


@runtime_checkable
class Resettable(Protocol):
    """A solver that a worker keeps open from one chain to the next."""

    def solve(self, x: np.ndarray) -> Answer:
        """Answer for the inputs `x`, shape (n,)."""

    def reset(self) -> None:
        """Forget all earlier solves: what follows has the same bits as after opening."""


class Problem(Protocol):
    """A question with n inputs: a value that can be pickled. Opening it may be dear: it is done once per chain."""

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each input."""

    @property
    def layout(self) -> Layout:
        """Nodes at rest, axes, surface: what all answers have in common."""

    @property
    def schema(self) -> tuple[Field, ...]:
        """What each solve answers, such as `beam_fields` or `solid_fields` of `palpate.dataset`."""

    def describe(self) -> dict[str, Any]:
        """Everything that decides the answers, as plain data for a JSON file."""

    def open(self) -> Solver:
        """Get ready to solve."""


@runtime_checkable
class Chained(Protocol):
    """A problem that knows in which order its samples are solved well."""

    def chains(self, points: np.ndarray) -> list[np.ndarray]:
        """Rows of `points` (N, n), each in one chain that one solver solves in order.

        A chain starts from a solver just opened or reset. The chains may depend on nothing but the problem and
        the points.
        """


@runtime_checkable
class Designed(Protocol):
    """A problem that knows where it is sampled well.

    It may have a `design_name`; None says that just this problem leaves design and chains to the sweep.
    """

    def design(self, samples: int, seed: int) -> np.ndarray:
        """At most `samples` points, shape (N, n)."""


@runtime_checkable
class Checking(Protocol):
    """A problem that knows points at which it would be asked in vain."""

    def check_points(self, points: np.ndarray) -> None:
        """Refuse such points (N, n) with a `UsageError`."""


def own_design(problem: Problem) -> str | None:
    """Name of the problem's own design, or None."""
    if not isinstance(problem, Designed):
        return None
    name: str | None = getattr(problem, "design_name", "the problem's own")
    return name


def has_chains(problem: Problem) -> TypeGuard[Chained]:
    """Whether the problem parts its points into chains itself."""
    return isinstance(problem, Chained) and getattr(problem, "design_name", "") is not None


def missing_members(thing: object) -> list[str]:
    """What `thing` lacks of a `Problem`; no member is evaluated, for a layout may take a mesh."""
    members = ("ranges", "layout", "schema", "describe", "open")
    nothing = object()
    return [name for name in members if inspect.getattr_static(thing, name, nothing) is nothing]
