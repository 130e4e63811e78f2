"""Solving a beam with memory: single questions from the virgin beam, and whole histories of loads."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.beam.beam_newton import lower_state, minimise
from palpate.physics.beam.beam_problem import BeamProblem, Solution
from palpate.physics.beam.beam_solver import LoadedBeam
from palpate.physics.beam.history_march import Failure, Moment, march
from palpate.physics.beam.section_laws import PlasticSection
from palpate.physics.stop import Stop

__all__ = ["HistorySolver"]

NEWTON_LIMIT = 40  # a step that needs more iterations is cheaper in two halves


class HistorySolver:
    """Finite elements of one problem of a beam that yields or creeps, kept open between solves.

    It remembers nothing between calls: each answer belongs to a history that is given in full, so it is the same
    whatever was asked before.
    """

    def __init__(self, problem: BeamProblem) -> None:
        self._problem = problem
        self._timed = problem.body.kind == "viscous"
        self._beam = LoadedBeam(problem)
        self._steps = _BeamSteps(self._beam)

    def reset(self) -> None:
        """Do nothing: there is nothing to forget. Every solver has this method."""

    def solve(self, x: Any) -> Solution:
        """Return the solution at the end of the history that the inputs `x` (n,) mean, from the virgin beam."""
        values = self._problem.sizes(x)
        if not np.isfinite(values).all():
            return self._beam.failure(Stop.BAD_INPUT, 0, "")
        times, sizes = self._problem.program(values)
        solutions = self._run(times, sizes, self._virgin())
        return replace(solutions[-1], iterations=sum(solution.iterations for solution in solutions))

    def march(self, loads: Any, times: Any = None, *, start: Solution | None = None) -> list[Solution]:
        """Follow a history of loads (N, n) or (N,) in N, and return a solution for each row.

        Between two rows the loads change evenly. The times (N,) in s do not fall; two equal ones are loads put on at
        once. Viscoelastic beams need them; for the others they are only noted. The history goes on from `start`, by
        default the virgin beam without loads at the time 0. After a failure all later rows fail, too.
        """
        begun = self._virgin() if start is None else self._moment_of(start)
        sizes = self._rows(loads)
        return self._run(self._clock(times, len(sizes), begun.time), sizes, begun)

    def _run(self, times: np.ndarray, sizes: np.ndarray, moment: Moment) -> list[Solution]:
        solutions: list[Solution] = []
        for time, row in zip(times, sizes, strict=True):
            reached = self._next(moment, float(time), row)
            if isinstance(reached, Failure):
                later = self._beam.failure(reached.stop, 0, "an earlier load of the history failed")
                detail = self._steps.detail(reached)
                failed = self._beam.failure(reached.stop, reached.iterations, detail)
                return [*solutions, failed, *[later] * (len(sizes) - len(solutions) - 1)]
            solutions.append(self._answer(reached))
            moment = reached
        return solutions

    def _next(self, moment: Moment, time: float, sizes: np.ndarray) -> Moment | Failure:
        if not np.isfinite(sizes).all():
            return Failure(Stop.BAD_INPUT, moment, moment.z, 0)
        return march(self._steps, moment, time, self._beam.load(sizes))

    def _virgin(self) -> Moment:
        """Return the beam as it was made, under its weight if it has one."""
        rest = np.zeros(self._beam.energy.size)
        moment = Moment(0.0, rest, rest, self._beam.energy.rest())
        if not self._beam.weight.any():
            return moment
        reached = march(self._steps, moment, 0.0, self._beam.weight)
        if isinstance(reached, Moment):
            return reached
        # a beam that its own weight breaks: whatever is asked of it starts from that weight and fails, too
        return moment

    def _moment_of(self, start: Solution) -> Moment:
        """Return the moment to march on from."""
        if isinstance(start.history, Moment) and start.history.z.size == self._beam.energy.size:
            return start.history
        raise UsageError(
            "The solution to start from carries no history of this problem.",
            why=f"It is of another beam or one that remembers nothing, or it failed: {start.message}.",
            fix="Start from a converged solution of this problem, or leave `start` out for the virgin beam.",
        )

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
        beam = self._beam
        stored = beam.energy.stored_energy(moment.z, moment.internal)
        at_once = beam.energy.step(moment.internal, None)  # after an instant: the forces of this very moment
        return Solution(
            stop=Stop.CONVERGED,
            iterations=moment.iterations,
            residual=moment.residual,
            displacement=beam.displacement(moment.z),
            root_reaction=beam.root_reaction(at_once, moment.z),
            strain_energy=stored,
            potential_energy=stored - float(moment.load @ moment.z),
            largest_strain=beam.fibre_strain(moment.z),
            state=moment.z,
            time=moment.time,
            dissipated=moment.dissipated,
            history=moment,
        )


class _BeamSteps:
    """The steps of one beam on its march (a `history_march.SteppedBody`)."""

    def __init__(self, beam: LoadedBeam) -> None:
        self._beam = beam
        # time steps are of second order: two halves err by a third of their difference from the whole (Richardson 1911)
        self._share = 1 / 3 if beam.body.kind == "viscous" else 1.0

    def take(self, start: Moment, time: float, load: np.ndarray, guess: np.ndarray) -> Moment | Failure:
        """Take one step to a time and load, from a guess of the unknowns."""
        step = self._beam.energy.step(start.internal, time - start.time if time > start.time else None)
        end = minimise(step, load, lower_state(step, load, start.z, guess), limit=NEWTON_LIMIT)
        stop = end.stop if end.stop is not Stop.CONVERGED else self._verdict(start.z, end.z)
        if self._is_mechanism(stop, step.energy(end.z)):
            stop = Stop.STEP_TOO_SMALL
        if stop is not Stop.CONVERGED:
            return Failure(stop, start, end.z, end.iterations)
        return Moment(
            time=time,
            load=load,
            z=end.z,
            internal=step.outcome(end.z),
            dissipated=start.dissipated + step.dissipated_energy(end.z),
            reach=max(start.reach, float(np.abs(end.z[self._beam.energy.is_translation]).max())),
            iterations=end.iterations,
            residual=end.residual,
        )

    def error(self, whole: Moment, halves: Moment) -> float:
        """Return the larger of the errors in displacement and dissipation, both relative, over the tolerance."""
        energy, body = self._beam.energy, self._beam.body
        offset = float(np.abs((whole.z - halves.z)[energy.is_translation]).max())
        reach = max(halves.reach, 1e-9 * body.length)
        lost = abs(whole.dissipated - halves.dissipated)
        total = energy.stored_energy(halves.z, halves.internal) + halves.dissipated
        relative = max(offset / reach, lost / max(total, energy.energy_floor))
        return float(self._share * relative / body.step_tolerance)

    def detail(self, failure: Failure) -> str:
        """Return the figures that belong to a failure's reason."""
        if failure.stop is Stop.BAD_INPUT:
            return ""
        figures = [f"{100 * failure.share:.3g} % of the way to this load was found"]
        energy, law = self._beam.energy, self._beam.energy.law
        if isinstance(law, PlasticSection):
            forces = energy.step(failure.moment.internal, None).resultants(failure.moment.z)
            share = float(np.abs(forces[..., 2]).max()) / law.plastic_moment
            figures.append(f"there the largest moment is {share:.3g} of the first plastic one")
        if failure.stop is Stop.STRAIN_LIMIT:
            strain = self._beam.fibre_strain(failure.z)
            figures.append(f"a strain of {strain:.2g} against {self._beam.body.strain_limit:g}")
        return "; ".join(figures)

    def _is_mechanism(self, stop: Stop, energy: float) -> bool:
        """Return whether a search failed for want of stiffness alone.

        A beam that has yielded through may have a tangent that is singular to the last digit; at small displacements
        nothing can buckle.
        """
        if stop is Stop.UNSTABLE:
            return self._beam.body.kinematics == "small"
        return stop is Stop.NOT_FINITE and bool(np.isfinite(energy))

    def _verdict(self, before: np.ndarray, after: np.ndarray) -> Stop:
        """Return `Stop.CONVERGED`, or why the model does not hold at a state or the step to it was too long."""
        verdict = self._beam.admit(after)
        if verdict is not Stop.CONVERGED:
            return verdict
        return Stop.CONVERGED if self._beam.is_near(before, after) else Stop.STEP_TOO_SMALL
