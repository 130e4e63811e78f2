"""Equations of an opened body: energy, residual, factorised tangent, and derivatives in the inputs.

`System` is Π(z) = ∫ φ(z) - l·z and its derivatives. `is_accurate` and `is_stable` look at a factorised tangent.

`Inputs` gives the response of an interaction, -∂U/∂q, and its change with the inputs. For Π(z; q) with
z = z_free + z_base + Σ qᵢ Lᵢ on given unknowns, by the envelope theorem

    ∂U/∂qᵢ = ∂Π/∂qᵢ + Lᵢ · ∂Π/∂z,
    ∂²U/∂qᵢ∂qⱼ = Dᵢⱼ - Bᵢᵀ K⁻¹ Bⱼ,   Bᵢ = ∂²Π/∂z∂qᵢ + K Lᵢ,
    Dᵢⱼ = ∂²Π/∂qᵢ∂qⱼ + Lᵢ · ∂²Π/∂z∂qⱼ + Lⱼ · ∂²Π/∂z∂qᵢ + Lᵢ · K Lⱼ,

and the states follow the inputs with ∂z/∂qᵢ = Lᵢ - K⁻¹ Bᵢ. The derivatives of densities in their parameters are
taken symbolically. A rigid tool's energy Π_t is one of Rᵀ(X + u − p) alone, so with the unknowns eᵢ of a displacement
by 1 along its place pᵢ

    ∂Π_t/∂pᵢ = -eᵢ · ∂Π_t/∂z,    ∂²Π_t/∂z∂pᵢ = -K_t eᵢ,    ∂²Π_t/∂pᵢ∂qⱼ = -eᵢ · ∂²Π_t/∂z∂qⱼ,

and its torque, with it the derivatives by an angle, follow in the same way from the unknowns of a rigid turn. Second
derivatives by angles are central differences of those first ones at a fixed state.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.interaction import BEYOND, Attached, Energy
from palpate.physics.solid.solid_field import SolidField

__all__ = ["Inputs", "System", "is_accurate", "is_stable", "sparse_solver"]

STEPS = 6  # Lanczos steps: each costs a back-substitution
ACCURATE = 1e-6  # relative residual of a back-substitution
ANGLE_STEP = 1e-5  # rad, of the differences by angles: errors are its square, and rounding over it
SOLVERS = ("auto", "sparsecholesky", "pardiso", "umfpack")


class System:
    """Π(z) and its derivatives on the unknowns that are `free` (dof,); the others are given.

    The energies are terms of ∫ φ, `solver` is NGSolve's name of a sparse solver.
    """

    def __init__(self, field: SolidField, energies: Sequence[Energy], free: np.ndarray, solver: str) -> None:
        import ngsolve

        self.field, self.free, self._solver = field, free, solver
        self.load = np.zeros(field.size)
        self._form = ngsolve.BilinearForm(field.space, symmetric=True)
        for term in energies:
            self._form += ngsolve.Variation(term.density.Compile() * term.measure)
        self._state = field.state.vec.CreateVector()
        self._right, self._left = (field.state.vec.CreateVector() for _ in range(2))
        self._bits = ngsolve.BitArray(free.tolist())
        self._inverse: Any = None
        self.saddle = bool(field.pressure)
        self.factorisations = 0

    def potential(self, z: np.ndarray) -> float:
        """Return Π in J at unknowns z (dof,); NaN where the state is not admissible."""
        energy = float(self._form.Energy(self._at(z)))
        return energy - float(self.load @ z) if abs(energy) < BEYOND * 1e-100 else np.nan

    def gradient(self, z: np.ndarray) -> np.ndarray:
        """Return ∂Π/∂z (dof,) at all unknowns: on given ones the reactions."""
        self._form.Apply(self._at(z), self._left)
        return np.asarray(self._left.FV().NumPy() - self.load)

    def residual(self, z: np.ndarray) -> np.ndarray:
        """Return ∂Π/∂z (dof,), zero on given unknowns."""
        return np.asarray(self.gradient(z) * self.free)

    def factorise(self, z: np.ndarray) -> None:
        """Make ∂²Π/∂z² at z the tangent that `solve` and `multiply` use."""
        self._form.AssembleLinearization(self._at(z))
        if self._inverse is None:
            self._inverse = self._form.mat.Inverse(self._bits, inverse=self._solver)
        else:
            self._inverse.Update()  # the symbolic analysis stays
        self.factorisations += 1

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Return K⁻¹ rhs on the free unknowns, zero elsewhere, shape (dof,)."""
        self._right.FV().NumPy()[:] = rhs
        self._left.data = self._inverse * self._right
        return np.asarray(self._left.FV().NumPy() * self.free)

    def multiply(self, vector: np.ndarray) -> np.ndarray:
        """Return K times a vector (dof,)."""
        self._right.FV().NumPy()[:] = vector
        self._left.data = self._form.mat * self._right
        return np.array(self._left.FV().NumPy())

    def _at(self, z: np.ndarray) -> Any:
        self._state.FV().NumPy()[:] = z
        return self._state


def sparse_solver(name: str = "auto") -> str:
    """Return NGSolve's name of the sparse solver to use, one of `SOLVERS`.

    ``"auto"`` takes NGSolve's own Cholesky factorisation. MKL's PARDISO, where the package `mkl` is installed, is to be
    asked for: it was slower on one thread, and what is installed must not change an answer's last digits.
    """
    from ngsolve.la import BaseMatrix

    if name not in SOLVERS:
        raise UsageError(
            f"There is no sparse solver {name!r}.",
            why=f"Known are {', '.join(SOLVERS)}.",
            fix='Use solver="auto".',
        )
    # NGSolve makes PARDISO its default where it has found the package
    if name == "pardiso" and BaseMatrix.GetDefaultInverseType() != "pardiso":
        raise UsageError(
            "PARDISO is not to be had.",
            why="It belongs to MKL, and the Python package mkl is not installed.",
            fix='Install mkl, or use solver="auto", NGSolve\'s own Cholesky factorisation.',
        )
    return "sparsecholesky" if name == "auto" else name


def is_accurate(system: System) -> bool:
    """Return whether K K⁻¹ b = b for a vector b: elimination without pivoting can fail on a saddle point."""
    right = _start(system)
    error = (system.multiply(system.solve(right)) - right) * system.free
    return bool(np.linalg.norm(error) <= ACCURATE * np.linalg.norm(right))


def is_stable(system: System) -> bool:
    """Return whether the tangent is positive definite on the displacements, as far as a few Lanczos steps can see.

    For loads on the displacements alone, the displacement part of K⁻¹ is S⁻¹ with the Schur complement S that
    the pressures leave, so mixed and displacement form are one case. Lanczos' method (1950) on S⁻¹ finds its
    outermost eigenvalues first: a slightly negative one of S is a very negative one of S⁻¹.
    """
    vectors = [_start(system)]
    vectors[0] /= np.linalg.norm(vectors[0])
    diagonal, off = [], []
    moving = system.field.moving
    for _ in range(STEPS):
        image = system.solve(vectors[-1]) * moving
        diagonal.append(float(image @ vectors[-1]))
        for vector in vectors:  # orthogonalised against all: rounding would bring back what was found
            image = image - (image @ vector) * vector
        length = float(np.linalg.norm(image))
        if length <= 1e-12 * abs(diagonal[0]):
            break
        off.append(length)
        vectors.append(image / length)
    size = len(diagonal)
    band = np.diag(diagonal) + np.diag(off[: size - 1], 1) + np.diag(off[: size - 1], -1)
    return bool(np.linalg.eigvalsh(band)[0] > 0)


def _start(system: System) -> np.ndarray:
    """Return a vector, each time the same, with a share of every mode."""
    values = np.random.default_rng(0).standard_normal(system.field.size)
    return np.asarray(values * system.free * system.field.moving)


class Inputs:
    """The n inputs of all attached interactions, in their order, and derivatives of the potential in them."""

    def __init__(self, field: SolidField, attached: Sequence[Attached]) -> None:
        self._field = field
        self.attached = tuple(attached)
        self.parameters = [parameter for part in attached for parameter in part.parameters]
        self.size = len(self.parameters)
        counts = np.cumsum([0, *(len(part.parameters) for part in attached)])
        self.slices = [slice(a, b) for a, b in itertools.pairwise(counts)]
        self.loads = np.zeros((self.size, field.size))
        self.lifts = np.zeros((self.size, field.size))
        self.constrained = np.zeros(field.size, dtype=bool)
        self._first: list[list[Any]] = [[] for _ in range(self.size)]
        self._second: dict[tuple[int, int], list[Any]] = {}
        self._shifted: list[tuple[slice, Attached, np.ndarray, Any]] = []
        for part, rows in zip(attached, self.slices, strict=True):
            self._add(part, rows)

    def set(self, q: np.ndarray) -> None:
        """Let the densities see inputs q (n,)."""
        for parameter, value in zip(self.parameters, q, strict=True):
            parameter.Set(float(value))

    def gradient(self, z: np.ndarray, reactions: np.ndarray) -> np.ndarray:
        """Return ∂U/∂q (n,) at an equilibrium z (dof,) with ∂Π/∂z (dof,)."""
        state = self._at(z)
        explicit = np.array([float(sum(form.Energy(state) for form in forms)) for forms in self._first])
        for rows, part, shifts, form in self._shifted:
            explicit[rows] += self._tool_gradient(part, shifts, form, z)
        return np.asarray(explicit - self.loads @ z + self.lifts @ reactions)

    def torque(self, z: np.ndarray, q: np.ndarray) -> np.ndarray | None:
        """Return the torque (3,) in N m on the first rigid tool about its place; None where there is none.

        The state is z (dof,) under inputs q (n,), which are set.
        """
        first = next((part for _, part, _, _ in self._shifted if part.turns is not None), None)
        if first is None or first.turns is None:
            return None
        parts = [(rows, form) for rows, part, _, form in self._shifted if part is first]
        slopes = [self._slope(form, self._at(z)) for _, form in parts]
        return np.asarray(first.turns(z, q[parts[0][0]]) @ sum(slopes))

    def sensitivity(self, system: System, z: np.ndarray) -> np.ndarray:
        """Return ∂z/∂q (n, dof) with the system's present tangent."""
        coupling = self._coupling(z, self._tool_couplings(z)) + self._lift_forces(system)
        return np.asarray(self.lifts - self._solve_rows(system, coupling))

    def hessian(self, system: System, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ∂²U/∂q∂q (n, n) and ∂z/∂q (n, dof), with the system's present tangent, which is to be that at z."""
        raw, slope = self.raw_hessian(system, z)
        return (raw + raw.T) / 2, slope

    def raw_hessian(self, system: System, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ∂²U/∂q∂q as it is computed, symmetric but for roundings, and ∂z/∂q."""
        tools = self._tool_couplings(z)
        explicit, lifted = self._coupling(z, tools), self._lift_forces(system)
        coupling = explicit + lifted
        inner = self._solve_rows(system, coupling)
        mixed = self.lifts @ explicit.T
        own = self._input_hessian(z, tools) + mixed + mixed.T + self.lifts @ lifted.T
        return own - coupling @ inner.T, self.lifts - inner

    def _add(self, part: Attached, rows: slice) -> None:
        """Take over one interaction's loads, lifts and the derivatives of its densities."""
        if part.loads is not None:
            self.loads[rows] = part.loads
        if part.lifts is not None:
            self.lifts[rows] = part.lifts
        if part.constrained is not None:
            self.constrained |= part.constrained
        if part.shifts is not None:
            for energy, shifts in zip(part.energies, part.shifts, strict=True):
                form = self._form([(energy.density, energy.measure)])
                self._shifted.append((rows, part, shifts, form))
            return
        for term in part.energies:
            for i, first in enumerate(part.parameters):
                slope = term.density.Diff(first)
                self._first[rows.start + i].append(self._form([(slope, term.measure)]))
                for j, second in enumerate(part.parameters[: i + 1]):
                    key = (rows.start + i, rows.start + j)
                    self._second.setdefault(key, []).append(self._form([(slope.Diff(second), term.measure)]))

    def _form(self, terms: Sequence[tuple[Any, Any]]) -> Any:
        """Return the sum of densities, each with its measure."""
        import ngsolve

        form = ngsolve.BilinearForm(self._field.space, symmetric=True)
        for density, measure in terms:
            form += ngsolve.Variation(density.Compile() * measure)
        return form

    def _slope(self, form: Any, state: Any) -> np.ndarray:
        """Return the derivative (dof,) of a form by the unknowns."""
        result = self._field.state.vec.CreateVector()
        form.Apply(state, result)
        return np.array(result.FV().NumPy())

    def _tool_gradient(self, part: Attached, shifts: np.ndarray, form: Any, z: np.ndarray) -> np.ndarray:
        """Return ∂Π_t/∂q (3 + k,) of one energy of a rigid tool at its present inputs."""
        slope = self._slope(form, self._at(z))
        by_place = -shifts @ slope
        if part.rates is None or part.turns is None:
            return np.asarray(by_place)
        q = np.array([parameter.Get() for parameter in part.parameters])
        return np.append(by_place, -part.rates(q) @ (part.turns(z, q) @ slope))

    def _by_angles(self, part: Attached, of: Callable[[], np.ndarray]) -> np.ndarray:
        """Return the derivatives (k, …) by a tool's angles of what depends on its present inputs."""
        rows = []
        for parameter in part.parameters[3:]:
            middle, ends = parameter.Get(), []
            for step in (ANGLE_STEP, -ANGLE_STEP):
                parameter.Set(middle + step)
                ends.append(of())
            parameter.Set(middle)
            rows.append((ends[0] - ends[1]) / (2 * ANGLE_STEP))
        return np.array(rows)

    def _coupling(self, z: np.ndarray, tools: list[np.ndarray]) -> np.ndarray:
        """Return ∂²Π/∂z∂q without the lifts, shape (n, dof); `tools` are those of rigid tools' energies."""
        state, result = self._at(z), self._field.state.vec.CreateVector()
        coupling = -self.loads
        for row, forms in zip(coupling, self._first, strict=True):
            for form in forms:
                form.Apply(state, result)
                row += result.FV().NumPy()
        for (rows, *_), own in zip(self._shifted, tools, strict=True):
            coupling[rows] += own
        return coupling

    def _tool_couplings(self, z: np.ndarray) -> list[np.ndarray]:
        """Return ∂²Π_t/∂z∂q (3 + k, dof) of each energy of rigid tools."""
        state, result, couplings = self._at(z), self._field.state.vec.CreateVector(), []
        for _, part, shifts, form in self._shifted:
            form.AssembleLinearization(state)
            coupling = np.zeros((len(part.parameters), len(z)))
            for row, shift in zip(coupling, shifts, strict=False):
                other = self._at(shift)
                result.data = form.mat * other
                row -= result.FV().NumPy()
            if part.rates is not None:
                coupling[3:] += self._by_angles(part, partial(self._slope, form, state))
            couplings.append(coupling)
        return couplings

    def _input_hessian(self, z: np.ndarray, tools: list[np.ndarray]) -> np.ndarray:
        """Return ∂²Π/∂q∂q (n, n); `tools` are the couplings (3 + k, dof) of rigid tools' energies."""
        state, own = self._at(z), np.zeros((self.size, self.size))
        for (i, j), forms in self._second.items():
            own[i, j] = own[j, i] = sum(form.Energy(state) for form in forms)
        for (rows, part, shifts, form), coupling in zip(self._shifted, tools, strict=True):
            by_place = -coupling @ shifts.T
            by_angles = np.empty((0, len(by_place)))
            if part.rates is not None:
                by_angles = self._by_angles(part, partial(self._tool_gradient, part, shifts, form, z))
            own[rows, rows] += np.hstack([by_place, by_angles.T])
        return own

    def _lift_forces(self, system: System) -> np.ndarray:
        """Return K Lᵢ, shape (n, dof)."""
        return np.array([system.multiply(lift) if lift.any() else lift for lift in self.lifts])

    def _solve_rows(self, system: System, rows: np.ndarray) -> np.ndarray:
        return np.array([system.solve(row) for row in rows]).reshape(self.size, -1)

    def _at(self, z: np.ndarray) -> Any:
        state = self._field.state.vec.CreateVector()
        state.FV().NumPy()[:] = z
        return state
