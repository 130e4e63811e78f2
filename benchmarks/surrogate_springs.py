"""Points and springs as a rival: moduli identified on training solves, the body's own mesh, every query a solve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.massspring import MassSpringBody
from benchmarks.surrogate_cases import Case, Training
from palpate.physics.solid import FamilyProblem
from palpate.validation import TouchSolves

__all__ = ["Springs", "counts", "identified", "some"]

SOLVES, ASKED = (
    10,
    40,
)  # that the moduli are identified on, there are one to three of them; test solves they are asked
LARGE = 2000  # nodes from which an equilibrium of springs takes tens of seconds
SOLVES_OF_LARGE, ASKED_OF_LARGE = 3, 10
ITERATIONS = 3  # of Gauss–Newton
MOVE = 0.05  # of ln E: difference for its derivative
LIGHT = 0.05  # of the largest force: smaller ones weigh no more than that


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs of a study.

    Attributes
    ----------
    case : Case
    factors : tuple of float
        On Young's modulus of each region, in the order of the body's regions.
    """

    case: Case
    factors: tuple[float, ...]

    def answers(self, X: np.ndarray, *, stiffness: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Forces (N, 3) and ∂F/∂c (N, 3, 3); not-a-number where there is no equilibrium or none was asked for."""
        F, K = np.full((len(X), 3), np.nan), np.full((len(X), 3, 3), np.nan)
        X, turns = self._turned(X)
        solver, values = None, None
        for i, x in enumerate(X):
            if solver is None or values != tuple(x[3:]):
                values = tuple(x[3:])
                solver = self._solver(values)
            if i == 0 or np.linalg.norm(x[:2] - X[i - 1, :2]) > 1e-3:
                solver.reset()  # another column
            found = solver.solve(x[:3], gradient=stiffness)
            if not found.converged:
                solver.reset()
                continue
            F[i] = turns[i] @ found.response
            if stiffness:
                K[i] = turns[i] @ found.response_gradient @ turns[i].T
        return F, K

    def _turned(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Inputs where the mesh is fine, and the rotations (N, 3, 3) that lead back; of a round body only."""
        turns = np.tile(np.eye(3), (len(X), 1, 1))
        if self.case.study.symmetry != "round":
            return X, turns
        out = X[:, :2] - self.case.about[:2]
        angle = np.arctan2(out[:, 1], out[:, 0])
        X = X.copy()
        X[:, 0], X[:, 1] = self.case.about[0] + np.hypot(*out.T), self.case.about[1]
        turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angle)
        turns[:, 1, 0] = np.sin(angle)
        turns[:, 0, 1] = -turns[:, 1, 0]
        return X, turns

    def _solver(self, values: tuple[float, ...]) -> Any:
        problem = self.case.study.problem()
        body = problem.member(values).body if isinstance(problem, FamilyProblem) else problem.body
        material = {
            region: replace(law, young=factor * law.young)
            for (region, law), factor in zip(body.material, self.factors, strict=True)
        }
        return MassSpringBody(problem.mesh, material, fixed=body.fixed).open(self.case.study.probe)


def counts(case: Case) -> tuple[int, int]:
    """Solves that moduli are identified on, and test solves that springs are asked for: each is an equilibrium."""
    large = len(case.study.problem().mesh.points) > LARGE
    return (SOLVES_OF_LARGE, ASKED_OF_LARGE) if large else (SOLVES, ASKED)


def identified(case: Case, training: Training, solves: int) -> Springs:
    """Springs whose moduli fit some of the training's forces best, by Gauss–Newton's method on ln E."""
    rows = np.unique(np.linspace(0, len(training) - 1, solves).astype(int))
    X, F = training.X[rows], training.force[rows]
    size = np.linalg.norm(F, axis=1)
    weight = 1 / np.maximum(size, LIGHT * size.max())

    def residual(logs: Sequence[float]) -> np.ndarray:
        found = Springs(case, tuple(np.exp(logs))).answers(X)[0]
        # what has no equilibrium counts as no force
        return np.asarray(((np.nan_to_num(found) - F) * weight[:, None]).ravel())

    body = case.study.body()
    logs = np.zeros(len(body.material))
    best, r = logs, residual(logs)
    for _ in range(ITERATIONS):
        J = np.array([residual(logs + MOVE * e) - r for e in np.eye(len(logs))]).T / MOVE
        step = np.linalg.lstsq(J, -r, rcond=1e-3)[0]
        trial = logs + np.clip(step, -1.0, 1.0)
        at = residual(trial)
        if at @ at >= r @ r:
            break
        best = logs = trial
        r = at
    return Springs(case, tuple(np.exp(best).tolist()))


def some(solves: TouchSolves, most: int) -> TouchSolves:
    """No more than so many of the solves, spread over them."""
    if len(solves) <= most:
        return solves
    return solves.take(np.linspace(0, len(solves) - 1, most).astype(int))
