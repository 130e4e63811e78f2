"""Networks in plain NumPy: what the compiled ones are measured against."""

from __future__ import annotations

import numpy as np

from palpate.network import Network

__all__ = ["PlainNetwork"]


class PlainNetwork:
    """A network of any inputs and outputs, everything that can be done beforehand done beforehand.

    f(x) = c + D x + W φ, with φ_k = g(‖A_k x − b_k‖²) and all scaling folded into A, b, c, D and W; or, through
    modes, f(x) = c + B (d + D x + W φ). Each form of factor is written the way that was fastest when measured:
    products with vectors wherever there are any, and no more temporaries than it takes.
    """

    def __init__(self, network: Network) -> None:
        s = network.scaling
        self.radial, self.diagonal = network.radial, network.form in {"axis-aligned", "isotropic"}
        factors = network.factors / s.input_half
        self.shape = factors.shape
        h, r, n = factors.shape
        shifts = network.shifts + factors @ s.input_centre
        if self.diagonal:
            self.A = np.ascontiguousarray(np.diagonal(factors, axis1=1, axis2=2))
        else:
            self.A = factors.reshape(h * r, n)
            shifts = shifts.ravel()
        self.b, self.ones = shifts, np.ones(r)
        scale = s.output_scale if network.basis is None else np.ones(len(network.weights))
        self.D = network.tail[:, 1:] / s.input_half * scale[:, None]
        self.c = network.tail[:, 0] * scale - self.D @ s.input_centre
        self.W = np.ascontiguousarray((network.weights * scale[:, None]).T)
        self.modes = None
        if network.basis is None:
            self.c = self.c + s.output_centre
        else:
            self.modes = np.ascontiguousarray((network.basis * s.output_scale[:, None]).T)
            self.offset = s.output_centre

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Outputs (m,) at x (n,)."""
        y = self._phi(self._distances(x)[1]) @ self.W
        y += self.c
        y += self.D @ x
        if self.modes is None:
            return y
        y = y @ self.modes
        y += self.offset
        return y

    def value_and_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Outputs (m,) and their derivatives (m, n) at x (n,): Gaussian units without modes."""
        h, r, n = self.shape
        v, q = self._distances(x)
        phi = np.exp(-q)
        along = v * self.A if self.diagonal else (v.reshape(h, r, 1) * self.A.reshape(h, r, n)).sum(axis=1)
        along *= phi[:, None]
        along *= -2.0
        return self.c + self.D @ x + phi @ self.W, self.D + self.W.T @ along

    def _distances(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A x − b, and its square summed over each unit (h,)."""
        v = self.A * x if self.diagonal else self.A @ x
        v -= self.b
        squares = v * v
        if self.shape[1] == 1:
            return v, squares.ravel()
        return v, squares.reshape(self.shape[:2]) @ self.ones

    def _phi(self, q: np.ndarray) -> np.ndarray:
        if self.radial == "gaussian":
            np.negative(q, out=q)
            return np.asarray(np.exp(q, out=q))
        if self.radial == "inverse-multiquadric":
            return np.asarray(1.0 / np.sqrt(1.0 + q))
        s = np.sqrt(5.0 * q)
        return np.asarray((1.0 + s + s * s / 3.0) * np.exp(-s))
