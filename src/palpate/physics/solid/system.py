"""Equations of an opened body: energy, residual and factorised tangent of Π(z) = ∫ φ(z) - l·z."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.interaction import BEYOND, Energy
from palpate.physics.solid.field import SolidField

__all__ = ["System", "sparse_solver"]

SOLVERS = ("auto", "sparsecholesky", "pardiso", "umfpack")


class System:
    """Π(z) and its derivatives on the free unknowns.

    Parameters
    ----------
    field : SolidField
    energies : sequence of Energy
    free : (dof,) bool array
        Which unknowns are sought; the others are given.
    solver : str
        NGSolve's name of a sparse solver.
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
        """Π in J at unknowns z (dof,); NaN where the state is not admissible."""
        energy = float(self._form.Energy(self._at(z)))
        return energy - float(self.load @ z) if abs(energy) < BEYOND * 1e-100 else np.nan

    def gradient(self, z: np.ndarray) -> np.ndarray:
        """∂Π/∂z (dof,) at all unknowns: on given ones the reactions."""
        self._form.Apply(self._at(z), self._left)
        return np.asarray(self._left.FV().NumPy() - self.load)

    def residual(self, z: np.ndarray) -> np.ndarray:
        """∂Π/∂z (dof,), zero on given unknowns."""
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
        """K⁻¹ rhs on the free unknowns, zero elsewhere, shape (dof,)."""
        self._right.FV().NumPy()[:] = rhs
        self._left.data = self._inverse * self._right
        return np.asarray(self._left.FV().NumPy() * self.free)

    def multiply(self, vector: np.ndarray) -> np.ndarray:
        """K times a vector (dof,)."""
        self._right.FV().NumPy()[:] = vector
        self._left.data = self._form.mat * self._right
        return np.array(self._left.FV().NumPy())

    def _at(self, z: np.ndarray) -> Any:
        self._state.FV().NumPy()[:] = z
        return self._state


def sparse_solver(name: str = "auto") -> str:
    """NGSolve's name of the sparse solver to use.

    Parameters
    ----------
    name : {"auto", "sparsecholesky", "pardiso", "umfpack"}
        ``"auto"`` takes NGSolve's own Cholesky factorisation. MKL's PARDISO, where the package `mkl` is installed, is
        to be asked for: it was slower on one thread, and what is installed must not change an answer's last digits.

    Raises
    ------
    UsageError
        For another name, or PARDISO where it is not installed.
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
