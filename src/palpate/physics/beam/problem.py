"""A beam and its loads: the question that a sweep asks many times."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Field, Layout, beam_fields
from palpate.errors import UsageError
from palpate.physics.beam.loads import PointLoad
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.beam.cantilever import Cantilever
    from palpate.physics.beam.solution import Solution
    from palpate.physics.beam.solver import BeamSolver

__all__ = ["BeamProblem"]


@dataclass(frozen=True)
class BeamProblem:
    """A cantilever under point loads, whose sizes in N are the inputs.

    A plain value: it can be compared, hashed, pickled and sent to another process.

    Attributes
    ----------
    body : Cantilever
    loads : tuple of PointLoad
    """

    body: Cantilever
    loads: tuple[PointLoad, ...]

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each input."""
        return tuple(load.range for load in self.loads)

    @property
    def rest(self) -> np.ndarray:
        """Positions of the nodes at rest in m, shape (node, 2)."""
        x = self.body.vertices(self.loads)
        return np.column_stack([x, np.zeros_like(x)])

    @property
    def of_interest(self) -> np.ndarray:
        """Which nodes are of interest, bool of shape (node,)."""
        marked = np.zeros(len(self.rest), dtype=bool)
        marked[self._nodes_at(self.body.nodes)] = True
        return marked

    @property
    def load_nodes(self) -> tuple[int, ...]:
        """Index of the node that each load acts on."""
        return tuple(self._nodes_at(self.body.position(load) for load in self.loads))

    @property
    def load_directions(self) -> tuple[tuple[float, float], ...]:
        """Direction (x, y) of each load."""
        return tuple(load.direction for load in self.loads)

    @property
    def layout(self) -> Layout:
        """Nodes, axes and loads: what all answers have in common."""
        return Layout(self.rest, self.of_interest, self.load_nodes, self.load_directions)

    @property
    def schema(self) -> tuple[Field, ...]:
        """What each solve answers."""
        return beam_fields(len(self.rest))

    @property
    def hash(self) -> str:
        """SHA-256 of `describe`, as hexadecimal digits."""
        return hashlib.sha256(json.dumps(self.describe(), sort_keys=True).encode()).hexdigest()

    def describe(self) -> dict[str, Any]:
        """Everything that decides the answers, as plain data for a JSON file."""
        body = {"type": "Cantilever", **asdict(self.body)}
        body["section"] = {"type": type(self.body.section).__name__, **body["section"]}
        # what a viewer needs to draw the body, whatever its section is called
        body["half_height"] = self.body.section.half_height
        return {"body": body, "loads": [asdict(load) for load in self.loads]}

    def open(self) -> BeamSolver:
        """Build the finite elements; the solver that comes back is good for many solves."""
        from palpate.physics.beam.solver import BeamSolver

        return BeamSolver(self)

    def solve(self, x: Any) -> Solution:
        """Solve for loads `x` in N, shape (n,) or one number.

        Raises
        ------
        UsageError
            If `x` has not one number per load.
        """
        return self.open().solve(x)

    def sizes(self, x: Any) -> np.ndarray:
        """Loads as an array of shape (n,), in N.

        Raises
        ------
        UsageError
            If `x` has not one number per load.
        """
        sizes = np.atleast_1d(np.asarray(x, dtype=float))
        if sizes.shape != (len(self.loads),):
            raise UsageError(
                f"The loads given have the shape {sizes.shape}.",
                why=f"This problem has {len(self.loads)}: {', '.join(load.name for load in self.loads)}.",
                fix="Give one number per load, in this order.",
            )
        return sizes

    def _nodes_at(self, positions: Any) -> list[int]:
        x = self.rest[:, 0]
        return [int(np.argmin(np.abs(x - position))) for position in positions]
