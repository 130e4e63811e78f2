"""State of the filter as a value: parameters, their covariance, and the memory of the growth and pruning rules."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.rbf.filter.covariance import Blocks, Covariance, Full, NoCovariance, Shared
from palpate.rbf.filter.settings import Settings

__all__ = ["State", "initial"]


@dataclass(frozen=True, eq=False)
class State:
    """A network being learnt, in scaled inputs (n) and outputs (m).

    Attributes
    ----------
    coefficients : (p_t + h, m)
        The tail's columns, then one row of weights per unit; p_t is 1 + n, 1 or 0 by the kind of tail.
    theta : (h, p)
        The units' numbers, by the settings' form.
    covariance : Covariance
        Of the parameters, as the settings' update rule keeps it.
    places : (h, n)
        Where each unit was added.
    errors : (≤ M,)
        The last squared error norms ‖e‖², newest last.
    memory : (≤ S, n + m) or (≤ S, n + r)
        Remembered observations [x, y], newest last (see `regression`); y by the output modes where there are some.
    memory_times : (≤ S,) int
        Which observation each of those was, counting from one.
    silent : (h,) int
        Observations in a row in which each unit was silent.
    count : int
        t, observations seen over all passes.
    innovation : float
        Running mean square of the innovation, per output.
    modes : (m, r), optional
        Orthonormal output directions that drive the shapes under the shared-weight rule; None for all outputs.
    mode_coefficients : (p_t + h, r), optional
        The coefficients by those modes, kept up to date so that no step has to form them.
    least_error : float
        Least mean squared error over the memory so far, ‖e‖² per observation; slowly fading.
    changed_at : int
        The observation that began the latest abrupt change, counting from one; 0 for none. Found by learners that
        follow a stream (see `palpate.learning.stream.following`).
    drifts : float
        Probability that the map drifts, found by the same; 0 elsewhere.
    """

    coefficients: np.ndarray
    theta: np.ndarray
    covariance: Covariance
    places: np.ndarray
    errors: np.ndarray
    memory: np.ndarray
    memory_times: np.ndarray
    silent: np.ndarray
    count: int
    innovation: float
    modes: np.ndarray | None = None
    mode_coefficients: np.ndarray | None = None
    least_error: float = float("inf")
    changed_at: int = 0
    drifts: float = 0.0

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        return (
            f"State: {self.inputs} inputs, {self.outputs} outputs, {self.units} units "
            f"after {self.count} observations"
        )

    @property
    def inputs(self) -> int:
        """Number of inputs n."""
        return int(self.places.shape[1])

    @property
    def outputs(self) -> int:
        """Number of outputs m."""
        return int(self.coefficients.shape[1])

    @property
    def units(self) -> int:
        """Number of units h."""
        return len(self.theta)

    @property
    def tail(self) -> np.ndarray:
        """T (m, p_t)."""
        return self.coefficients[: len(self.coefficients) - self.units].T

    @property
    def weights(self) -> np.ndarray:
        """w (h, m)."""
        return self.coefficients[len(self.coefficients) - self.units :]

    @property
    def latent_coefficients(self) -> np.ndarray:
        """The coefficients (p_t + h, r) by the modes, or (p_t + h, m) where there are none."""
        return self.coefficients if self.mode_coefficients is None else self.mode_coefficients

    @property
    def latent_weights(self) -> np.ndarray:
        """The weights' part of `latent_coefficients`, (h, r) or (h, m)."""
        return self.latent_coefficients[len(self.coefficients) - self.units :]

    @property
    def unit_size(self) -> int:
        """Unknowns per unit, m + p."""
        return self.outputs + int(self.theta.shape[1])

    def centres(self, settings: Settings) -> np.ndarray:
        """μ (h, n)."""
        return settings.regressors(self.inputs).form.centres(self.theta)

    def widths(self, settings: Settings) -> np.ndarray:
        """σ (h, n) along the axes: reciprocals of A's diagonal, for units that have a centre."""
        A = settings.regressors(self.inputs).form.factors(self.theta)[0]
        return np.asarray(1.0 / np.diagonal(A, axis1=1, axis2=2))

    def vector(self) -> np.ndarray:
        """z (d,): the tail row by row, then (w, θ) unit by unit."""
        h, m = self.units, self.outputs
        a = (len(self.coefficients) - h) * m
        z = np.empty(a + h * self.unit_size)
        z[:a] = self.tail.ravel()
        units = z[a:].reshape(h, self.unit_size)
        units[:, :m], units[:, m:] = self.weights, self.theta
        return z

    def split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients (p_t + h, m) and θ (h, p) that a vector z (d,) holds."""
        h, m = self.units, self.outputs
        a = (len(self.coefficients) - h) * m
        units = z[a:].reshape(h, self.unit_size)
        coefficients = np.empty_like(self.coefficients)
        coefficients[: len(coefficients) - h] = z[:a].reshape(m, -1).T
        coefficients[len(coefficients) - h :] = units[:, :m]
        return coefficients, units[:, m:]

    def with_parameters(self, z: np.ndarray) -> State:
        """The state with its parameters replaced by a vector z (d,)."""
        coefficients, theta = self.split(z)
        return replace(self, coefficients=coefficients, theta=theta)

    def block(self, unit: int) -> slice:
        """Places of a unit in z."""
        start = self.tail.size + unit * self.unit_size
        return slice(start, start + self.unit_size)


def initial(inputs: int, outputs: int, settings: Settings, modes: np.ndarray | None = None) -> State:
    """The state before the first observation: no units, zero tail with its prior variance.

    Parameters
    ----------
    inputs, outputs : int
        n and m.
    settings : Settings
        Settings of the filter.
    modes : (m, r) array, optional
        Orthonormal output directions for the shared-weight rule.
    """
    regressors = settings.regressors(inputs)
    p, p_t = regressors.form.size, regressors.tail_size
    columns = inputs + (outputs if modes is None else modes.shape[1])
    return State(
        coefficients=np.zeros((p_t, outputs)),
        theta=np.zeros((0, p)),
        covariance=_prior(p_t, outputs, p, settings),
        places=np.zeros((0, inputs)),
        errors=np.zeros(0),
        memory=np.zeros((0, columns)),
        memory_times=np.zeros(0, dtype=np.int64),
        silent=np.zeros(0, dtype=np.int64),
        count=0,
        innovation=0.0,
        modes=modes,
        mode_coefficients=None if modes is None else np.zeros((p_t, modes.shape[1])),
    )


def _prior(p_t: int, m: int, p: int, settings: Settings) -> Covariance:
    match settings.update:
        case "full":
            return Full.prior(m * p_t, settings.tail_prior)
        case "decoupled" | "winner":
            return Blocks.prior(m * p_t, settings.tail_prior, m + p)
        case "shared":
            return Shared.prior(p_t, settings.tail_prior)
    return NoCovariance()
