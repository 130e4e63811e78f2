"""Energy, gradient and Hessian of the whole network with a probe in it, and linear solves with the Hessian."""

from __future__ import annotations

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from benchmarks.massspring.kernels import (
    diagonal_blocks,
    springs_apply,
    springs_gradient,
    volumes_apply,
    volumes_gradient,
)
from benchmarks.massspring.pad import PointPad
from benchmarks.massspring.springs import SpringNetwork

__all__ = ["Energy", "Tangent"]


class Energy:
    """Π(x; c): springs, volumes and pad.

    Parameters
    ----------
    network : SpringNetwork
    pad : PointPad
    free : (node,) bool array
        Points that move.
    """

    def __init__(self, network: SpringNetwork, pad: PointPad, free: np.ndarray) -> None:
        self.network, self.pad, self.free = network, pad, free

    def elastic(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Energy of springs and volumes in J and its gradient (node, 3) in N."""
        n, out = self.network, np.zeros_like(x)
        energy = springs_gradient(x, n.edges, n.lengths, n.stiffness, out)
        return energy + volumes_gradient(x, n.tetrahedra, n.volumes, n.bulk, out), out

    def value(self, x: np.ndarray, centre: np.ndarray) -> float:
        """Π in J; infinite past the pad's stop."""
        pressed = self.pad.energy(x, centre)
        return self.elastic(x)[0] + pressed if np.isfinite(pressed) else np.inf

    def gradient(self, x: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """∂Π/∂x in N, shape (node, 3), zero at fixed points."""
        _, out = self.elastic(x)
        out[self.pad.nodes] += self.pad.gradient(x, centre)
        out[~self.free] = 0.0
        return out

    def tangent(self, x: np.ndarray, centre: np.ndarray) -> Tangent:
        """∂²Π/∂x² as something to multiply with."""
        return Tangent(self, x, self.pad.blocks(x, centre))


class _NegativeCurvature(Exception):
    """The Hessian is not positive definite along a direction of the conjugate gradients."""


class Tangent:
    """The Hessian at a state, and a preconditioner made of its diagonal blocks.

    Parameters
    ----------
    energy : Energy
    x : (node, 3) array
    blocks : (m, 3, 3) array
        The pad's, N/m.
    mass : (node,) array, optional
        Added to the diagonal, N/m: masses over the square of a time step.
    """

    def __init__(
        self, energy: Energy, x: np.ndarray, blocks: np.ndarray, mass: np.ndarray | None = None
    ) -> None:
        self.energy, self.x, self.blocks, self.mass = energy, x, blocks, mass
        self._inverse = np.linalg.inv(self._diagonal())
        self.products = 0

    def apply(self, d: np.ndarray) -> np.ndarray:
        """Hessian times (node, 3), zero at fixed points."""
        self.products += 1
        n, pad, out = self.energy.network, self.energy.pad, np.zeros_like(d)
        springs_apply(self.x, d, n.edges, n.lengths, n.stiffness, out)
        volumes_apply(self.x, d, n.tetrahedra, n.volumes, n.bulk, out)
        out[pad.nodes] += np.einsum("mij,mj->mi", self.blocks, d[pad.nodes])
        if self.mass is not None:
            out += self.mass[:, None] * d
        out[~self.energy.free] = 0.0
        return out

    def precondition(self, r: np.ndarray) -> np.ndarray:
        """Inverse diagonal blocks times (node, 3)."""
        return np.asarray(np.einsum("nij,nj->ni", self._inverse, r))

    def solve(self, b: np.ndarray, tolerance: float, limit: int = 2000) -> tuple[np.ndarray, bool]:
        """Solve H d = b by conjugate gradients that stop where the curvature turns negative.

        Newton's method with this inner solver is Algorithm 7.1 of Nocedal & Wright (2006): along a direction of
        negative curvature the solution so far is kept, which still leads downhill.

        Parameters
        ----------
        b : (node, 3) array
            Right-hand side, N.
        tolerance : float
            Largest norm of the residual, relative to the norm of `b`.
        limit : int
            Largest number of products.

        Returns
        -------
        d : (node, 3) array
            Solution, m.
        solved : bool
            False where the curvature was negative or the limit was met.
        """
        iterates: list[np.ndarray] = []

        def product(p: np.ndarray) -> np.ndarray:
            image = self.apply(p.reshape(b.shape)).ravel()
            if float(p @ image) <= 0.0:
                raise _NegativeCurvature
            return image

        def preconditioned(r: np.ndarray) -> np.ndarray:
            return self.precondition(r.reshape(b.shape)).ravel()

        shape = (b.size, b.size)
        try:
            d, unsolved = cg(
                LinearOperator(shape, matvec=product, dtype=float),
                b.ravel(),
                rtol=tolerance,
                maxiter=limit,
                M=LinearOperator(shape, matvec=preconditioned, dtype=float),
                callback=lambda iterate: iterates.__setitem__(slice(None), [iterate]),
            )
        except _NegativeCurvature:
            return (iterates[0].reshape(b.shape) if iterates else self.precondition(b)), False
        return d.reshape(b.shape), not unsolved

    def _diagonal(self) -> np.ndarray:
        """Positive definite stand-ins of the diagonal blocks, shape (node, 3, 3).

        Springs without what compression takes from them, the pad without its turning part, and a share of the
        volumes: κ g gᵀ/V₀ with the gradient g of each tetrahedron's volume.
        """
        n, pad = self.energy.network, self.energy.pad
        blocks = np.zeros((len(self.x), 3, 3))
        diagonal_blocks(self.x, n.edges, n.stiffness, n.tetrahedra, n.volumes, n.bulk, blocks)
        normal = np.trace(self.blocks, axis1=1, axis2=2)
        blocks[pad.nodes] += np.maximum(normal, 0.0)[:, None, None] * np.eye(3) / 3
        if self.mass is not None:
            blocks += self.mass[:, None, None] * np.eye(3)
        blocks += 1e-9 * np.trace(blocks, axis1=1, axis2=2).max() * np.eye(3)
        return blocks
