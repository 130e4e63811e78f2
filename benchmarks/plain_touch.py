"""A sphere pressed into a block, as a plain NGSolve script would have it: the rival of `benchmarks.touching`.

python -m benchmarks.plain_touch        which size of its load steps is the largest that serves

Same mesh, law, contact energy and tolerance as palpate's; NGSolve's own Newton minimisation with its line search
and its Cholesky factorisation. What it does not have is what palpate adds: every sample starts from the
undeformed body and goes down in load steps of one size, without extrapolation, cut-backs or a neighbour's answer.
"""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["Balance", "PlainAnswer", "PlainTouch", "Setting", "hardest", "largest_step"]

REJECTED = 1e6  # J/m² or J/m³ where a state is not admissible: the line search turns back from it


@dataclass(frozen=True)
class Setting:
    """Constants of the study, in SI units."""

    young: float = 9e3
    poisson: float = 0.45
    radius: float = 0.010
    pad: float = 2e6
    stop: float = 0.004
    surface: str = "top"
    fixed: str = "bottom"
    quadrature: int = 6
    tolerance: float = 1e-9
    between: float = 1e-9  # tolerance of the load steps before the last


@dataclass(frozen=True)
class PlainAnswer:
    """What the script hands back for one sample."""

    converged: bool
    admissible: bool
    iterations: int
    force: np.ndarray
    energy: float


@dataclass(frozen=True)
class Balance:
    """The script's own residual and force (3,) in N at a given state.

    The residual is its norm on the free unknowns over that of the contact's part.
    """

    residual: float
    force: np.ndarray


class PlainTouch:
    """The script: forms and unknowns are built once, each sample starts from zero displacement.

    Parameters
    ----------
    mesh : ngsolve.Mesh
    setting : Setting
    step : float
        Size of a load step in m.
    """

    def __init__(self, mesh: Any, setting: Setting, step: float) -> None:
        from ngsolve import BilinearForm, GridFunction, Parameter, SetNumThreads, Variation, VectorH1, ds, dx
        from ngsolve.nonlinearsolvers import NewtonSolver

        SetNumThreads(1)
        self.setting, self.step = setting, step
        space = VectorH1(mesh, order=2, dirichlet=setting.fixed)
        u = space.TrialFunction()
        self.centre = [Parameter(0.0) for _ in range(3)]
        touched = ds(setting.surface, bonus_intorder=setting.quadrature)
        contact = Variation(self._contact(u).Compile() * touched)
        self.total, self.contact = BilinearForm(space, symmetric=True), BilinearForm(space, symmetric=True)
        self.total += Variation(self._strain_energy(u).Compile() * dx)
        self.total += contact
        self.contact += contact
        self.displacement = GridFunction(space)
        self.newton = NewtonSolver(self.total, self.displacement, inverse="sparsecholesky")
        self._free = np.fromiter(space.FreeDofs(), dtype=bool, count=space.ndof)
        self._translations = _translations(space)
        self._outside = self._trespass(mesh)

    def _strain_energy(self, u: Any) -> Any:
        from ngsolve import Det, Grad, Id, IfPos, Trace, log

        s = self.setting
        shear = s.young / 2 / (1 + s.poisson)
        lame = s.young * s.poisson / (1 + s.poisson) / (1 - 2 * s.poisson)
        F = Id(3) + Grad(u)
        J = Det(F)
        energy = shear / 2 * (Trace(F.trans * F) - 3) - shear * log(J) + lame / 2 * log(J) ** 2
        return IfPos(J, energy, REJECTED)

    def _penetration(self, u: Any) -> Any:
        from ngsolve import CF, InnerProduct, sqrt, x, y, z

        away = CF(tuple(p + u[i] - self.centre[i] for i, p in enumerate((x, y, z))))
        return self.setting.radius - sqrt(InnerProduct(away, away) + 1e-18)

    def _contact(self, u: Any) -> Any:
        from ngsolve import IfPos

        k, end, p = self.setting.pad, self.setting.stop, self._penetration(u)
        pressed = IfPos(p - 0.98 * end, REJECTED, k * p * p / 2 / (1 - p / end))
        return IfPos(p, pressed, 0)

    def _trespass(self, mesh: Any) -> Callable[[], float]:
        """Area integral that is positive where the pad is past its stop or an element inverted."""
        from ngsolve import Det, Grad, Id, IfPos, Integrate, ds, dx

        u, s = self.displacement, self.setting
        past = IfPos(self._penetration(u) - 0.98 * s.stop, 1, 0)
        inverted = IfPos(Det(Id(3) + Grad(u)), 0, 1)
        surface = ds(s.surface, bonus_intorder=s.quadrature)
        return lambda: Integrate(past * surface, mesh) + Integrate(inverted * dx, mesh)

    def solve(self, centre: np.ndarray, surface: float) -> PlainAnswer:
        """Press from first touch at height `surface` straight down to `centre`, both in m."""
        self.displacement.vec[:] = 0
        touch = surface + self.setting.radius
        steps = max(1, math.ceil((touch - centre[2]) / self.step - 1e-9))
        spent, converged = 0, True
        for height in np.linspace(touch, centre[2], steps + 1)[1:]:
            tolerance = self.setting.tolerance if height == centre[2] else self.setting.between
            converged, iterations = self._equilibrium((centre[0], centre[1], height), tolerance)
            spent += iterations
            if not converged:
                break
        return self._answer(converged, spent)

    def balance(self, state: np.ndarray, centre: np.ndarray) -> Balance:
        """Residual and force at displacement unknowns (dof,) of somebody else's with the sphere at (3,) m."""
        for parameter, value in zip(self.centre, centre, strict=True):
            parameter.Set(float(value))
        vector = self.displacement.vec.CreateVector()
        vector.FV().NumPy()[:] = state
        total, pressed = vector.CreateVector(), vector.CreateVector()
        self.total.Apply(vector, total)
        self.contact.Apply(vector, pressed)
        size = float(np.linalg.norm(pressed.FV().NumPy()))
        left = float(np.linalg.norm(total.FV().NumPy()[self._free]))
        return Balance(left / size if size else left, self._translations @ pressed.FV().NumPy())

    def _equilibrium(self, centre: tuple[float, float, float], tolerance: float) -> tuple[bool, int]:
        for parameter, value in zip(self.centre, centre, strict=True):
            parameter.Set(value)
        # NGSolve's criterion is the Newton decrement in √J; scaled by the energy it is relative, as palpate's
        energy = self.total.Energy(self.displacement.vec)
        largest = tolerance * math.sqrt(min(max(energy, 1e-9), 1.0))
        with contextlib.redirect_stdout(io.StringIO()):  # it prints where it does not converge
            failed, iterations = self.newton.Solve(maxit=30, maxerr=largest, linesearch=True)
        finite = math.isfinite(self.total.Energy(self.displacement.vec))
        return finite and failed == 0, iterations

    def _answer(self, converged: bool, iterations: int) -> PlainAnswer:
        state = self.displacement.vec
        residual = state.CreateVector()
        self.contact.Apply(state, residual)
        force = self._translations @ residual.FV().NumPy()
        energy = self.total.Energy(state)
        admissible = converged and bool(self._outside() == 0 and force[2] >= 0)
        return PlainAnswer(converged, admissible, iterations, force, energy)


def _translations(space: Any) -> np.ndarray:
    """Unknowns of a unit translation along each axis, shape (3, unknown): with the residual, the force."""
    from ngsolve import CF, GridFunction

    found = []
    moved = GridFunction(space)
    for i in range(3):
        moved.Set(CF(tuple(float(i == j) for j in range(3))))
        found.append(moved.vec.FV().NumPy().copy())
    return np.array(found)


def hardest(problem: Any, points: np.ndarray, count: int = 12) -> np.ndarray:
    """Rows of the hardest samples: of the deepest of each column those farthest off the middle."""
    deepest = np.array([chain[-1] for chain in problem.chains(points)])
    low, high = problem.mesh.corners
    off = np.linalg.norm((points[deepest] - (low + high) / 2)[:, :2], axis=1)
    return np.asarray(deepest[np.argsort(-off)[:count]])


def largest_step(
    problem: Any, points: np.ndarray, sizes: tuple[float, ...] = (2e-3, 1.5e-3, 1e-3, 7.5e-4, 6e-4, 5e-4)
) -> float:
    """Largest size in m of load steps with which all of the hardest samples end in admissible states.

    Takes a quarter of an hour; prints as it goes.
    """
    script = PlainTouch(problem.body.geometry.mesh(problem.refinements), Setting(between=1e-3), sizes[0])
    height, rows = float(problem.mesh.corners[1][2]), hardest(problem, points)
    for script.step in sizes:
        if all(_serves(script, row, points[row], height) for row in rows):
            return script.step
    raise RuntimeError(f"the script fails with all of {sizes}")


def _serves(script: PlainTouch, row: int, point: np.ndarray, height: float) -> bool:
    answer = script.solve(point, height)
    print(f"steps of {1e3 * script.step:g} mm, sample {row}: {answer}", flush=True)
    return answer.admissible


if __name__ == "__main__":
    from benchmarks.touching import SAMPLES, block, probe

    study = block().problem(probe())
    print(f"{1e3 * largest_step(study, study.design(SAMPLES, 0)):g} mm")
