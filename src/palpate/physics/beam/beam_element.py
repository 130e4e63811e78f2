"""The beam element: strain measures, shape functions, and the band in which matrices fit.

The strain measures are those of `beam_energy`: from u', v', t' and t at a point follow the axial strain, the shear
strain and the curvature. Section forces (N, Q, M) are conjugate to them; their first and second derivatives by the
motion give the generalised forces and stiffnesses that elements integrate (Simo 1985, Comput. Methods Appl. Mech.
Eng. 49, 55-70).

The fields u, v and t are continuous polynomials on elements of different lengths, given by their values at the
Gauss-Lobatto points of each element. The unknowns are numbered along the beam, so that matrices are banded.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Legendre
from numpy.polynomial.legendre import leggauss

__all__ = ["LineElements", "Strains"]


class Strains:
    """Strain measures at the points of one state, and their derivatives.

    `motion` (..., 4) holds u', v', t' (1/m) and t (rad); the measures are geometrically exact if `large`, else those of
    small displacements. `values` (..., 3) are the axial strain, the shear strain and the curvature in 1/m.
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
        """Return the generalised forces (..., 4) of section forces N, Q in N and M in N·m, shape (..., 3)."""
        forces: np.ndarray = (resultants[..., None, :] @ self._first)[..., 0, :]
        return forces

    def stiffness(self, resultants: np.ndarray, tangent: np.ndarray) -> np.ndarray:
        """Return second derivatives (..., 4, 4) for section forces (..., 3) and their tangent (..., 3, 3) or (3, 3)."""
        total: np.ndarray = np.swapaxes(self._first, -1, -2) @ tangent @ self._first
        if self._large:
            self._add_geometric(total, resultants)
        return total

    def _rows(self) -> np.ndarray:
        """Return the first derivatives of the three measures by u', v', t' and t, shape (..., 3, 4)."""
        axial, shear, _ = np.moveaxis(self.values, -1, 0)
        rows = np.zeros((*axial.shape, 3, 4))
        rows[..., 0, 0], rows[..., 0, 1], rows[..., 0, 3] = self._cos, self._sin, shear
        rows[..., 1, 0], rows[..., 1, 1], rows[..., 1, 3] = -self._sin, self._cos, -(1 + axial)
        rows[..., 2, 2] = 1.0
        return rows

    def _add_geometric(self, total: np.ndarray, resultants: np.ndarray) -> None:
        """Add the stiffness that comes of the turning of the section forces."""
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


FIELDS = 3  # u, v, t


class LineElements:
    """Shape functions of one polynomial order on the elements between ascending vertices.

    The values at the first of `vertices` (node,), in m, are clamped and left out of the `size` free values. Of order p,
    p + 1 Gauss points an element integrate squares of the fields exactly; `weights` (element, point) are theirs in m.
    `vertex_values` (node - 1, 3) are the indices of the free values of the other vertices.
    """

    def __init__(self, vertices: np.ndarray, order: int) -> None:
        lengths = np.diff(vertices)
        nodes = _lobatto(order)
        points, weights = leggauss(order + 1)
        self._shape = _lagrange(nodes, points, 0)
        self._slope = _lagrange(nodes, points, 1)[None] * (2 / lengths)[:, None, None]
        along = np.linspace(-1, 1, 5)
        self._end_shape = _lagrange(nodes, along, 0)
        self._end_slope = _lagrange(nodes, along, 1)[None] * (2 / lengths)[:, None, None]
        self.weights = weights * lengths[:, None] / 2
        local = np.arange(order + 1) + order * np.arange(lengths.size)[:, None]
        # a value's place among the free ones; those of the clamp come out negative
        self._places = (FIELDS * (local[..., None] - 1) + np.arange(FIELDS)).reshape(lengths.size, -1)
        self.size = FIELDS * order * lengths.size
        self.vertex_values = self._places[:, -FIELDS:]
        self._band = FIELDS * (order + 1) - 1
        self._number_entries()
        self._gradients = self._gradient_rows()

    def at_points(self, z: np.ndarray) -> np.ndarray:
        """Return u', v', t' and t at the Gauss points, shape (element, point, 4), of free values z (size,)."""
        return self._motion(z, self._shape, self._slope)

    def end_to_end(self, z: np.ndarray) -> np.ndarray:
        """Return u', v', t' and t at five even points from end to end of each element, shape (element, 5, 4)."""
        return self._motion(z, self._end_shape, self._end_slope)

    def forces(self, density: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Integrate generalised forces, conjugate to u', v', t' and t, against the shape functions.

        The density (element, point, 4) is in N or N·m for the derivatives, in N for t. The nodal forces at the free
        values (size,) come back, and those at the clamp (3,).
        """
        weighted = (density * self.weights[..., None]).reshape(len(self.weights), 1, -1)
        nodal = (weighted @ self._gradients)[:, 0]
        summed = np.bincount(
            (self._places + FIELDS).ravel(), weights=nodal.ravel(), minlength=self.size + FIELDS
        )
        return summed[FIELDS:], summed[:FIELDS]

    def banded_matrix(self, density: np.ndarray) -> np.ndarray:
        """Return the stiffness in upper banded storage of second derivatives `density` (element, point, 4, 4)."""
        weighted = density * self.weights[..., None, None]
        rows = self._gradients.reshape(*density.shape[:-1], -1)
        acted = (weighted @ rows).reshape(self._gradients.shape)
        dense = self._gradients.transpose(0, 2, 1) @ acted
        flat = np.bincount(
            self._slots, weights=dense.ravel()[self._upper], minlength=(self._band + 1) * self.size
        )
        return flat.reshape(self._band + 1, self.size)

    def uniform(self, force: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Return nodal forces (size,) and those at the clamp (3,) of a constant force per length (x, y) in N/m."""
        shares = (self.weights @ self._shape)[..., None] * np.array([*force, 0.0])
        summed = np.bincount(
            (self._places + FIELDS).ravel(), weights=shares.ravel(), minlength=self.size + FIELDS
        )
        return summed[FIELDS:], summed[:FIELDS]

    def translations(self) -> np.ndarray:
        """Return a mask of the free values that are displacements rather than rotations, bool (size,)."""
        return np.arange(self.size) % FIELDS < 2

    def band_columns(self) -> tuple[np.ndarray, np.ndarray]:
        """Return row and column of each entry of a banded matrix, two int arrays of shape (band + 1, size)."""
        columns = np.broadcast_to(np.arange(self.size), (self._band + 1, self.size))
        return columns - np.arange(self._band, -1, -1)[:, None], columns

    def _motion(self, z: np.ndarray, shape: np.ndarray, slope: np.ndarray) -> np.ndarray:
        values = np.where(self._places >= 0, z[self._places], 0.0).reshape(len(self._places), -1, FIELDS)
        turn = values[..., 2] @ shape.T
        return np.concatenate([slope @ values, turn[..., None]], axis=-1)

    def _number_entries(self) -> None:
        """Find the place of each entry of the element matrices in the band."""
        rows, columns = np.broadcast_arrays(self._places[:, :, None], self._places[:, None, :])
        self._upper = np.flatnonzero((rows >= 0) & (columns >= rows))
        rows, columns = rows.ravel()[self._upper], columns.ravel()[self._upper]
        self._slots = (self._band + rows - columns) * self.size + columns

    def _gradient_rows(self) -> np.ndarray:
        """Return the derivatives of u', v', t' and t by the element's values, shape (element, 4 points, 3 nodes)."""
        elements, points = self.weights.shape
        rows = np.zeros((elements, points, 4, self._slope.shape[-1], FIELDS))
        for field in range(FIELDS):
            rows[:, :, field, :, field] = self._slope
        rows[:, :, 3, :, 2] = self._shape
        return rows.reshape(elements, 4 * points, -1)


def _lobatto(order: int) -> np.ndarray:
    """Return the Gauss-Lobatto points of -1 … 1, shape (order + 1,): the ends and where P_order is stationary."""
    inner = Legendre.basis(order).deriv().roots()
    return np.array([-1.0, *np.sort(np.real(inner)), 1.0])


def _lagrange(nodes: np.ndarray, points: np.ndarray, derivative: int) -> np.ndarray:
    """Return the Lagrange polynomials of the nodes, or their derivatives, at the points: shape (point, node)."""
    order = nodes.size - 1
    basis = [Legendre.basis(k) for k in range(order + 1)]
    coefficients = np.linalg.inv(np.stack([b(nodes) for b in basis], axis=-1))
    values: np.ndarray = np.stack(
        [b.deriv(derivative)(points) if derivative else b(points) for b in basis], -1
    )
    return values @ coefficients
