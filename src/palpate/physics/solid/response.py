"""What an interaction feels: -∂U/∂q, and how that changes with the inputs, from the factorised tangent.

For Π(z; q) with z = z_free + z_base + Σ qᵢ Lᵢ on given unknowns, by the envelope theorem

    ∂U/∂qᵢ = ∂Π/∂qᵢ + Lᵢ · ∂Π/∂z,
    ∂²U/∂qᵢ∂qⱼ = Dᵢⱼ - Bᵢᵀ K⁻¹ Bⱼ,   Bᵢ = ∂²Π/∂z∂qᵢ + K Lᵢ,
    Dᵢⱼ = ∂²Π/∂qᵢ∂qⱼ + Lᵢ · ∂²Π/∂z∂qⱼ + Lⱼ · ∂²Π/∂z∂qᵢ + Lᵢ · K Lⱼ,

and the states follow the inputs with ∂z/∂qᵢ = Lᵢ - K⁻¹ Bᵢ. The derivatives of densities in their parameters are
taken symbolically.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.physics.interactions.interaction import Attached
from palpate.physics.solid.field import SolidField
from palpate.physics.solid.system import System

__all__ = ["Inputs"]


class Inputs:
    """The n inputs of all interactions of a problem, and derivatives of the potential in them.

    Parameters
    ----------
    field : SolidField
    attached : sequence of Attached
    """

    def __init__(self, field: SolidField, attached: Sequence[Attached]) -> None:
        self._field = field
        self.attached = tuple(attached)
        self.parameters = [parameter for part in attached for parameter in part.parameters]
        self.size = len(self.parameters)
        counts = np.cumsum([0, *(len(part.parameters) for part in attached)])
        self.slices = [slice(a, b) for a, b in itertools.pairwise(counts)]
        self.loads = np.zeros((self.size, field.size))
        self.lifts = np.zeros((self.size, field.size))
        self.held = np.zeros(field.size, dtype=bool)
        self._first: list[list[Any]] = [[] for _ in range(self.size)]
        self._second: dict[tuple[int, int], list[Any]] = {}
        for part, rows in zip(attached, self.slices, strict=True):
            self._add(part, rows)

    def set(self, q: np.ndarray) -> None:
        """Let the densities see inputs q (n,)."""
        for parameter, value in zip(self.parameters, q, strict=True):
            parameter.Set(float(value))

    def gradient(self, z: np.ndarray, reactions: np.ndarray) -> np.ndarray:
        """∂U/∂q (n,) at an equilibrium z (dof,) with ∂Π/∂z (dof,)."""
        state = self._at(z)
        explicit = [sum(form.Energy(state) for form in forms) for forms in self._first]
        return np.asarray(explicit - self.loads @ z + self.lifts @ reactions)

    def sensitivity(self, system: System, z: np.ndarray) -> np.ndarray:
        """∂z/∂q (n, dof) with the system's present tangent."""
        coupling = self._coupling(z) + self._lifted(system)
        return np.asarray(self.lifts - self._solved(system, coupling))

    def hessian(self, system: System, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """∂²U/∂q∂q (n, n) and ∂z/∂q (n, dof), with the system's present tangent, which is to be that at z."""
        raw, slope = self.raw_hessian(system, z)
        return (raw + raw.T) / 2, slope

    def raw_hessian(self, system: System, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same as it is computed, symmetric but for roundings where tangent and couplings are right."""
        explicit, lifted = self._coupling(z), self._lifted(system)
        coupling = explicit + lifted
        inner = self._solved(system, coupling)
        mixed = self.lifts @ explicit.T
        own = self._own(z) + mixed + mixed.T + self.lifts @ lifted.T
        return own - coupling @ inner.T, self.lifts - inner

    def _add(self, part: Attached, rows: slice) -> None:
        """Take over one interaction's loads, lifts and the derivatives of its densities."""
        if part.loads is not None:
            self.loads[rows] = part.loads
        if part.lifts is not None:
            self.lifts[rows] = part.lifts
        if part.held is not None:
            self.held |= part.held
        for term in part.energies:
            for i, first in enumerate(part.parameters):
                slope = term.density.Diff(first)
                self._first[rows.start + i].append(self._form(slope, term.measure))
                for j, second in enumerate(part.parameters[: i + 1]):
                    key = (rows.start + i, rows.start + j)
                    self._second.setdefault(key, []).append(self._form(slope.Diff(second), term.measure))

    def _form(self, density: Any, measure: Any) -> Any:
        import ngsolve

        form = ngsolve.BilinearForm(self._field.space, symmetric=True)
        form += ngsolve.Variation(density.Compile() * measure)
        return form

    def _coupling(self, z: np.ndarray) -> np.ndarray:
        """∂²Π/∂z∂q without the lifts, shape (n, dof)."""
        state, result = self._at(z), self._field.state.vec.CreateVector()
        coupling = -self.loads
        for row, forms in zip(coupling, self._first, strict=True):
            for form in forms:
                form.Apply(state, result)
                row += result.FV().NumPy()
        return coupling

    def _own(self, z: np.ndarray) -> np.ndarray:
        """∂²Π/∂q∂q, shape (n, n)."""
        state, own = self._at(z), np.zeros((self.size, self.size))
        for (i, j), forms in self._second.items():
            own[i, j] = own[j, i] = sum(form.Energy(state) for form in forms)
        return own

    def _lifted(self, system: System) -> np.ndarray:
        """K Lᵢ, shape (n, dof)."""
        return np.array([system.multiply(lift) if lift.any() else lift for lift in self.lifts])

    def _solved(self, system: System, rows: np.ndarray) -> np.ndarray:
        return np.array([system.solve(row) for row in rows]).reshape(self.size, -1)

    def _at(self, z: np.ndarray) -> Any:
        state = self._field.state.vec.CreateVector()
        state.FV().NumPy()[:] = z
        return state
