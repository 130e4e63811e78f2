"""The contract between a sweep and whatever it asks."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np

from palpate.units import Range

__all__ = ["Answer", "Problem", "Solver"]


class Answer(Protocol):
    """One solve's answer, a value also where the solve failed.

    It may have a `largest_strain` too, a float, which then goes into the dataset.
    """

    @property
    def converged(self) -> bool:
        """Whether the rest means anything."""

    @property
    def message(self) -> str:
        """Why the solver stopped."""

    @property
    def iterations(self) -> int:
        """What it cost."""

    @property
    def residual(self) -> float:
        """Relative error left."""

    @property
    def displacement(self) -> np.ndarray:
        """(u_x, u_y) in m and rotation in rad of each node, shape (node, 3)."""

    @property
    def root_reaction(self) -> np.ndarray:
        """Force (x, y) in N and moment in N·m of the support on the body, shape (3,)."""

    @property
    def strain_energy(self) -> float:
        """In J."""

    @property
    def potential_energy(self) -> float:
        """In J."""


class Solver(Protocol):
    """An opened problem, which may keep what helps the next solve."""

    def solve(self, x: np.ndarray) -> Answer:
        """Answer for the inputs `x`, shape (n,)."""


@runtime_checkable
class Problem(Protocol):
    """A question with n inputs, which can be pickled. Opening it may be dear: it is done once per chunk."""

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each input."""

    @property
    def rest(self) -> np.ndarray:
        """Positions of the nodes at rest in m, shape (node, 2)."""

    @property
    def of_interest(self) -> np.ndarray:
        """Which nodes are of interest, bool of shape (node,)."""

    @property
    def load_nodes(self) -> tuple[int, ...]:
        """Index of the node that each input acts on."""

    @property
    def load_directions(self) -> tuple[tuple[float, float], ...]:
        """Direction (x, y) of each input."""

    def describe(self) -> dict[str, Any]:
        """Everything that decides the answers, as plain data for a JSON file."""

    def open(self) -> Solver:
        """Get ready to solve."""
