"""Solving one body for many inputs, each from the nearest answer before."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import SolverError
from palpate.physics.equilibrium.stop import Stop, Verdict
from palpate.physics.solid.opening import open_problem
from palpate.physics.solid.path import Followed, Known, follow
from palpate.physics.solid.solution import SolidSolution
from palpate.physics.solid.stability import is_accurate, is_stable
from palpate.physics.solid.system import sparse_solver

if TYPE_CHECKING:
    from palpate.physics.solid.problem import SolidProblem

__all__ = ["SolidSolver"]

KEPT = 64  # equilibria kept to start from


class SolidSolver:
    """Finite elements of one problem, kept open between solves.

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
        self._mesh = problem.mesh
        opened = open_problem(problem, sparse_solver(solver), tolerance)
        self._model, self._time_step = opened.model, opened.time_step
        settled = opened.settled
        if settled is not None and settled.verdict.stop is not Stop.CONVERGED:
            raise SolverError(
                "The body has no equilibrium under its constant loads.",
                why=f"{settled.verdict.stop}. {settled.verdict.detail}".strip(),
                fix="Check gravity, density and pre-stress against the material's stiffness.",
            )
        self._settled = {region: history.snapshot() for region, history in self._model.histories.items()}
        self.reset()

    def reset(self) -> None:
        """Forget former answers and history: the next solve starts from the body without interaction."""
        self._known: list[Known] = []
        self._measured = False
        for region, snapshot in self._settled.items():
            self._model.histories[region].restore(snapshot)

    def solve(self, x: Any, *, dt: float | None = None, fields: bool = False) -> SolidSolution:
        """Find the equilibrium under inputs x (n,).

        Parameters
        ----------
        x : (n,) array
        dt : float, optional
            Duration of the step in s; needed where the material has a history, which then goes on by it.
        fields : bool
            Whether to give stress and stretch at the nodes.

        Returns
        -------
        SolidSolution
            `SolidSolution.converged` tells whether there is one, `SolidSolution.message` why not.

        Raises
        ------
        UsageError
            If `x` has not one number per input, or a material with a history no `dt`.
        """
        q = self._problem.inputs(x)
        if not np.isfinite(q).all():
            return self._failure(q, Followed(self._rest(q), Verdict(Stop.BAD_INPUT), ()))
        outside = self._model.approach(q)
        if outside is None:
            return self._failure(q, Followed(self._rest(q), Verdict(Stop.NO_APPROACH), ()))
        self._measure_energies(outside)
        followed = self._search(q, outside)
        if followed.verdict.stop is not Stop.CONVERGED:
            return self._failure(q, followed)
        return self._answer(q, followed, fields=fields)

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

    def _measure_energies(self, outside: np.ndarray) -> None:
        """Take the potential without interaction as the zero of U."""
        if not self._measured:
            self._model.set(outside)
            self._model.measure_from_base()
            self._measured = True

    def _rest(self, q: np.ndarray) -> Known:
        """The body under its constant loads alone, for inputs that leave it alone."""
        return Known(q, self._model.impose(self._model.base, q))

    def _answer(self, q: np.ndarray, followed: Followed, *, fields: bool) -> SolidSolution:
        """Response and stiffness from the tangent at the equilibrium, and what is measured there."""
        model, z = self._model, followed.last.z
        model.set(q)
        model.system.factorise(z)
        if not is_accurate(model.system):
            return self._failure(q, Followed(followed.last, Verdict(Stop.SINGULAR), followed.log))
        if not is_stable(model.system):
            return self._failure(q, Followed(followed.last, Verdict(Stop.UNSTABLE), followed.log))
        reactions = model.system.gradient(z)
        hessian, slope = model.inputs.hessian(model.system, z)
        known = Known(q, z, slope, followed.last.before)
        self._known = [*(k.alone() for k in self._known[-KEPT + 1 :]), known]
        model.field.show(z)
        figures = followed.verdict.figures
        return SolidSolution(
            stop=Stop.CONVERGED,
            iterations=followed.iterations,
            residual=followed.log[-1].residual,
            log=followed.log,
            mesh=self._mesh,
            inputs=q,
            displacement=model.field.at_nodes(),
            response=-model.inputs.gradient(z, reactions),
            response_gradient=-hessian,
            potential_energy=model.system.potential(z) - model.scale.reference,
            strain_energy=model.strain_energy(z),
            penetration=figures.get("penetration", 0.0),
            least_volume_ratio=figures["least_volume_ratio"],
            largest_strain=model.measures.largest_strain(),
            von_mises=model.measures.von_mises() if fields else None,
            largest_stretch=model.measures.largest_stretch() if fields else None,
            reached=q,
            state=z,
        )

    def _failure(self, q: np.ndarray, followed: Followed) -> SolidSolution:
        n, last = q.size, followed.last
        return SolidSolution(
            stop=followed.verdict.stop,
            iterations=followed.iterations,
            residual=followed.log[-1].residual if followed.log else np.inf,
            log=followed.log,
            mesh=self._mesh,
            inputs=q,
            displacement=np.full((len(self._mesh.points), 3), np.nan),
            response=np.full(n, np.nan),
            response_gradient=np.full((n, n), np.nan),
            detail=followed.verdict.detail,
            reached=last.q,
            state=last.z,
        )
