"""A beam and its loads, the question that a sweep asks many times; and its solution.

A solve always returns a solution, also where it failed: a plain value that says why.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Field, Layout, beam_fields
from palpate.errors import UsageError
from palpate.physics.beam.beam_loads import Load, PointLoad
from palpate.physics.stop import Stop
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.beam.beam_solver import BeamSolver
    from palpate.physics.beam.cantilever import Cantilever
    from palpate.physics.beam.history_solver import HistorySolver

__all__ = ["BeamProblem", "Solution"]

_DISSIPATED = Field("dissipated", unit="J", meaning="energy lost for good since the virgin beam")


@dataclass(frozen=True)
class BeamProblem:
    """A cantilever under loads, whose sizes in N, or what they ran through, are the inputs.

    A plain value: it can be compared, hashed, pickled and sent to another process.

    Attributes
    ----------
    body : Cantilever
        The beam.
    loads : tuple of loads
        Its loads, whose inputs follow each other.
    """

    body: Cantilever
    loads: tuple[Load, ...]

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each input."""
        return tuple(entry for load in self.loads for entry in load.inputs)

    @property
    def rest(self) -> np.ndarray:
        """Positions of the nodes at rest in m, shape (node, 2)."""
        x = self.body.vertices(self.loads)
        return np.column_stack([x, np.zeros_like(x)])

    @property
    def of_interest(self) -> np.ndarray:
        """Mask of the nodes of interest, bool of shape (node,)."""
        marked = np.zeros(len(self.rest), dtype=bool)
        marked[self._nodes_at(self.body.nodes)] = True
        return marked

    @property
    def load_nodes(self) -> tuple[int, ...]:
        """Index of the node that each input's load acts on."""
        nodes = zip(self.loads, self.nodes_of_loads, strict=True)
        return tuple(node for load, node in nodes for _ in load.inputs)

    @property
    def load_directions(self) -> tuple[tuple[float, float], ...]:
        """Direction (x, y) of each input's load."""
        return tuple(load.direction for load in self.loads for _ in load.inputs)

    @property
    def nodes_of_loads(self) -> tuple[int, ...]:
        """Index of the node that each load acts on."""
        return tuple(self._nodes_at(self.body.position(load) for load in self.loads))

    @property
    def layout(self) -> Layout:
        """Nodes, axes and loads: what all answers have in common."""
        return Layout(self.rest, self.of_interest, self.load_nodes, self.load_directions)

    @property
    def schema(self) -> tuple[Field, ...]:
        """Fields of each answer; a sweep asks for it."""
        fields = beam_fields(len(self.rest))
        return fields if self.body.kind == "elastic" else (*fields, _DISSIPATED)

    @property
    def hash(self) -> str:
        """SHA-256 of `describe`, as hexadecimal digits."""
        return hashlib.sha256(json.dumps(self.describe(), sort_keys=True).encode()).hexdigest()

    def describe(self) -> dict[str, Any]:
        """Return everything that decides the answers, as plain data for a JSON file."""
        body = {"type": "Cantilever", **asdict(self.body)}
        body["section"] = {"type": type(self.body.section).__name__, **body["section"]}
        if self.body.kind == "elastic":
            # an elastic beam has no use for them, and is described as ever
            del body["fibres"], body["tolerance"]
        else:
            body["material"] = self.body.material.describe()
        # what a viewer needs to draw the body, whatever its section is called
        body["half_height"] = self.body.section.half_height
        return {"body": body, "loads": [_description(load) for load in self.loads]}

    def open(self) -> BeamSolver | HistorySolver:
        """Build the finite elements; the solver that comes back is good for many solves."""
        if self.body.kind == "elastic":
            from palpate.physics.beam.beam_solver import BeamSolver

            return BeamSolver(self)
        from palpate.physics.beam.history_solver import HistorySolver

        return HistorySolver(self)

    def solve(self, x: Any) -> Solution:
        """Solve for inputs `x`, shape (n,) or one number; most are loads in N.

        A beam that remembers runs through the history that the inputs mean, from its virgin state.

        Raises
        ------
        UsageError
            If `x` has not one number per input.
        """
        return self.open().solve(x)

    def solve_path(self, loads: Any, times: Any = None) -> list[Solution]:
        """Follow a history of loads from the virgin beam.

        Parameters
        ----------
        loads : (N, n) or (N,) array
            Sizes of the n loads in N; between two rows they change evenly.
        times : (N,) array, optional
            In s, not falling; a viscoelastic beam needs them.

        Returns
        -------
        list of Solution
            One for each row.

        Raises
        ------
        UsageError
            If the arrays do not fit.
        """
        return self.open().march(loads, times)

    def program(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return times (N,) and loads (N, n) in N that the inputs `x` stand for."""
        values = iter(x.tolist())
        runs = [load.knots(tuple(next(values) for _ in load.inputs)) for load in self.loads]
        times = np.unique([time for run in runs for time, _ in run])
        # before its first knot a load grows from nothing
        columns = [np.interp(times, *np.transpose([(-1e-300, 0.0), *run])) for run in runs]
        return times, np.stack(columns, axis=-1)

    def sizes(self, x: Any) -> np.ndarray:
        """Return inputs as an array of shape (n,); most are loads in N.

        Raises
        ------
        UsageError
            If `x` has not one number per input.
        """
        sizes = np.atleast_1d(np.asarray(x, dtype=float))
        names = [entry.name for entry in self.ranges]
        if sizes.shape != (len(names),):
            raise UsageError(
                f"The loads given have the shape {sizes.shape}.",
                why=f"This problem has {len(names)}: {', '.join(names)}.",
                fix="Give one number per load, in this order.",
            )
        return sizes

    def _nodes_at(self, positions: Any) -> list[int]:
        x = self.rest[:, 0]
        return [int(np.argmin(np.abs(x - position))) for position in positions]


def _description(load: Load) -> dict[str, Any]:
    plain = asdict(load)  # type: ignore[call-overload]
    return plain if isinstance(load, PointLoad) else {"type": type(load).__name__, **plain}


@dataclass(frozen=True)
class Solution:
    """Equilibrium of a beam, or the reason why there is none.

    Attributes
    ----------
    stop : Stop
        Why the solver stopped.
    iterations : int
        Newton iterations spent, over all load steps.
    residual : float
        √(Newton decrement / energy): about the relative error left, in the energy norm.
    displacement : (node, 3) array
        u_x and u_y in m and the rotation in rad, counter-clockwise, at the mesh's vertices. NaN unless
        converged, as are all the fields below.
    root_reaction : (3,) array
        Force (x, y) in N and moment in N·m that the clamp exerts on the beam.
    strain_energy, potential_energy : float
        In J; the potential energy is the strain energy, that is what can be had back, less the work potential of loads
        and weight.
    largest_strain : float
        Largest strain of a fibre along the beam, |ε| + |κ| times the section's half height: what tells whether a
        linear elastic material could bear the load.
    detail : str
        Figures that belong to the reason.
    state : (dof,) array
        All unknowns, for a warm start.
    time : float
        In s, of a beam that follows a history; else NaN.
    dissipated : float
        Energy in J lost for good since the virgin beam: plastic work, or what dashpots took. The work of loads and
        weight is strain energy plus this.
    history : value
        All that the future of a beam that remembers depends on, to march on from; else None.
    """

    stop: Stop
    iterations: int
    residual: float
    displacement: np.ndarray
    root_reaction: np.ndarray
    strain_energy: float
    potential_energy: float
    largest_strain: float = np.nan
    detail: str = ""
    state: np.ndarray = field(default_factory=lambda: np.empty(0), repr=False)
    time: float = np.nan
    dissipated: float = 0.0
    history: Any = field(default=None, repr=False)

    @property
    def converged(self) -> bool:
        """True for a stable equilibrium within the model's reach."""
        return self.stop is Stop.CONVERGED

    @property
    def message(self) -> str:
        """The reason in words, with its figures."""
        return f"{self.stop} ({self.detail})" if self.detail else str(self.stop)
