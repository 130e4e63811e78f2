"""Finite elements along a line: shape functions at Gauss points, and the band in which their matrices fit.

Continuous polynomials of three fields (u, v, t) on elements of different lengths, by their values at the
Gauss-Lobatto points of each element. The unknowns are numbered along the line, so that matrices are banded.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Legendre
from numpy.polynomial.legendre import leggauss

__all__ = ["LineElements"]

FIELDS = 3  # u, v, t


class LineElements:
    """Shape functions of one polynomial order on the elements between ascending vertices.

    Parameters
    ----------
    vertices : (node,) array
        Positions of the vertices in m, ascending; the values at the first one are clamped.
    order : int
        Polynomial order p; p + 1 Gauss points an element integrate squares of the fields exactly.

    Attributes
    ----------
    size : int
        Number of free values, those of the first vertex left out.
    weights : (element, point) array
        Weights of the Gauss points in m.
    vertex_values : (node - 1, 3) array of int
        Which free values are those of the vertices but the first.
    """

    def __init__(self, vertices: np.ndarray, order: int) -> None:
        lengths = np.diff(vertices)
        nodes = _lobatto(order)
        points, weights = leggauss(order + 1)
        self._shape = _lagrange(nodes, points, 0)
        self._slope = _lagrange(nodes, points, 1)[None] * (2 / lengths)[:, None, None]
        self.weights = weights * lengths[:, None] / 2
        self.points = vertices[:-1, None] + lengths[:, None] * (points + 1) / 2
        local = np.arange(order + 1) + order * np.arange(lengths.size)[:, None]
        # a value's place among the free ones; those of the clamp come out negative
        self._places = (FIELDS * (local[..., None] - 1) + np.arange(FIELDS)).reshape(lengths.size, -1)
        self.size = FIELDS * order * lengths.size
        self.vertex_values = self._places[:, -FIELDS:]
        self._band = FIELDS * (order + 1) - 1
        self._number_entries()
        self._gradients = self._gradient_rows()

    def at_points(self, z: np.ndarray) -> np.ndarray:
        """u', v', t' and t at the Gauss points, shape (element, point, 4), of free values z (size,)."""
        values = np.where(self._places >= 0, z[self._places], 0.0).reshape(len(self._places), -1, FIELDS)
        slopes = self._slope @ values
        turn = values[..., 2] @ self._shape.T
        return np.concatenate([slopes, turn[..., None]], axis=-1)

    def forces(self, density: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Integrate generalised forces, conjugate to u', v', t' and t, against the shape functions.

        Parameters
        ----------
        density : (element, point, 4) array
            N or N·m for the derivatives, N for t.

        Returns
        -------
        (size,) array and (3,) array
            Nodal forces at the free values, and those at the clamp.
        """
        weighted = (density * self.weights[..., None]).reshape(len(self.weights), 1, -1)
        nodal = (weighted @ self._gradients)[:, 0]
        summed = np.bincount(
            (self._places + FIELDS).ravel(), weights=nodal.ravel(), minlength=self.size + FIELDS
        )
        return summed[FIELDS:], summed[:FIELDS]

    def banded(self, density: np.ndarray) -> np.ndarray:
        """Stiffness in upper banded storage of second derivatives `density` (element, point, 4, 4)."""
        weighted = density * self.weights[..., None, None]
        rows = self._gradients.reshape(*density.shape[:-1], -1)
        acted = (weighted @ rows).reshape(self._gradients.shape)
        dense = self._gradients.transpose(0, 2, 1) @ acted
        flat = np.bincount(
            self._slots, weights=dense.ravel()[self._kept], minlength=(self._band + 1) * self.size
        )
        return flat.reshape(self._band + 1, self.size)

    def uniform(self, force: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Nodal forces (size,) and at the clamp (3,) of a constant force per length (x, y) in N/m."""
        shares = (self.weights @ self._shape)[..., None] * np.array([*force, 0.0])
        summed = np.bincount(
            (self._places + FIELDS).ravel(), weights=shares.ravel(), minlength=self.size + FIELDS
        )
        return summed[FIELDS:], summed[:FIELDS]

    def translations(self) -> np.ndarray:
        """Which free values are displacements rather than rotations, bool of shape (size,)."""
        return np.arange(self.size) % FIELDS < 2

    def band_columns(self) -> tuple[np.ndarray, np.ndarray]:
        """Row and column of each entry of a banded matrix, two int arrays of shape (band + 1, size)."""
        columns = np.broadcast_to(np.arange(self.size), (self._band + 1, self.size))
        return columns - np.arange(self._band, -1, -1)[:, None], columns

    def _number_entries(self) -> None:
        """Where each entry of the element matrices goes in the band."""
        rows, columns = np.broadcast_arrays(self._places[:, :, None], self._places[:, None, :])
        self._kept = np.flatnonzero((rows >= 0) & (columns >= rows))
        rows, columns = rows.ravel()[self._kept], columns.ravel()[self._kept]
        self._slots = (self._band + rows - columns) * self.size + columns

    def _gradient_rows(self) -> np.ndarray:
        """How u', v', t' and t depend on the element's values, shape (element, 4 points, 3 nodes)."""
        elements, points = self.weights.shape
        rows = np.zeros((elements, points, 4, self._slope.shape[-1], FIELDS))
        for field in range(FIELDS):
            rows[:, :, field, :, field] = self._slope
        rows[:, :, 3, :, 2] = self._shape
        return rows.reshape(elements, 4 * points, -1)


def _lobatto(order: int) -> np.ndarray:
    """Gauss-Lobatto points of -1 … 1, shape (order + 1,): the ends and where P_order is stationary."""
    inner = Legendre.basis(order).deriv().roots()
    return np.array([-1.0, *np.sort(np.real(inner)), 1.0])


def _lagrange(nodes: np.ndarray, points: np.ndarray, derivative: int) -> np.ndarray:
    """Lagrange polynomials of the nodes, or their derivatives, at the points: shape (point, node)."""
    order = nodes.size - 1
    basis = [Legendre.basis(k) for k in range(order + 1)]
    coefficients = np.linalg.inv(np.stack([b(nodes) for b in basis], axis=-1))
    values: np.ndarray = np.stack(
        [b.deriv(derivative)(points) if derivative else b(points) for b in basis], -1
    )
    return values @ coefficients
