"""Solving one beam for many loads, each from the last one's answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.beam.problem import BeamProblem
from palpate.physics.beam.reissner import ReissnerBeam
from palpate.physics.beam.sections import stiffness_of
from palpate.physics.beam.solution import Solution
from palpate.physics.equilibrium.newton import Equilibrium
from palpate.physics.equilibrium.path import LoadPath, follow
from palpate.physics.equilibrium.stop import Stop

__all__ = ["STANDARD_GRAVITY", "BeamSolver"]

STANDARD_GRAVITY = 9.80665  # m/s², 3rd General Conference on Weights and Measures 1901
COARSE = 1.0  # rad that one element may bend: cubics follow a quarter of a circle to about 1e-3
# In one load step, more bending of an element or more turning of a section hints at another equilibrium: a load
# across turns a beam at rest by at most a quarter of a circle, and more only where it loops.
FAR_BEND, FAR_TURN = 0.5, 2.0  # rad


@dataclass(frozen=True)
class _Known:
    """An equilibrium: its load vector and its unknowns, both (dof,)."""

    load: np.ndarray
    state: np.ndarray


class BeamSolver:
    """Finite elements of one problem, kept open between solves.

    Each solve starts from the last converged one, so neighbouring loads are cheap when asked in order.

    Parameters
    ----------
    problem : BeamProblem
    """

    def __init__(self, problem: BeamProblem) -> None:
        body = problem.body
        self._problem = problem
        material, section = body.material, body.section
        stiffness = stiffness_of(body)
        large = body.kinematics == "large"
        self._model = ReissnerBeam(body.vertices(problem.loads), body.order, stiffness, large=large)
        self._directions = self._load_vectors()
        weight = STANDARD_GRAVITY * material.density * section.area if body.self_weight else 0.0
        self._weight, self._clamp_weight = self._model.distributed((0.0, -weight))
        self.reset()

    def reset(self) -> None:
        """Forget former answers: the next solve starts from the undeformed beam without weight."""
        rest = np.zeros(self._model.size)
        self._last = self._before = _Known(rest, rest)

    def solve(self, x: Any, start: Solution | None = None) -> Solution:
        """Find the equilibrium under loads `x`.

        Parameters
        ----------
        x : (n,) array or float
            Sizes of the loads in N.
        start : Solution, optional
            A converged solution of this problem to start from; by default the solver's last one.

        Returns
        -------
        Solution
            `Solution.converged` tells whether there is one, `Solution.message` why not.

        Raises
        ------
        UsageError
            If `x` has not one number per load.
        """
        sizes = self._problem.sizes(x)
        if not np.isfinite(sizes).all():
            return self._failure(Equilibrium(self._last.state, Stop.BAD_INPUT, 0, np.inf))
        if start is not None and start.converged:
            self._last = self._before = _Known(self._model.force(start.state), start.state)
        load = sizes @ self._directions + self._weight
        found = self._search(load)
        if found.stop is not Stop.CONVERGED:
            return self._failure(found)
        self._last, self._before = _Known(load, found.z), self._last
        return self._answer(load, found)

    def march(self, loads: Any, times: Any = None) -> list[Solution]:
        """Solve for one row of loads (N, n) or (N,) after the other; their times (N,) in s are only noted.

        Raises
        ------
        UsageError
            If a row has not one number per load, or there are not as many times as rows.
        """
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
        """From the last answer; where that fails, once more from the undeformed beam."""
        last = self._last
        found = self._follow(LoadPath(last.load, load, last.state), self._predict(load))
        if found.stop is Stop.CONVERGED or not last.load.any():
            return found
        rest = np.zeros_like(load)
        again = self._follow(LoadPath(rest, load, rest), rest)
        return Equilibrium(again.z, again.stop, found.iterations + again.iterations, again.residual)

    def _follow(self, path: LoadPath, predictor: np.ndarray) -> Equilibrium:
        return follow(self._model, path, predictor, self._admit, self._near)

    def _predict(self, load: np.ndarray) -> np.ndarray:
        """Extrapolate the last two states along the loads (secant)."""
        taken, ahead = self._last.load - self._before.load, load - self._last.load
        length = float(taken @ taken)
        ratio = float(taken @ ahead) / length if length else 0.0
        guess: np.ndarray = self._last.state + np.clip(ratio, -2.0, 2.0) * (
            self._last.state - self._before.state
        )
        return guess

    def _admit(self, state: np.ndarray) -> Stop:
        """Whether the model has a say at this state."""
        if self._fibre_strain(state) > self._problem.body.strain_limit:
            return Stop.STRAIN_LIMIT
        if self._problem.body.kinematics == "large" and self._bend(state) > COARSE:
            return Stop.COARSE_MESH
        return Stop.CONVERGED

    def _near(self, before: np.ndarray, after: np.ndarray) -> bool:
        """Whether a load step from one state to the other stays on one branch of equilibria."""
        if self._problem.body.kinematics == "small":
            return True  # one equilibrium only
        turned = after - before
        far = self._bend(turned) > FAR_BEND or self._turn(turned) > FAR_TURN
        return not far

    def _fibre_strain(self, state: np.ndarray) -> float:
        axial, _, curvature = np.abs(self._model.strains(state)).T
        return float((axial + self._problem.body.section.half_height * curvature).max())

    def _bend(self, state: np.ndarray) -> float:
        """Largest angle in rad by which one element bends."""
        return float(np.abs(np.diff(state[self._model.vertex_dofs[:, 2]], prepend=0.0)).max())

    def _turn(self, state: np.ndarray) -> float:
        """Largest angle in rad by which a section turns."""
        return float(np.abs(state[self._model.vertex_dofs[:, 2]]).max())

    def _load_vectors(self) -> np.ndarray:
        """Load vector of 1 N of each load, shape (n, dof)."""
        vectors = np.zeros((len(self._problem.loads), self._model.size))
        for row, node, (x, y) in zip(
            vectors, self._problem.load_nodes, self._problem.load_directions, strict=True
        ):
            row[self._model.vertex_dofs[node - 1, :2]] = x, y  # node 0 is clamped and has no unknowns
        return vectors

    def _answer(self, load: np.ndarray, found: Equilibrium) -> Solution:
        energy = self._model.energy(found.z)
        return Solution(
            stop=found.stop,
            iterations=found.iterations,
            residual=found.residual,
            displacement=np.vstack([np.zeros(3), found.z[self._model.vertex_dofs]]),
            root_reaction=self._model.clamp_force(found.z) - self._clamp_weight,
            strain_energy=energy,
            potential_energy=energy - float(load @ found.z),
            largest_strain=self._fibre_strain(found.z),
            state=found.z,
        )

    def _failure(self, found: Equilibrium) -> Solution:
        return Solution(
            stop=found.stop,
            iterations=found.iterations,
            residual=found.residual,
            displacement=np.full((len(self._model.vertex_dofs) + 1, 3), np.nan),
            root_reaction=np.full(3, np.nan),
            strain_energy=np.nan,
            potential_energy=np.nan,
            detail=self._detail(found),
        )

    def _detail(self, found: Equilibrium) -> str:
        """Figures that belong to the reason."""
        if found.stop is Stop.STRAIN_LIMIT:
            return f"{self._fibre_strain(found.z):.2g} against {self._problem.body.strain_limit:g}"
        return f"{self._bend(found.z):.2g} rad" if found.stop is Stop.COARSE_MESH else ""
