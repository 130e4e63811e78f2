"""Solving a beam that remembers: single questions from the virgin beam, and whole histories of loads."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.beam.history_beam import HistoryBeam
from palpate.physics.beam.marching import Failure, Moment, march
from palpate.physics.beam.marching_beam import MarchingBeam
from palpate.physics.beam.problem import BeamProblem
from palpate.physics.beam.sections import law_of
from palpate.physics.beam.solution import Solution
from palpate.physics.beam.solver import STANDARD_GRAVITY
from palpate.physics.equilibrium.stop import Stop

__all__ = ["HistorySolver"]


class HistorySolver:
    """Finite elements of one problem of a beam that yields or creeps, kept open between solves.

    It remembers nothing between calls: each answer belongs to a history that is told in full, so it is the same
    whatever was asked before.

    Parameters
    ----------
    problem : BeamProblem
    """

    def __init__(self, problem: BeamProblem) -> None:
        body = problem.body
        self._problem = problem
        self._timed = body.kind == "viscous"
        self._beam = HistoryBeam(
            body.vertices(problem.loads), body.order, law_of(body), large=body.kinematics == "large"
        )
        self._marching = MarchingBeam(body, self._beam)
        self._directions = self._load_vectors()
        weight = STANDARD_GRAVITY * body.material.density * body.section.area if body.self_weight else 0.0
        self._weight, self._clamp_weight = self._beam.distributed((0.0, -weight))

    def reset(self) -> None:
        """Nothing to forget: it is here because every solver has it."""

    def solve(self, x: Any) -> Solution:
        """Run through the history that the inputs mean, from the virgin beam.

        Parameters
        ----------
        x : (n,) array or float
            The problem's inputs.

        Returns
        -------
        Solution
            At the end of the history.

        Raises
        ------
        UsageError
            If `x` has not one number per input.
        """
        values = self._problem.sizes(x)
        if not np.isfinite(values).all():
            return self._failed(self._bad_input())
        times, sizes = self._problem.program(values)
        solutions = self._run(times, sizes, self._virgin())
        return replace(solutions[-1], iterations=sum(one.iterations for one in solutions))

    def march(self, loads: Any, times: Any = None, *, start: Solution | None = None) -> list[Solution]:
        """Follow a history of loads.

        Parameters
        ----------
        loads : (N, n) or (N,) array
            Sizes of the n loads in N, in the order of the history; between two of them they change evenly.
        times : (N,) array, optional
            In s, not falling; two equal ones are loads put on at once. Viscoelastic beams need them; for the others
            they are only noted.
        start : Solution, optional
            What to go on from; by default the virgin beam, without loads at the time 0.

        Returns
        -------
        list of Solution
            One for each row; after a failure all others fail, too.

        Raises
        ------
        UsageError
            If the arrays do not fit, the times fall or are missing, or the start has no history.
        """
        begun = self._virgin() if start is None else self._begun(start)
        sizes = self._rows(loads)
        return self._run(self._clock(times, len(sizes), begun.time), sizes, begun)

    def _run(self, times: np.ndarray, sizes: np.ndarray, moment: Moment) -> list[Solution]:
        solutions: list[Solution] = []
        for time, row in zip(times, sizes, strict=True):
            reached = self._next(moment, float(time), row)
            if isinstance(reached, Failure):
                first, later = self._failed(reached), self._failed(reached, later=True)
                return [*solutions, first, *[later] * (len(sizes) - len(solutions) - 1)]
            solutions.append(self._answer(reached))
            moment = reached
        return solutions

    def _next(self, moment: Moment, time: float, sizes: np.ndarray) -> Moment | Failure:
        if not np.isfinite(sizes).all():
            return self._bad_input()
        return march(self._marching, moment, time, sizes @ self._directions + self._weight)

    def _virgin(self) -> Moment:
        """The beam as it was made, under its weight if it has one."""
        rest = np.zeros(self._beam.size)
        moment = Moment(0.0, rest, rest, self._beam.rest())
        if not self._weight.any():
            return moment
        reached = march(self._marching, moment, 0.0, self._weight)
        if isinstance(reached, Moment):
            return reached
        # a beam that its own weight breaks: whatever is asked of it starts from that weight and fails, too
        return moment

    def _begun(self, start: Solution) -> Moment:
        """What to march on from."""
        if isinstance(start.history, Moment) and start.history.z.size == self._beam.size:
            return start.history
        raise UsageError(
            "The solution to start from carries no history of this problem.",
            why=f"It is of another beam or one that remembers nothing, or it failed: {start.message}.",
            fix="Start from a converged solution of this problem, or leave `start` out for the virgin beam.",
        )

    def _load_vectors(self) -> np.ndarray:
        """Load vector of 1 N of each load, shape (n, dof)."""
        problem = self._problem
        vectors = np.zeros((len(problem.loads), self._beam.size))
        for row, load, node in zip(vectors, problem.loads, problem.nodes_of_loads, strict=True):
            # node 0 is clamped and has no unknowns
            row[self._beam.vertex_dofs[node - 1, :2]] = load.direction
        return vectors

    def _rows(self, loads: Any) -> np.ndarray:
        rows = np.asarray(loads, dtype=float)
        count = len(self._problem.loads)
        rows = rows[:, None] if rows.ndim == 1 and count == 1 else rows
        if rows.ndim != 2 or rows.shape[1] != count or not len(rows):
            raise UsageError(
                f"The history of loads has the shape {rows.shape}.",
                why=f"It must be (N, {count}): a row for each moment, a column for each load.",
                fix="Give for example [0.0, 5.0, 0.0] for one load, or [[0, 0], [5, 1]] for two.",
            )
        return rows

    def _clock(self, times: Any, count: int, begun: float) -> np.ndarray:
        if times is None and not self._timed:
            return begun + 1.0 + np.arange(count)
        if times is None:
            raise UsageError(
                "The history of loads has no times.",
                why="A viscoelastic beam answers to when a load comes and how long it stays.",
                fix="Pass times=[…] in s, one for each row of loads.",
            )
        clock = np.asarray(times, dtype=float)
        fits = clock.shape == (count,) and np.isfinite(clock).all()
        if not fits or (np.diff(clock, prepend=begun) < 0).any():
            raise UsageError(
                f"The times {times!r} do not fit the history.",
                why=f"It needs {count} finite times that do not fall and begin at {begun:g} s or later.",
                fix="Give one time in s for each row of loads, in ascending order.",
            )
        return clock

    def _answer(self, moment: Moment) -> Solution:
        stored = self._beam.stored(moment.z, moment.internal)
        forces = self._beam.step(moment.internal, None)  # after an instant: the forces of this very moment
        return Solution(
            stop=Stop.CONVERGED,
            iterations=moment.iterations,
            residual=moment.residual,
            displacement=np.vstack([np.zeros(3), moment.z[self._beam.vertex_dofs]]),
            root_reaction=forces.clamp_force(moment.z) - self._clamp_weight,
            strain_energy=stored,
            potential_energy=stored - float(moment.load @ moment.z),
            largest_strain=self._marching.fibre_strain(moment.z),
            state=moment.z,
            time=moment.time,
            dissipated=moment.dissipated,
            history=moment,
        )

    def _bad_input(self) -> Failure:
        rest = np.zeros(self._beam.size)
        return Failure(Stop.BAD_INPUT, Moment(0.0, rest, rest, None), rest, 0)

    def _failed(self, failure: Failure, *, later: bool = False) -> Solution:
        return Solution(
            stop=failure.stop,
            iterations=0 if later else failure.iterations,
            residual=np.inf,
            displacement=np.full((len(self._beam.vertex_dofs) + 1, 3), np.nan),
            root_reaction=np.full(3, np.nan),
            strain_energy=np.nan,
            potential_energy=np.nan,
            dissipated=np.nan,
            detail="an earlier load of the history failed" if later else self._marching.detail(failure),
        )
