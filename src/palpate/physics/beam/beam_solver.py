"""Solving one elastic beam for many loads, each from the last one's answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.beam.beam_energy import BeamEnergy, BeamStep
from palpate.physics.beam.beam_newton import Equilibrium, LoadPath, follow
from palpate.physics.beam.beam_problem import BeamProblem, Solution
from palpate.physics.beam.section_laws import section_law
from palpate.physics.stop import Stop

__all__ = ["STANDARD_GRAVITY", "BeamSolver", "LoadedBeam"]

STANDARD_GRAVITY = 9.80665  # m/s², 3rd General Conference on Weights and Measures 1901
COARSE = 1.0  # rad that one element may bend: cubics follow a quarter of a circle to about 1e-3
# In one load step, more bending of an element or more turning of a section hints at another equilibrium: a load
# across turns a beam at rest by at most a quarter of a circle, and more only where it loops.
FAR_BEND, FAR_TURN = 0.5, 2.0  # rad


class LoadedBeam:
    """Finite elements of a beam with the vectors of its loads, and the checks that all its solves share.

    `weight` (dof,) is the load vector of the beam's weight, zero without it.
    """

    def __init__(self, problem: BeamProblem) -> None:
        body = problem.body
        self.body = body
        self._large = body.kinematics == "large"
        self.energy = BeamEnergy(
            body.vertices(problem.loads), body.order, section_law(body), large=self._large
        )
        self._directions = np.zeros((len(problem.loads), self.energy.size))
        for row, node, load in zip(self._directions, problem.nodes_of_loads, problem.loads, strict=True):
            # node 0 is clamped and has no unknowns
            row[self.energy.vertex_dofs[node - 1, :2]] = load.direction
        weight = STANDARD_GRAVITY * body.material.density * body.section.area if body.self_weight else 0.0
        self.weight, self._clamp_weight = self.energy.elements.uniform((0.0, -weight))

    def load(self, sizes: np.ndarray) -> np.ndarray:
        """Return the load vector (dof,) of the weight and of loads of the given sizes (n,) in N."""
        vector: np.ndarray = sizes @ self._directions + self.weight
        return vector

    def fibre_strain(self, z: np.ndarray) -> float:
        """Return the largest |ε| + |κ| times the section's half height.

        It is that of an elastic beam from end to end, and that at the Gauss points of one with memory, where its
        section law acts.
        """
        elastic = self.body.kind == "elastic"
        strains = self.energy.strains_end_to_end(z) if elastic else self.energy.strains(z)
        axial, _, curvature = np.moveaxis(np.abs(strains), -1, 0)
        return float((axial + self.body.section.half_height * curvature).max())

    def bend(self, z: np.ndarray) -> float:
        """Return the largest angle in rad by which one element bends."""
        return float(np.abs(np.diff(z[self.energy.vertex_dofs[:, 2]], prepend=0.0)).max())

    def admit(self, z: np.ndarray) -> Stop:
        """Return `Stop.CONVERGED`, or why the model does not hold at a state."""
        if self.fibre_strain(z) > self.body.strain_limit:
            return Stop.STRAIN_LIMIT
        return Stop.COARSE_MESH if self._large and self.bend(z) > COARSE else Stop.CONVERGED

    def is_near(self, before: np.ndarray, after: np.ndarray) -> bool:
        """Return whether a load step from one state to the other stays on one branch of equilibria."""
        if not self._large:
            return True  # there is one equilibrium only
        turned = after - before
        turn = float(np.abs(turned[self.energy.vertex_dofs[:, 2]]).max())
        return self.bend(turned) <= FAR_BEND and turn <= FAR_TURN

    def displacement(self, z: np.ndarray) -> np.ndarray:
        """Return u_x, u_y and rotation at the vertices, shape (node, 3)."""
        return np.vstack([np.zeros(3), z[self.energy.vertex_dofs]])

    def root_reaction(self, step: BeamStep, z: np.ndarray) -> np.ndarray:
        """Return force (x, y) in N and moment in N·m of the clamp, shape (3,)."""
        reaction: np.ndarray = step.clamp_force(z) - self._clamp_weight
        return reaction

    def failure(self, stop: Stop, iterations: int, detail: str, residual: float = np.inf) -> Solution:
        """Return the solution that says why there is none."""
        return Solution(
            stop=stop,
            iterations=iterations,
            residual=residual,
            displacement=np.full((len(self.energy.vertex_dofs) + 1, 3), np.nan),
            root_reaction=np.full(3, np.nan),
            strain_energy=np.nan,
            potential_energy=np.nan,
            dissipated=0.0 if self.body.kind == "elastic" else np.nan,
            detail=detail,
        )


@dataclass(frozen=True)
class _Solved:
    """An equilibrium: its load vector and its unknowns, both (dof,)."""

    load: np.ndarray
    state: np.ndarray


class BeamSolver:
    """Finite elements of one problem of an elastic beam, kept open between solves.

    Each solve starts from the last converged one, so neighbouring loads are cheap when asked in order.
    """

    def __init__(self, problem: BeamProblem) -> None:
        self._problem = problem
        self._beam = LoadedBeam(problem)
        self._model = self._beam.energy.step(None, None)
        self.reset()

    def reset(self) -> None:
        """Forget former answers: the next solve starts from the undeformed beam without weight."""
        rest = np.zeros(self._beam.energy.size)
        self._last = self._before = _Solved(rest, rest)

    def solve(self, x: Any, start: Solution | None = None) -> Solution:
        """Find the equilibrium under loads `x` (n,) in N, from a converged solution or by default the last one.

        `Solution.converged` is true where there is one; `Solution.message` says why not.
        """
        sizes = self._problem.sizes(x)
        if not np.isfinite(sizes).all():
            return self._beam.failure(Stop.BAD_INPUT, 0, "")
        if start is not None and start.converged:
            self._last = self._before = _Solved(self._model.force(start.state), start.state)
        load = self._beam.load(sizes)
        end = self._search(load)
        if end.stop is not Stop.CONVERGED:
            return self._beam.failure(end.stop, end.iterations, self._detail(end), end.residual)
        self._last, self._before = _Solved(load, end.z), self._last
        return self._answer(load, end)

    def march(self, loads: Any, times: Any = None) -> list[Solution]:
        """Solve for one row of loads (N, n) or (N,) after the other; their times (N,) in s are only noted."""
        rows = list(np.asarray(loads, dtype=float))
        clock = np.full(len(rows), np.nan) if times is None else np.asarray(times, dtype=float)
        if clock.shape != (len(rows),):
            raise UsageError(
                f"There are {clock.size} times for {len(rows)} loads.",
                why="Each row of loads has one.",
                fix="Leave the times out: an elastic beam does not need them.",
            )
        return [replace(self.solve(row), time=float(time)) for row, time in zip(rows, clock, strict=True)]

    def _search(self, load: np.ndarray) -> Equilibrium:
        """Search from the last answer; where that fails, once more from the undeformed beam."""
        last = self._last
        first = self._follow(LoadPath(last.load, load, last.state), self._predict(load))
        if first.stop is Stop.CONVERGED or not last.load.any():
            return first
        rest = np.zeros_like(load)
        again = self._follow(LoadPath(rest, load, rest), rest)
        return replace(again, iterations=first.iterations + again.iterations)

    def _follow(self, path: LoadPath, predictor: np.ndarray) -> Equilibrium:
        return follow(self._model, path, predictor, self._beam.admit, self._beam.is_near)

    def _predict(self, load: np.ndarray) -> np.ndarray:
        """Extrapolate the last two states along the loads (secant)."""
        taken, ahead = self._last.load - self._before.load, load - self._last.load
        length = float(taken @ taken)
        ratio = float(taken @ ahead) / length if length else 0.0
        guess: np.ndarray = self._last.state + np.clip(ratio, -2.0, 2.0) * (
            self._last.state - self._before.state
        )
        return guess

    def _answer(self, load: np.ndarray, end: Equilibrium) -> Solution:
        energy = self._model.energy(end.z)
        return Solution(
            stop=end.stop,
            iterations=end.iterations,
            residual=end.residual,
            displacement=self._beam.displacement(end.z),
            root_reaction=self._beam.root_reaction(self._model, end.z),
            strain_energy=energy,
            potential_energy=energy - float(load @ end.z),
            largest_strain=self._beam.fibre_strain(end.z),
            state=end.z,
        )

    def _detail(self, end: Equilibrium) -> str:
        """Return the figures that belong to the reason."""
        if end.stop is Stop.STRAIN_LIMIT:
            return f"{self._beam.fibre_strain(end.z):.2g} against {self._beam.body.strain_limit:g}"
        return f"{self._beam.bend(end.z):.2g} rad" if end.stop is Stop.COARSE_MESH else ""
