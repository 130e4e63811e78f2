"""Lumps looked up in a press without a lump, and presses solved with one, all on one mesh and one compiled energy."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.interaction import Energy
from palpate.physics.materials.lumped import Lumped, LumpField
from palpate.physics.solid.solid_energy import deformation_gradient, volume_rule
from palpate.physics.solid.solid_solution import SolidSolution
from palpate.physics.solid.solid_solver import SolidSolver
from palpate.physics.stop import Stop
from palpate.surrogates.lumps.lump import EDGE, MIX, Lump, share_of_lump

if TYPE_CHECKING:
    from palpate.physics.solid.lump_problem import LumpProblem

__all__ = ["LumpSolution", "LumpSolver", "LumpedPress"]

NO_LUMP = (0.0, 0.0, 0.0, 1.0, 1.0)  # x, y, z, radius (m) and ratio
NEAR = 0.014  # m beyond the ball: half the lumps are looked up within that, where they are felt
TRIES = 16  # candidates for each lump that is looked up
STEPS = (
    2e-4,
    2e-4,
    2e-4,
    1e-4,
    1e-4,
)  # of place and radius over the radius, and of the ratio: they give slopes


@dataclass(frozen=True)
class LumpSolution(SolidSolution):
    """A press without a lump, and what it says of L lumps; a solve with the first one stands beside it, NaN without."""

    lump_place: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))  # (L, 3), m
    lump_radius: np.ndarray = field(default_factory=lambda: np.empty(0))  # (L,), m
    lump_energy: np.ndarray = field(default_factory=lambda: np.empty(0))  # (L,) D in J
    lump_slope: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))  # (L, 3) of D by the probe, N
    lump_compliance: np.ndarray = field(default_factory=lambda: np.empty(0))  # (K,) β of the first K lumps
    lump_ratio: float = np.nan  # of the first lump, in the solve with it
    lump_added: float = np.nan  # energy that it adds, J
    lump_force: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))  # (3,) force that it adds, N
    lump_message: str = ""  # why there is no solve with it, where one was wanted


@dataclass(frozen=True)
class LumpedPress:
    """A press solved with a lump."""

    stop: Stop  # why the iteration ended
    message: str  # the same in words
    added: float = np.nan  # energy beyond that of the same press without a lump, J
    force: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))  # (3,) force beyond it, N
    # (5,) ∂added/∂(x, y, z, radius, ratio) of the lump, in N, N, N, N and J
    slopes: np.ndarray = field(default_factory=lambda: np.full(5, np.nan))
    state: np.ndarray = field(default_factory=lambda: np.empty(0))  # (dof,) the unknowns


class LumpSolver:
    """The finite elements of a body with a lump whose numbers are parameters: nothing is compiled for another lump."""

    def __init__(self, problem: LumpProblem) -> None:
        import ngsolve

        self._problem = problem
        self._parameters = [ngsolve.Parameter(value) for value in NO_LUMP]
        body = problem.base.body
        self._materials = {name: Lumped(law, *self._parameters) for name, law in body.materials.items()}
        base = replace(problem.base, interactions=problem.base.acting)
        self._solver = SolidSolver(replace(base, body=replace(body, material=self._materials)))
        self._model = self._solver.model
        self._tissue = _Tissue(self._model, self._materials, LumpField(*self._parameters))
        self._room = problem.lump_room

    def reset(self) -> None:
        """Forget all earlier solves."""
        self._solver.reset()

    def press(self, x: Any) -> SolidSolution:
        """Solve the press x (3,) without a lump; what follows looks at its state."""
        self._set(NO_LUMP)
        return self._solver.solve(x)

    def solve(self, x: Any) -> LumpSolution:
        """Solve the press x (3,) without a lump, look lumps up in it, and perhaps solve it with the first."""
        solution = self.press(x)
        n = self._problem.lookups
        plain = {f.name: getattr(solution, f.name) for f in fields(solution)}
        if not solution.converged:
            return LumpSolution(**plain)
        rng = _generator(solution.inputs)
        wanted = rng.random() < self._problem.solved
        low, high = self._problem.ratio
        ratio = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        places, radii = self._choose(solution.inputs, n, rng)
        energies, slopes = self.energies(solution, places, radii)
        few = zip(places[: self._problem.compliances], radii, strict=False)
        compliances = np.array([self.compliance(solution, place, radius) for place, radius in few])
        own: dict[str, Any] = {}
        if wanted:
            with_lump = self.press_with(solution, Lump(tuple(places[0].tolist()), float(radii[0]), ratio))
            good = with_lump.stop is Stop.CONVERGED
            own = {"lump_message": "" if good else with_lump.message}
            if good:
                own |= {"lump_ratio": ratio, "lump_added": with_lump.added, "lump_force": with_lump.force}
        return LumpSolution(
            **plain,
            lump_place=places,
            lump_radius=radii,
            lump_energy=energies,
            lump_slope=slopes,
            lump_compliance=compliances,
            **own,
        )

    def energies(
        self, solution: SolidSolution, places: np.ndarray, radii: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return D (L,) in J and its slopes (L, 3) in N by the press, of lumps at places (L, 3) with radii (L,)."""
        self._refresh(solution)
        sensitivity = self._model.sensitivity(solution.state)
        assert sensitivity is not None  # the tangent is there
        return self._tissue.energies(solution.state, sensitivity, places, radii)

    def compliance(self, solution: SolidSolution, place: np.ndarray, radius: float) -> float:
        """Return β of one lump in the press that was solved last: −½ ∂²U/∂ratio² over D, at ratio 1."""
        self._refresh(solution)
        self._set((*place, radius, 1.0))
        D, edge, slope = self._tissue.moments(solution.state)
        slope = slope * self._model.system.free
        self._set(NO_LUMP)
        return float((0.5 * slope @ self._model.system.solve(slope) + edge) / D)

    def press_with(self, solution: SolidSolution, lump: Lump) -> LumpedPress:
        """Solve a press once more with a lump, from its state without.

        A state that folds under the tool, or any other that is refused, comes back as its reason in words.
        """
        model, q = self._model, solution.inputs
        self._room.require_cover(lump)
        system = model.system
        self._set(NO_LUMP)
        model.set(q)
        before, force = system.potential(solution.state), model.response(solution.state)
        numbers = (*lump.place, lump.radius, lump.ratio)
        self._set(numbers)
        end = model.search(q, solution.state, fresh=True)
        verdict = model.judge(end.z, q) if end.stop is Stop.CONVERGED else model.explain(end, q)
        if verdict.stop is Stop.CONVERGED:
            added, more = system.potential(end.z) - before, model.response(end.z) - force
            press = LumpedPress(verdict.stop, "", float(added), more, self._slopes(end.z, numbers), end.z)
        else:
            press = LumpedPress(verdict.stop, f"with a {lump}: {verdict.stop}. {verdict.detail}".strip())
        self._set(NO_LUMP)
        model.restore_scales(model.scales())  # which drops the tangent: it was that with the lump
        return press

    def _refresh(self, solution: SolidSolution) -> None:
        """Factorise the tangent of the press that was solved last again, where a press with a lump has replaced it."""
        if not self._model.has_tangent:
            self._model.fresh_sensitivity(solution.state, solution.inputs)

    def _set(self, numbers: Sequence[float]) -> None:
        for parameter, value in zip(self._parameters, numbers, strict=True):
            parameter.Set(float(value))

    def _slopes(self, z: np.ndarray, numbers: Sequence[float]) -> np.ndarray:
        """Return the slopes of the energy by the lump's numbers at a state: central differences of fourth order."""
        steps = np.array(STEPS) * np.array([*[numbers[3]] * 4, 1.0])
        slopes = np.empty(5)
        for i, step in enumerate(steps):
            values = []
            for many in (-2, -1, 1, 2):
                moved = np.array(numbers)
                moved[i] += many * step
                self._set(moved.tolist())
                values.append(self._model.system.potential(z))
            slopes[i] = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)
        return slopes

    def _choose(self, q: np.ndarray, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Return places (L, 3) and radii (L,) inside the body; every second one near the ball at q (3,)."""
        problem = self._problem
        lower, upper = map(np.array, problem.room)
        places = rng.uniform(lower, upper, (TRIES * count, 3))
        radii = rng.uniform(*problem.radius, len(places))
        fits = self._room.hold(places, radii)
        places, radii = places[fits], radii[fits]
        if len(places) < count:
            raise UsageError(
                "There is too little room for lumps in this body.",
                why=f"Of {TRIES * count} places in the box {problem.room} m, {len(places)} hold one with its edge.",
                fix="Give a box that lies inside the body, or smaller radii.",
            )
        reach = problem.base.interactions[0].radius + NEAR  # type: ignore[attr-defined]  # it is a sphere
        near = np.linalg.norm(places - q[:3], axis=1) <= reach
        order = np.argsort(~near, kind="stable")
        rest = np.setdiff1d(np.arange(len(places)), order[: (count + 1) // 2])[: count // 2]
        rows = np.empty(count, dtype=int)
        rows[::2], rows[1::2] = order[: (count + 1) // 2], rest
        return places[rows], radii[rows]


class _Tissue:
    """Strain energy of the tissue at the quadrature points, and forms of a lump in it."""

    def __init__(self, model: Any, materials: dict[str, Lumped], lump: LumpField) -> None:
        import ngsolve

        self._field, self._parts = model.field, []
        share, free = lump.share, np.zeros(model.field.size, dtype=bool)
        linear, edge = [], []
        for name, material in materials.items():
            rule = volume_rule(self._field, material)
            measure = ngsolve.dx(definedon=self._field.region(name), intrules={ngsolve.ET.TET: rule})
            trial = deformation_gradient(self._field.trial), self._field.pressure_trial.get(name)
            density = material.tissue_energy(*trial)
            linear.append(Energy(share * density, measure))
            edge.append(
                Energy(
                    MIX * share * (1 - share) * density + share**2 * material.pressure_energy(trial[1]),
                    measure,
                )
            )
            self._parts.append(_Points(self._field, name, material, rule))
        from palpate.physics.solid.solid_system import System

        self._linear, self._edge = (System(self._field, terms, free, "") for terms in (linear, edge))

    def moments(self, z: np.ndarray) -> tuple[float, float, np.ndarray]:
        """Return ∫ χ W dV and −½ ∂²Π/∂ratio² in J of the lump that is set, and the slope (dof,) of the first."""
        return self._linear.potential(z), self._edge.potential(z), self._linear.gradient(z)

    def energies(
        self, z: np.ndarray, sensitivity: np.ndarray, places: np.ndarray, radii: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return ∫ χ W dV (L,) and its slopes (L, n) by the inputs, by whose unit the state moves (n, dof)."""
        from scipy.spatial import cKDTree

        energy, slopes = np.zeros(len(places)), np.zeros((len(places), len(sensitivity)))
        for part in self._parts:
            work, rates = part.densities(self._field, z, sensitivity)
            tree = cKDTree(part.points)
            for i, rows in enumerate(tree.query_ball_point(places, EDGE * radii)):
                share = share_of_lump(np.linalg.norm(part.points[rows] - places[i], axis=1) / radii[i])
                energy[i] += share @ work[rows]
                slopes[i] += share @ rates[rows]
        return energy, slopes


class _Points:
    """The quadrature points of one region, and the energy of its tissue there."""

    def __init__(self, space: Any, name: str, material: Lumped, rule: Any) -> None:
        import ngsolve

        self._mapped = space.mesh.MapToAllElements(rule, space.region(name))
        self.points = np.asarray(ngsolve.CF((ngsolve.x, ngsolve.y, ngsolve.z))(self._mapped)).reshape(-1, 3)
        jacobian = ngsolve.Det(ngsolve.specialcf.JacobianMatrix(3))
        weights = np.tile(np.asarray(rule.weights), len(self.points) // len(rule))
        self._weights = np.abs(np.asarray(jacobian(self._mapped)).ravel()) * weights
        F, pressure = deformation_gradient(space.displacement).MakeVariable(), space.pressure.get(name)
        pressure = None if pressure is None else pressure.MakeVariable()
        density = material.tissue_energy(F, pressure)
        self._density, self._stress = density.Compile(), density.Diff(F).Compile()
        self._push = None if pressure is None else density.Diff(pressure).Compile()
        self._gradient, self._pressure = ngsolve.Grad(space.displacement), space.pressure.get(name)

    def densities(self, space: Any, z: np.ndarray, sensitivity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the energies W dV (Q,) in J and their rates (Q, n) by the inputs."""
        space.show(z)
        work = np.asarray(self._density(self._mapped)).ravel() * self._weights
        stress = np.asarray(self._stress(self._mapped)).reshape(-1, 9)
        push = None if self._push is None else np.asarray(self._push(self._mapped)).ravel()
        rates = np.empty((len(work), len(sensitivity)))
        for i, slope in enumerate(sensitivity):
            space.show(slope)
            rates[:, i] = (stress * np.asarray(self._gradient(self._mapped)).reshape(-1, 9)).sum(axis=1)
            if push is not None:
                rates[:, i] += push * np.asarray(self._pressure(self._mapped)).ravel()
        space.show(z)
        return work, rates * self._weights[:, None]


def _generator(q: np.ndarray) -> np.random.Generator:
    """Return a generator that depends on the press alone: a sweep gives the same rows in any order."""
    digest = hashlib.sha256(np.round(np.ascontiguousarray(q), 12).tobytes()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))
