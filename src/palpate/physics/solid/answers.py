"""What a solve returns, from where its path ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.solid.path import Followed, Known
from palpate.physics.solid.solution import SolidSolution
from palpate.physics.stop import Stop

if TYPE_CHECKING:
    from palpate.physics.solid.model import SolidModel
    from palpate.physics.solid.problem import SolidProblem

__all__ = ["Answer", "Answers"]


@dataclass(frozen=True, eq=False)
class Answer:
    """A solution, and the derivative ∂z/∂q (n, dof) from which the next state is predicted."""

    solution: SolidSolution
    slope: np.ndarray


class Answers:
    """Solutions of one opened problem."""

    def __init__(self, problem: SolidProblem, model: SolidModel) -> None:
        self._problem, self._model, self._mesh = problem, model, problem.mesh

    def equilibrium(self, q: np.ndarray, followed: Followed, residual: float, *, fields: bool) -> Answer:
        """Response and stiffness from the tangent at the equilibrium, and what is measured there.

        The tangent must be the one at the end of the path; internal variables are taken over.
        """
        model, z = self._model, followed.last.z
        response = model.response(z)
        hessian, slope = model.inputs.hessian(model.system, z)
        model.field.show(z)
        measured: dict[str, Any] = model.measures.at_nodes() if fields else {}
        # only now: the step's own tangent and stress are those with the internal variables before it
        strain_energy, energy = model.conclude(z)
        figures = followed.verdict.figures
        solution = SolidSolution(
            stop=Stop.CONVERGED,
            iterations=followed.iterations,
            chords=followed.chords,
            residual=residual,
            log=followed.log,
            mesh=self._mesh,
            ranges=self._problem.ranges,
            inputs=q,
            displacement=model.field.at_nodes(),
            mid_sides=model.field.middles.show(),
            response=response,
            response_gradient=-hessian,
            potential_energy=energy,
            strain_energy=strain_energy,
            penetration=figures.get("penetration", 0.0),
            least_volume_ratio=figures["least_volume_ratio"],
            largest_strain=model.measures.largest_strain(),
            reached=q,
            state=z,
            **self._surroundings(q),
            **measured,
        )
        return Answer(solution, slope)

    def failure(self, q: np.ndarray, followed: Followed) -> SolidSolution:
        """Why there is no equilibrium under inputs q (n,), and the last one on the way."""
        n, last = q.size, followed.last
        return SolidSolution(
            stop=followed.verdict.stop,
            iterations=followed.iterations,
            chords=followed.chords,
            residual=followed.log[-1].residual if followed.log else np.inf,
            log=followed.log,
            mesh=self._mesh,
            ranges=self._problem.ranges,
            inputs=q,
            displacement=np.full((len(self._mesh.points), 3), np.nan),
            response=np.full(n, np.nan),
            response_gradient=np.full((n, n), np.nan),
            detail=followed.verdict.detail,
            reached=last.q if followed.log else np.full(n, np.nan),
            state=last.z,
            last_good=self._last_good(last) if followed.log else None,
            **self._surroundings(q),
        )

    def _last_good(self, last: Known) -> SolidSolution:
        """The last equilibrium before a failure, to be looked at."""
        model, n = self._model, last.q.size
        model.set(last.q)
        figures = model.judge(last.z, last.q).figures
        return SolidSolution(
            stop=Stop.CONVERGED,
            iterations=0,
            residual=np.nan,
            log=(),
            mesh=self._mesh,
            ranges=self._problem.ranges,
            inputs=last.q,
            displacement=model.field.at_nodes(),
            mid_sides=model.field.middles.show(),
            # with a history it depends on internal variables that have been put back
            response=np.full(n, np.nan) if model.histories else model.response(last.z),
            response_gradient=np.full((n, n), np.nan),
            penetration=figures.get("penetration", 0.0),
            least_volume_ratio=figures["least_volume_ratio"],
            largest_strain=model.measures.largest_strain(),
            reached=last.q,
            state=last.z,
            **self._surroundings(last.q),
        )

    def _surroundings(self, q: np.ndarray) -> dict[str, Any]:
        """What a picture shows beside the body."""
        probe, centre = self._problem.probe_at(q)
        return {"fixed": self._problem.body.fixed, "probe": probe, "centre": centre}
