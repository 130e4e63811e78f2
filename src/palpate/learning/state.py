"""The filter's state as a value: parameters, their covariance, and what the growth and pruning rules remember."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.settings import Settings

__all__ = ["State", "initial"]


@dataclass(frozen=True, eq=False)
class State:
    """A network being learnt, in scaled inputs (n) and outputs (m).

    Attributes
    ----------
    tail : (m, p)
        T; p is 1 + n, 1 or 0 by the kind of tail.
    units : (h, m + 2n)
        One row per unit: weights w (m), centre μ (n), and log σ or σ (n).
    covariance : (d, d)
        P over z = [tail row by row, units row by row], d = m p + h (m + 2n).
    errors : (≤ M,)
        The last squared error norms ‖e‖², newest last.
    seen : (≤ M, n + m)
        The last observations [x, y], newest last.
    silent : (h,) int
        Observations in a row in which each unit was silent.
    count : int
        t, observations seen over all passes.
    innovation : float
        Running mean square of the innovation, per output.
    inputs : int
        n.
    """

    tail: np.ndarray
    units: np.ndarray
    covariance: np.ndarray
    errors: np.ndarray
    seen: np.ndarray
    silent: np.ndarray
    count: int
    innovation: float
    inputs: int

    @property
    def outputs(self) -> int:
        """Number of outputs m."""
        return int(self.tail.shape[0])

    @property
    def weights(self) -> np.ndarray:
        """w (h, m)."""
        return self.units[:, : self.outputs]

    @property
    def centres(self) -> np.ndarray:
        """μ (h, n)."""
        return self.units[:, self.outputs : self.outputs + self.inputs]

    @property
    def shape(self) -> np.ndarray:
        """log σ or σ (h, n), as the settings have it."""
        return self.units[:, self.outputs + self.inputs :]

    def widths(self, settings: Settings) -> np.ndarray:
        """σ (h, n)."""
        return np.asarray(np.exp(self.shape)) if settings.widths == "log" else self.shape

    def vector(self) -> np.ndarray:
        """z (d,)."""
        return np.concatenate([self.tail.ravel(), self.units.ravel()])

    def moved(self, z: np.ndarray) -> State:
        """The state with its parameters replaced by a vector z (d,)."""
        tail, units = self.split(z)
        return replace(self, tail=tail, units=units)

    def split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The tail (m, p) and units (h, m + 2n) that a vector z (d,) holds."""
        a = self.tail.size
        return z[:a].reshape(self.tail.shape), z[a:].reshape(self.units.shape)

    def block(self, unit: int) -> slice:
        """Rows of P that belong to a unit."""
        size, start = self.units.shape[1], self.tail.size
        return slice(start + unit * size, start + (unit + 1) * size)


def initial(inputs: int, outputs: int, settings: Settings) -> State:
    """The state before the first observation: no units, zero tail with its prior variance."""
    p = {"affine": 1 + inputs, "constant": 1, "none": 0}[settings.tail]
    return State(
        tail=np.zeros((outputs, p)),
        units=np.zeros((0, outputs + 2 * inputs)),
        covariance=settings.tail_prior * np.eye(outputs * p),
        errors=np.zeros(0),
        seen=np.zeros((0, inputs + outputs)),
        silent=np.zeros(0, dtype=np.int64),
        count=0,
        innovation=0.0,
        inputs=inputs,
    )
