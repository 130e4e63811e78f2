"""Solving one body for many inputs, each from the nearest answer before."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import SolverError, UsageError
from palpate.physics.arguments import require_positive
from palpate.physics.solid.answers import Answers
from palpate.physics.solid.newton import ROUND_OFF
from palpate.physics.solid.opening import open_problem
from palpate.physics.solid.path import Followed, Known, follow
from palpate.physics.solid.stability import is_accurate, is_stable
from palpate.physics.solid.system import sparse_solver
from palpate.physics.solid.times import durations
from palpate.physics.stop import Stop, Verdict

if TYPE_CHECKING:
    from palpate.physics.solid.model import SolidModel
    from palpate.physics.solid.problem import SolidProblem
    from palpate.physics.solid.solution import SolidSolution

__all__ = ["SolidSolver"]

KEPT = 64  # equilibria kept to start from
logger = logging.getLogger("palpate.physics.solid")


class SolidSolver:
    """Finite elements of one problem, kept open between solves.

    Progress is logged: ``logging.basicConfig(level="INFO")`` shows each load step as it ends.

    Each solve starts from the kept equilibrium that is nearest to its inputs, or from outside along the approach
    path of its interactions, whichever is nearer. A body with a history starts from its last equilibrium.

    Parameters
    ----------
    problem : SolidProblem
    solver : str
        ``"auto"``, or NGSolve's name of a sparse solver.
    tolerance : float
        Relative error in the energy norm at which an iteration ends.

    Raises
    ------
    SolverError
        If the body has no equilibrium under its constant loads.
    """

    def __init__(self, problem: SolidProblem, *, solver: str = "auto", tolerance: float = 1e-9) -> None:
        self._problem = problem
        opened = open_problem(problem, sparse_solver(solver), tolerance)
        self._model = opened.model
        self._answers = Answers(problem, opened.model)
        settled = opened.settled
        if settled is not None and settled.verdict.stop is not Stop.CONVERGED:
            raise SolverError(
                "The body has no equilibrium under its constant loads.",
                why=f"{settled.verdict.stop}. {settled.verdict.detail}".strip(),
                fix="Check gravity, density and pre-stress against the material's stiffness.",
            )
        self._settled = self._model.remembered()
        self.reset()

    @property
    def model(self) -> SolidModel:
        """The equations that are solved."""
        return self._model

    def reset(self) -> None:
        """Forget former answers and history: the next solve starts from the body without interaction."""
        self._known: list[Known] = []
        self._measured = False
        self._model.forget()
        self._model.recall(self._settled)

    def solve(self, x: Any, *, dt: float | None = None, fields: bool = False) -> SolidSolution:
        """Find the equilibrium under inputs x (n,).

        Parameters
        ----------
        x : (n,) array
        dt : float, optional
            Only for materials with a history: goes on from the last equilibrium by a step of this many seconds.
            Without it, such a body is loaded from rest, in an instant, along the approach path, and what it
            remembers of other solves is left as it was.
        fields : bool
            Whether to give stress and stretch at the nodes; a problem with `stress` always does.

        Returns
        -------
        SolidSolution
            `SolidSolution.converged` tells whether there is one, `SolidSolution.message` why not. After a failed
            step the body's history is what it was before.

        Raises
        ------
        UsageError
            If `x` has not one finite number per input, `dt` is not positive or the body has no history.
        """
        q = self._problem.inputs(x)
        outside = self._model.approach(q)
        if outside is None:
            return self._answers.failure(q, Followed(self._rest(q), Verdict(Stop.NO_APPROACH), ()))
        self._measure_energies()
        if dt is not None:
            require_positive("The time step", dt, "s")
            self._require_history()
        if not self._model.histories:
            return self._concluded(q, self._search(q, outside), fields=fields)
        return self._instant(q, outside, fields) if dt is None else self._march(q, outside, dt, fields)

    def __str__(self) -> str:
        kept = f"{len(self._known)} equilibria kept to start from"
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
        """Solve for inputs that follow each other in time, from where the body is.

        Parameters
        ----------
        times : (m,) array
            In s, ascending from above 0: the body is at time 0.
        inputs : (m, n) array
            At these times.
        fields : bool
            Whether to give stress and stretch at the nodes.

        Returns
        -------
        list of SolidSolution
            Up to the first one that failed.

        Raises
        ------
        UsageError
            If the times don't ascend from above 0, there is not one row of inputs for each, or the body has no
            history.
        """
        inputs = np.atleast_2d(inputs)
        solutions: list[SolidSolution] = []
        for i, (step, row) in enumerate(zip(durations(times, len(inputs)), inputs, strict=True)):
            logger.info("time %d of %d: a step of %.4g s", i + 1, len(inputs), step)
            solutions.append(self.solve(row, dt=step, fields=fields))
            if not solutions[-1].converged:
                break
        return solutions

    def _instant(self, q: np.ndarray, outside: np.ndarray, fields: bool) -> SolidSolution:
        """Load a body with a history from rest, and forget it again."""
        model, known = self._model, self._known
        remembered, standing = model.remembered(), model.standing()
        self.reset()
        self._measure_energies()
        model.duration = 0.0
        solution = self._concluded(q, follow(model, self._rest(outside), q), fields=fields)
        model.recall(remembered)
        model.stand(standing)
        self._known = known
        return solution

    def _march(self, q: np.ndarray, outside: np.ndarray, dt: float, fields: bool) -> SolidSolution:
        """Go on from the last equilibrium in time."""
        remembered = self._model.remembered()
        self._model.duration = dt
        start = self._known[-1] if self._known else self._rest(outside)
        solution = self._concluded(q, follow(self._model, start, q), fields=fields)
        if not solution.converged:
            self._model.recall(remembered)
        return solution

    def _search(self, q: np.ndarray, outside: np.ndarray) -> Followed:
        """From the nearest known equilibrium; where that fails, once more from outside."""
        model = self._model
        start = self._rest(outside)
        reach = model.distance(outside, q)
        distances = [model.distance(known.q, q) for known in self._known]
        if distances and min(distances) < reach:
            first = follow(model, self._known[int(np.argmin(distances))], q)
            if first.verdict.stop is Stop.CONVERGED:
                return first
            again = follow(model, start, q)
            return Followed(again.last, again.verdict, first.log + again.log)
        return follow(model, start, q)

    def _measure_energies(self) -> None:
        """Take the potential without interaction as the zero of U."""
        if not self._measured:
            self._model.measure_from_base()
            self._measured = True

    def _rest(self, q: np.ndarray) -> Known:
        """The body under its constant loads alone, for inputs that leave it alone."""
        return Known(q, self._model.impose(self._model.base, q))

    def _concluded(self, q: np.ndarray, followed: Followed, *, fields: bool) -> SolidSolution:
        """The solution, after a look at the tangent at the equilibrium found."""
        if followed.verdict.stop is not Stop.CONVERGED:
            return self._answers.failure(q, followed)
        system = self._model.system
        self._model.set(q)
        system.factorise(followed.last.z)
        residual = self._model.error(followed.last.z)
        doubt = self._doubt(q, followed.last, residual)
        if doubt.stop is not Stop.CONVERGED:
            last = followed.last.before or followed.last
            return self._answers.failure(q, Followed(last, doubt, followed.log))
        fields = fields or self._problem.stress
        found = self._answers.equilibrium(q, followed, residual, fields=fields)
        known = Known(q, followed.last.z, found.slope, followed.last.before)
        self._known = [*(k.alone() for k in self._known[-KEPT + 1 :]), known]
        return found.solution

    def _doubt(self, q: np.ndarray, last: Known, residual: float) -> Verdict:
        """What speaks against the state that a path ended in, with the tangent just factorised there."""
        system = self._model.system
        if not is_accurate(system):
            return Verdict(Stop.SINGULAR)
        if not np.array_equal(last.q, q) or not residual < ROUND_OFF:
            return Verdict(Stop.ITERATION_LIMIT, f"the relative error is {residual:.2g}")
        return Verdict() if is_stable(system) else Verdict(Stop.UNSTABLE)
