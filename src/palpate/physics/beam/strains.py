"""Strains of a plane beam at points, and what forces and stiffnesses of the section mean for its motion.

The measures are those of `reissner`: from u', v', t' and t at a point follow the axial strain, the shear strain and
the curvature. Section forces (N, Q, M) are conjugate to them; their first and second derivatives by the motion give
the generalised forces and stiffnesses that elements integrate (Simo 1985, Comput. Methods Appl. Mech. Eng. 49, 55-70).
"""

from __future__ import annotations

import numpy as np

__all__ = ["Strains"]


class Strains:
    """Strain measures at the points of one state, and their derivatives.

    Parameters
    ----------
    motion : (..., 4) array
        u', v', t' (1/m) and t (rad).
    large : bool
        Geometrically exact, or small displacements.

    Attributes
    ----------
    values : (..., 3) array
        Axial strain, shear strain and curvature in 1/m.
    """

    def __init__(self, motion: np.ndarray, *, large: bool) -> None:
        du, dv, dt, t = np.moveaxis(motion, -1, 0)
        self._large = large
        if not large:
            self.values = np.stack([du, dv - t, dt], axis=-1)
            self._first = _linear_rows(motion.shape[:-1])
            return
        self._sin, self._cos = np.sin(t), np.cos(t)
        # cos t - 1 = -2 sin²(t/2): the strains of tiny deflections keep all their digits
        axial = du * self._cos + dv * self._sin - 2 * np.sin(t / 2) ** 2
        shear = dv * self._cos - du * self._sin - self._sin
        self.values = np.stack([axial, shear, dt], axis=-1)
        self._first = self._rows()

    def forces(self, resultants: np.ndarray) -> np.ndarray:
        """Generalised forces (..., 4) of section forces N, Q in N and M in N·m, shape (..., 3)."""
        forces: np.ndarray = (resultants[..., None, :] @ self._first)[..., 0, :]
        return forces

    def stiffness(self, resultants: np.ndarray, tangent: np.ndarray) -> np.ndarray:
        """Second derivatives (..., 4, 4), of section forces (..., 3) and their tangent (..., 3, 3), or one for all."""
        total: np.ndarray = np.swapaxes(self._first, -1, -2) @ tangent @ self._first
        if self._large:
            self._add_geometric(total, resultants)
        return total

    def _rows(self) -> np.ndarray:
        """First derivatives of the three measures by u', v', t' and t, shape (..., 3, 4)."""
        axial, shear, _ = np.moveaxis(self.values, -1, 0)
        rows = np.zeros((*axial.shape, 3, 4))
        rows[..., 0, 0], rows[..., 0, 1], rows[..., 0, 3] = self._cos, self._sin, shear
        rows[..., 1, 0], rows[..., 1, 1], rows[..., 1, 3] = -self._sin, self._cos, -(1 + axial)
        rows[..., 2, 2] = 1.0
        return rows

    def _add_geometric(self, total: np.ndarray, resultants: np.ndarray) -> None:
        """Add what comes of the turning of the section forces."""
        axial, shear, _ = np.moveaxis(self.values, -1, 0)
        normal, transverse, _ = np.moveaxis(np.broadcast_to(resultants, self.values.shape), -1, 0)
        along = -normal * self._sin - transverse * self._cos
        across = normal * self._cos - transverse * self._sin
        for row, value in ((0, along), (1, across)):
            total[..., row, 3] += value
            total[..., 3, row] += value
        total[..., 3, 3] -= normal * (1 + axial) + transverse * shear


def _linear_rows(shape: tuple[int, ...]) -> np.ndarray:
    rows = np.array([[1.0, 0, 0, 0], [0, 1, 0, -1], [0, 0, 1, 0]])
    return np.broadcast_to(rows, (*shape, 3, 4))
