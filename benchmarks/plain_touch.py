"""A sphere pressed into a block, as a plain NGSolve script would have it: the rival of `benchmarks.touching`.

python -m benchmarks.plain_touch        which size of its load steps is the fastest

Same mesh, law, contact energy and tolerance as palpate's; NGSolve's own Newton minimisation with its line search
and its Cholesky factorisation. What it does not have is what palpate adds: every sample starts from the
undeformed body and goes down in load steps of one size, without extrapolation or a neighbour's answer;
where that fails it begins anew with steps of half the size.
"""

from __future__ import annotations

import contextlib
import io
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["Balance", "PlainAnswer", "PlainTouch", "Setting"]

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
    """What the script hands back for one sample; `step` is the size in m that was tried last."""

    converged: bool
    admissible: bool
    iterations: int
    force: np.ndarray
    energy: float
    step: float


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
        # as many quadrature points as palpate takes: at fewer a corner of an element turns over unseen
        self.total += Variation(self._strain_energy(u).Compile() * dx(bonus_intorder=2))
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
        """Press from first touch at height `surface` straight down to `centre`, both in m.

        Where that fails, once more from the start in steps of half the size, and of a quarter.
        """
        spent = 0
        for size in (self.step, self.step / 2, self.step / 4):
            converged, iterations = self._descend(centre, surface, size)
            spent += iterations
            answer = self._answer(converged, spent, size)
            if answer.admissible:
                break
        return answer

    def _descend(self, centre: np.ndarray, surface: float, size: float) -> tuple[bool, int]:
        self.displacement.vec[:] = 0
        touch = surface + self.setting.radius
        steps = max(1, math.ceil((touch - centre[2]) / size - 1e-9))
        spent = 0
        for height in np.linspace(touch, centre[2], steps + 1)[1:]:
            tolerance = self.setting.tolerance if height == centre[2] else self.setting.between
            converged, iterations = self._equilibrium((centre[0], centre[1], height), tolerance)
            spent += iterations
            if not converged:
                return False, spent
        return True, spent

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

    def _answer(self, converged: bool, iterations: int, step: float) -> PlainAnswer:
        state = self.displacement.vec
        residual = state.CreateVector()
        self.contact.Apply(state, residual)
        force = self._translations @ residual.FV().NumPy()
        energy = self.total.Energy(state)
        admissible = converged and bool(self._outside() == 0 and force[2] >= 0)
        return PlainAnswer(converged, admissible, iterations, force, energy, step)


def _translations(space: Any) -> np.ndarray:
    """Unknowns of a unit translation along each axis, shape (3, unknown): with the residual, the force."""
    from ngsolve import CF, GridFunction

    found = []
    moved = GridFunction(space)
    for i in range(3):
        moved.Set(CF(tuple(float(i == j) for j in range(3))))
        found.append(moved.vec.FV().NumPy().copy())
    return np.array(found)


def _compared(
    script: PlainTouch, points: np.ndarray, sizes: tuple[float, ...] = (2e-3, 1.5e-3, 1e-3, 5e-4)
) -> None:
    """Print what the samples at `points` (n, 3) take with steps of each size."""
    for script.step in sizes:
        began = time.process_time()
        answers = [script.solve(point, HEIGHT) for point in points]
        seconds = (time.process_time() - began) / len(points)
        kept, good = (
            sum(found)
            for found in zip(*((a.step == script.step, a.admissible) for a in answers), strict=True)
        )
        print(
            f"{1e3 * script.step:g} mm: {seconds:.1f} s a sample, {np.mean([a.iterations for a in answers]):.0f} "
            f"iterations, {good} of {len(points)} admissible, {kept} of them without smaller steps",
            flush=True,
        )


if __name__ == "__main__":
    from benchmarks.touching import HEIGHT, SAMPLES, block, probe, stratified

    study = block().problem(probe())
    samples = study.design(SAMPLES, 0)
    mesh = study.body.geometry.mesh(study.refinements)
    _compared(PlainTouch(mesh, Setting(between=1e-3), 1e-3), samples[stratified(samples[:, 2])])
