"""A field of any physics: a mean and modes whose coefficients follow from the inputs.

    u(x) = ū + Σ_k a_k(x) φ_k        var u_j = f² (Σ_k φ_kj² var a_k + τ_j²)

at the nodes or cells of a mesh, or along an axis (a curve). The coefficients are learnt, τ is what modes of other
solves miss at each place, and f scales the deviations so that the intervals hold of solves left out what they say.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Any, ClassVar, Literal

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.format import count, plain
from palpate.network import Network, TrainedRegion
from palpate.network.kinds import register_kind
from palpate.network.network_kernels import Precision
from palpate.surrogates.fields.field import Field
from palpate.surrogates.fields.places import AxisPlaces, MeshPlaces
from palpate.surrogates.learnt_quantities import LearntQuantities

__all__ = ["ModalEvaluator", "ModalField"]


@dataclass(frozen=True, eq=False, repr=False)
class ModalField(Field):
    """A field at P places with C components each, as a value, kept in the file of its surrogate.

    Attributes
    ----------
    name, unit : str
        What it is called, and the SI unit of its values.
    places : MeshPlaces or AxisPlaces
        Where its values are.
    coefficients : LearntQuantities
        Inputs → coefficients of the k modes, in the field's unit.
    mean : (P, C)
        Mean of the solves that it was learnt from.
    modes : (k, P, C)
        Orthonormal in the mean square over places.
    scatter : (P, C)
        Root mean square of what modes of other solves miss at each place, in the field's unit.
    widening : float
        What calibration multiplies the deviations by; not-a-number where there were too few solves for it.
    components : tuple of str
        Names of the components; none of a scalar.
    meta : mapping
        JSON-able record of its training: ``truncation`` and ``truncation_left_out`` (root mean square that the modes
        miss, of the solves learnt from and of others), ``left_out_p95`` (95th percentile of the error over places and
        solves left out) and ``range`` (largest less least value), in the field's unit.
    solved_at : (N, n), optional
        Inputs of the solves that it was learnt from, SI units.
    solved : (N, k), optional
        Coefficients of these solves in the modes: what was solved, up to what the modes miss.

    Raises
    ------
    UsageError
        If the parts do not fit together.
    """

    carrier: ClassVar[Literal["places"]] = "places"

    name: str
    unit: str
    places: MeshPlaces | AxisPlaces
    coefficients: LearntQuantities
    mean: np.ndarray
    modes: np.ndarray
    scatter: np.ndarray
    widening: float = 1.0
    components: tuple[str, ...] = ()
    meta: Mapping[str, Any] = field(default_factory=dict)
    solved_at: np.ndarray | None = None
    solved: np.ndarray | None = None

    def __post_init__(self) -> None:
        own_arrays(self, "mean", "modes", "scatter", "solved_at", "solved")
        k, shape = len(self.coefficients.outputs), (len(self.places), max(1, len(self.components)))
        fits = self.mean.shape == self.scatter.shape == shape and self.modes.shape == (k, *shape)
        at, solved = self.solved_at, self.solved
        fits &= (at is None) == (solved is None)
        if at is not None and solved is not None:
            fits &= at.shape == (len(solved), len(self.inputs)) and solved.shape[1:] == (k,)
        if not (fits and all(np.isfinite(a).all() for a in (self.mean, self.modes, self.scatter))):
            raise UsageError(
                f"The field {self.name!r} can't be made of {k} coefficients and modes {self.modes.shape}.",
                why=f"It has {self.places} and {count(shape[1], 'component')}: mean {self.mean.shape}.",
                fix="Let `palpate.learn` make it of one dataset.",
            )

    def __str__(self) -> str:
        missed = self.meta.get("truncation_left_out")
        words = "" if missed is None else f", which miss {plain(missed)} {self.unit} of other solves".rstrip()
        unit = f" ({self.unit})" * bool(self.unit)
        return f"field {self.name}{unit} at {self.places}: {count(len(self.modes), 'mode')}{words}"

    @property
    def network(self) -> Network:  # type: ignore[override]
        """The network of the coefficients."""
        return self.coefficients.network

    @property
    def region(self) -> TrainedRegion | None:
        """The trained region of the coefficients."""
        return self.coefficients.region

    @property
    def is_curve(self) -> bool:  # type: ignore[override]
        """True where its places are points of an axis."""
        return self.axis is not None

    @property
    def axis(self) -> AxisPlaces | None:
        """The axis of a curve; None of a field over a mesh."""
        return self.places if isinstance(self.places, AxisPlaces) else None

    @property
    def mesh(self) -> MeshPlaces | None:
        """The mesh of a field; None of a curve."""
        return self.places if isinstance(self.places, MeshPlaces) else None

    def values(self, X: np.ndarray) -> np.ndarray:
        """Return the field (N, P, C) at inputs X (N, n).

        Raises
        ------
        UsageError
            If X has another number of columns; so do all that take X.
        """
        return np.asarray(self.mean + np.tensordot(self.coefficients.predict(X), self.modes, 1))

    def deviation(self, X: np.ndarray) -> np.ndarray:
        """Return the calibrated standard deviation (N, P, C) of the field at inputs X (N, n).

        It is not-a-number where there were too few solves to calibrate it.
        """
        spread = self.coefficients.deviation(X) ** 2
        variance = np.tensordot(spread, self.modes**2, 1) + self.scatter**2
        return np.asarray(self.widening * np.sqrt(variance))

    def interval(self, X: np.ndarray, level: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds (N, P, C) of the field at inputs X (N, n).

        Over places and solves together they hold about the share `level` of what would be solved, by default that
        which was calibrated for.
        """
        level = self.coefficients.level if level is None else level
        middle, half = self.values(X), NormalDist().inv_cdf((1.0 + level) / 2.0) * self.deviation(X)
        return middle - half, middle + half

    def trusted(self, X: np.ndarray) -> np.ndarray:
        """Return which of X (N, n) are like the solves that were learnt from, (N,) bool."""
        return self.coefficients.trusted(X)

    def project(self, values: np.ndarray) -> np.ndarray:
        """Return the coefficients (N, k) of fields (N, P, C) in the modes."""
        flat = (np.asarray(values, float) - self.mean).reshape(len(values), -1)
        return np.asarray(flat @ self.modes.reshape(len(self.modes), -1).T / len(self.mean))

    def evaluator(self, *, precision: Precision = "single") -> ModalEvaluator:
        """Return the allocation-free evaluator of a picture's path."""
        return ModalEvaluator(self, precision)


register_kind(Field, ModalField, "ModalField")


class ModalEvaluator:
    """Evaluates the field at one place of the inputs into arrays that it owns; for one thread at a time.

    Attributes
    ----------
    values : (P, C)
        The field where the last call evaluated.
    coefficients : (k,)
        Coefficients of the modes there.

    Parameters
    ----------
    whole : ModalField
        The field.
    precision : {"single", "double"}
        Of the modes; single is for the eye.
    """

    def __init__(self, whole: ModalField, precision: Precision = "single") -> None:
        kind = np.float32 if precision == "single" else np.float64
        self._network = whole.coefficients.network.evaluator()
        self._mean = np.ascontiguousarray(whole.mean.reshape(-1), kind)
        self._modes = np.ascontiguousarray(whole.modes.reshape(len(whole.modes), -1), kind)
        self.coefficients = np.zeros(len(whole.modes), kind)
        self.values = np.zeros(whole.mean.shape, kind)
        self._flat = self.values.reshape(-1)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Return the field (P, C) at inputs x (n,); the same array each time."""
        self.coefficients[:] = self._network(x)
        np.dot(self.coefficients, self._modes, out=self._flat)
        np.add(self._flat, self._mean, out=self._flat)
        return self.values
