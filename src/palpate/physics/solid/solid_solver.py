"""Solving one body for many inputs, each from the nearest answer before."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import checks
from palpate.errors import SolverError, UsageError
from palpate.physics.solid.solid_model import open_problem
from palpate.physics.solid.solid_newton import ROUND_OFF
from palpate.physics.solid.solid_path import PathPoint, PathResult, follow, soften_and_follow
from palpate.physics.solid.solid_solution import SolidSolution
from palpate.physics.solid.solid_system import is_accurate, is_stable, sparse_solver
from palpate.physics.stop import Stop, Verdict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from palpate.physics.solid.solid_model import SolidModel
    from palpate.physics.solid.solid_problem import SolidProblem

__all__ = ["SolidSolver", "step_lengths"]

EQUILIBRIA = 64  # most equilibria that are kept for later solves to start from
EXAMPLE = "For example march(times=[0.1, 0.2], inputs=[[0.05, 0.05, 0.058], [0.05, 0.05, 0.056]])."

logger = logging.getLogger("palpate.physics.solid")


class SolidSolver:
    """Finite elements of one problem, kept open between solves.

    Each solve starts from the kept equilibrium that is nearest to its inputs, or from outside along the approach path
    of its interactions, whichever is nearer. A body with a history starts from its last equilibrium.

    `solver` is ``"auto"`` or NGSolve's name of a sparse solver, `tolerance` the relative error in the energy norm at
    which an iteration ends. A body without an equilibrium under its constant loads is a `SolverError`. Progress is
    logged: ``logging.basicConfig(level="INFO")`` shows each load step as it ends.
    """

    def __init__(self, problem: SolidProblem, *, solver: str = "auto", tolerance: float = 1e-9) -> None:
        self._problem = problem
        opened = open_problem(problem, sparse_solver(solver), tolerance)
        self._model = opened.model
        self._solutions = _SolutionBuilder(problem, opened.model)
        settled = opened.settled
        if settled is not None and settled.verdict.stop is not Stop.CONVERGED:
            raise SolverError(
                "The body has no equilibrium under its constant loads.",
                why=f"{settled.verdict.stop}. {settled.verdict.detail}".strip(),
                fix="Check gravity, density and pre-stress against the material's stiffness.",
            )
        self._settled = self._model.snapshot()
        self.reset()

    @property
    def model(self) -> SolidModel:
        """The equations that are solved."""
        return self._model

    def reset(self) -> None:
        """Forget former answers and history: the next solve starts from the body without interaction."""
        self._equilibria: list[PathPoint] = []
        self._measured = False
        self._model.forget()
        self._model.restore(self._settled)

    def solve(self, x: Any, *, dt: float | None = None, fields: bool = False) -> SolidSolution:
        """Find the equilibrium under inputs x (n,), one number per input in SI units.

        `dt` in s is only for materials with a history: the solve goes on from the last equilibrium by a step of that
        length. Without it, such a body is loaded from rest, in an instant, along the approach path, and what it
        remembers of other solves is left as it was. With `fields` there are stress and stretch at the nodes, as always
        for a problem with `stress`.

        `SolidSolution.converged` is true where there is an equilibrium; `SolidSolution.message` says why not. After a
        failed step the body's history is what it was before.
        """
        q = self._problem.inputs(x)
        outside = self._model.approach(q)
        if outside is None:
            return self._solutions.failure(q, PathResult(self._rest(q), Verdict(Stop.NO_APPROACH), ()))
        self._measure_energies()
        if dt is not None:
            checks.positive("The time step", dt, "s")
            self._require_history()
        if not self._model.histories:
            return self._conclude(q, self._search(q, outside), fields=fields)
        return self._instant(q, outside, fields) if dt is None else self._march(q, outside, dt, fields)

    def __str__(self) -> str:
        kept = f"{len(self._equilibria)} equilibria kept to start from"
        return f"Solver of {self._problem.words}: {self._model.field.size} unknowns, {kept}"

    __repr__ = __str__

    def _require_history(self) -> None:
        if not self._model.histories:
            raise UsageError(
                "A time step was given for a body without a history.",
                why="Its materials are elastic: the answer does not depend on time.",
                fix="Leave dt out, or give it a Viscoelastic or Plastic material.",
            )

    def march(self, times: Any, inputs: Any, *, fields: bool = False) -> list[SolidSolution]:
        """Solve for inputs (m, n) that follow each other in time, from where a body with a history is, at time 0.

        The times (m,) are the ends of the steps in s, ascending from above 0. With `fields` there are stress and
        stretch at the nodes. The solutions, one for each time, end with the first that failed.
        """
        inputs = np.atleast_2d(inputs)
        solutions: list[SolidSolution] = []
        for i, (step, row) in enumerate(zip(step_lengths(times, len(inputs)), inputs, strict=True)):
            logger.info("time %d of %d: a step of %.4g s", i + 1, len(inputs), step)
            solutions.append(self.solve(row, dt=step, fields=fields))
            if not solutions[-1].converged:
                break
        return solutions

    def _instant(self, q: np.ndarray, outside: np.ndarray, fields: bool) -> SolidSolution:
        """Load a body with a history from rest, and forget it again."""
        model, equilibria = self._model, self._equilibria
        history, scales = model.snapshot(), model.scales()
        self.reset()
        self._measure_energies()
        model.duration = 0.0
        solution = self._conclude(q, follow(model, self._rest(outside), q), fields=fields)
        model.restore(history)
        model.restore_scales(scales)
        self._equilibria = equilibria
        return solution

    def _march(self, q: np.ndarray, outside: np.ndarray, dt: float, fields: bool) -> SolidSolution:
        """Go on from the last equilibrium in time."""
        history = self._model.snapshot()
        self._model.duration = dt
        start = self._equilibria[-1] if self._equilibria else self._rest(outside)
        solution = self._conclude(q, follow(self._model, start, q), fields=fields)
        if not solution.converged:
            self._model.restore(history)
        return solution

    def _search(self, q: np.ndarray, outside: np.ndarray) -> PathResult:
        """Follow a path from the nearest known equilibrium; where that fails, once more from outside."""
        model = self._model
        start = self._rest(outside)
        reach = model.distance(outside, q)
        distances = [model.distance(point.q, q) for point in self._equilibria]
        if distances and min(distances) < reach:
            first = follow(model, self._equilibria[int(np.argmin(distances))], q)
            if first.verdict.stop is Stop.CONVERGED:
                return first
            again = soften_and_follow(model, start, q)
            return PathResult(again.last, again.verdict, first.log + again.log)
        return soften_and_follow(model, start, q)

    def _measure_energies(self) -> None:
        """Take the potential without interaction as the zero of U."""
        if not self._measured:
            self._model.measure_from_base()
            self._measured = True

    def _rest(self, q: np.ndarray) -> PathPoint:
        """Return the body under its constant loads alone, for inputs that leave it alone."""
        return PathPoint(q, self._model.impose(self._model.base, q))

    def _conclude(self, q: np.ndarray, path: PathResult, *, fields: bool) -> SolidSolution:
        """Return the solution, after a look at the tangent at the end of the path."""
        if path.verdict.stop is not Stop.CONVERGED:
            return self._solutions.failure(q, path)
        system, last = self._model.system, path.last
        self._model.set(q)
        system.factorise(last.z)
        residual = self._model.error(last.z)
        doubt = self._doubt(q, last, residual)
        if doubt.stop is not Stop.CONVERGED:
            return self._solutions.failure(q, PathResult(last.previous or last, doubt, path.log))
        fields = fields or self._problem.stress
        solution, slope = self._solutions.equilibrium(q, path, residual, fields=fields)
        earlier = (point.without_previous() for point in self._equilibria[-EQUILIBRIA + 1 :])
        self._equilibria = [*earlier, PathPoint(q, last.z, slope, last.previous)]
        return solution

    def _doubt(self, q: np.ndarray, last: PathPoint, residual: float) -> Verdict:
        """Return a verdict on the state that a path ended in, with the tangent just factorised there."""
        system = self._model.system
        if not is_accurate(system):
            return Verdict(Stop.SINGULAR)
        if not np.array_equal(last.q, q) or not residual < ROUND_OFF:
            return Verdict(Stop.ITERATION_LIMIT, f"the relative error is {residual:.2g}")
        return Verdict() if is_stable(system) else Verdict(Stop.UNSTABLE)


class _SolutionBuilder:
    """Solutions of one opened problem, from the ends of paths."""

    def __init__(self, problem: SolidProblem, model: SolidModel) -> None:
        self._problem, self._model, self._mesh = problem, model, problem.mesh

    def equilibrium(
        self, q: np.ndarray, path: PathResult, residual: float, *, fields: bool
    ) -> tuple[SolidSolution, np.ndarray]:
        """Return the solution at the end of a path, and the derivative ∂z/∂q (n, dof) there.

        The tangent must be the one at the end of the path; internal variables are taken over.
        """
        model, z = self._model, path.last.z
        response = model.response(z)
        hessian, slope = model.inputs.hessian(model.system, z)
        model.field.show(z)
        measured = model.measures.at_nodes() if fields else {}
        torque = model.inputs.torque(z, q)
        # only now: the step's own tangent and stress are those with the internal variables before it
        strain_energy, energy = model.conclude(z)
        solution = self._solution(
            q,
            stop=Stop.CONVERGED,
            iterations=path.iterations,
            chords=path.chords,
            residual=residual,
            log=path.log,
            response=response,
            response_gradient=-hessian,
            torque=torque,
            potential_energy=energy,
            strain_energy=strain_energy,
            **self._shown(PathPoint(q, z), path.verdict.figures),
            **measured,
        )
        return solution, slope

    def failure(self, q: np.ndarray, path: PathResult) -> SolidSolution:
        """Return why there is no equilibrium under inputs q (n,), and the last one on the way."""
        n, last = q.size, path.last
        return self._solution(
            q,
            stop=path.verdict.stop,
            iterations=path.iterations,
            chords=path.chords,
            residual=path.log[-1].residual if path.log else np.inf,
            log=path.log,
            displacement=np.full((len(self._mesh.points), 3), np.nan),
            response=np.full(n, np.nan),
            response_gradient=np.full((n, n), np.nan),
            detail=path.verdict.detail,
            reached=last.q if path.log else np.full(n, np.nan),
            state=last.z,
            last_good=self._last_good(last) if path.log else None,
        )

    def _last_good(self, last: PathPoint) -> SolidSolution:
        """Return the last equilibrium before a failure, to be looked at."""
        model, n = self._model, last.q.size
        model.set(last.q)
        figures = model.judge(last.z, last.q).figures
        return self._solution(
            last.q,
            stop=Stop.CONVERGED,
            iterations=0,
            residual=np.nan,
            log=(),
            # with a history it depends on internal variables that have been put back
            response=np.full(n, np.nan) if model.histories else model.response(last.z),
            response_gradient=np.full((n, n), np.nan),
            **self._shown(last, figures),
        )

    def _shown(self, at: PathPoint, figures: Mapping[str, float]) -> dict[str, Any]:
        """Return displacements and measures of the state that the field shows."""
        model = self._model
        return {
            "displacement": model.field.at_nodes(),
            "mid_sides": model.field.mid_sides(),
            "penetration": figures.get("penetration", 0.0),
            "least_volume_ratio": figures["least_volume_ratio"],
            "largest_strain": model.measures.largest_strain(),
            "reached": at.q,
            "state": at.z,
        }

    def _solution(self, q: np.ndarray, **parts: Any) -> SolidSolution:
        """Return a solution under inputs q (n,), with what a picture shows beside the body."""
        problem = self._problem
        probe, centre = problem.probe_at(q)
        tool, pose = problem.tool_at(q)
        return SolidSolution(
            mesh=self._mesh,
            ranges=problem.ranges,
            inputs=q,
            fixed=problem.body.fixed,
            probe=probe,
            centre=centre,
            tool=tool,
            pose=pose,
            **parts,
        )


def step_lengths(times: Any, rows: int) -> list[float]:
    """Return the lengths of the steps in s that end at these ascending times, one per row, the first from time 0."""
    try:
        given = np.atleast_1d(np.asarray(times, dtype=float))
    except (TypeError, ValueError):
        given = np.empty((0, 0))
    if given.ndim != 1:
        raise UsageError(f"The times are {times!r}.", why="They are a list of numbers in s.", fix=EXAMPLE)
    if len(given) != rows:
        raise UsageError(
            f"There are {len(given)} times and {rows} rows of inputs.",
            why="At each time the body has its own inputs: one row for each time.",
            fix=EXAMPLE,
        )
    steps = np.diff(given, prepend=0.0)
    wrong = np.flatnonzero(~((steps > 0) & np.isfinite(given)))
    if wrong.size:
        i = int(wrong[0])
        before = f"after the time {given[i - 1]:g} s" if i else "first"
        raise UsageError(
            f"The time {given[i]:g} s comes {before}.",
            why="Times are counted from 0, where the body rests, and each is later than the one before.",
            fix=f"Leave 0 out, and let the times ascend. {EXAMPLE}",
        )
    return [float(step) for step in steps]
