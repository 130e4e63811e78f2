"""A trained radial-basis-function network as a frozen value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.network import evaluate
from palpate.units import Quantity, Range, bounds

__all__ = ["Evaluator", "Network", "Scaling"]


@dataclass(frozen=True, eq=False)
class Scaling:
    """Affine maps between physical and scaled quantities.

    Inputs: ξ = (x − input_centre)/input_half, in [−1, 1] over the declared ranges. Outputs:
    y = output_centre + output_scale · η, one scale for a whole group of outputs so that their errors compare.

    Attributes
    ----------
    input_centre, input_half : (n,)
    output_centre, output_scale : (m,)
    """

    input_centre: np.ndarray
    input_half: np.ndarray
    output_centre: np.ndarray
    output_scale: np.ndarray

    @classmethod
    def of(cls, inputs: Sequence[Range], Y: np.ndarray, *, scale: float | None = None) -> Scaling:
        """Scaling from declared ranges and training outputs Y (N, m), one scale for all of them."""
        low, high = bounds(inputs)
        centre = Y.mean(axis=0)
        size = scale if scale is not None else float(np.abs(Y - centre).max())
        return cls((low + high) / 2, (high - low) / 2, centre, np.full(Y.shape[1], size if size > 0 else 1.0))

    def scale_inputs(self, X: np.ndarray) -> np.ndarray:
        """Physical inputs (…, n) to scaled ones."""
        return np.asarray((X - self.input_centre) / self.input_half)

    def scale_outputs(self, Y: np.ndarray) -> np.ndarray:
        """Physical outputs (…, m) to scaled ones."""
        return np.asarray((Y - self.output_centre) / self.output_scale)


@dataclass(frozen=True, eq=False)
class Network:
    """f(x) = T·[1, ξ] + Σ_k w_k exp(−‖A_k ξ − b_k‖²) in scaled inputs ξ and scaled outputs.

    Platt 1991 (resource-allocating network); the affine tail T is palpate's addition.

    Attributes
    ----------
    inputs : n ranges
        Names, units and the trained interval of each input.
    outputs : m quantities
    factors : (h, r, n)
        A_k. Axis-aligned Gaussians have A_k = diag(1/σ_k).
    shifts : (h, r)
        b_k = A_k μ_k.
    weights : (m, h)
    tail : (m, 1 + n)
    scaling : Scaling
    meta : mapping
        What the file remembers of the training: method, samples, errors, dataset hash.
    """

    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    factors: np.ndarray
    shifts: np.ndarray
    weights: np.ndarray
    tail: np.ndarray
    scaling: Scaling
    meta: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def axis_aligned(
        cls,
        inputs: Sequence[Range],
        outputs: Sequence[Quantity],
        *,
        centres: np.ndarray,
        widths: np.ndarray,
        weights: np.ndarray,
        tail: np.ndarray,
        scaling: Scaling,
        meta: Mapping[str, Any] | None = None,
    ) -> Network:
        """Network of axis-aligned Gaussians from centres (h, n) and widths σ (h, n), both scaled."""
        h, n = centres.shape
        factors = np.zeros((h, n, n))
        factors[:, np.arange(n), np.arange(n)] = 1.0 / widths
        return cls(
            tuple(inputs), tuple(outputs), factors, centres / widths, weights, tail, scaling, dict(meta or {})
        )

    def __post_init__(self) -> None:
        h, r, n, m = *self.factors.shape, len(self.outputs)
        shapes = {
            "inputs": ((len(self.inputs),), (n,)),
            "shifts": (self.shifts.shape, (h, r)),
            "weights": (self.weights.shape, (m, h)),
            "tail": (self.tail.shape, (m, 1 + n)),
        }
        for name, (found, wanted) in shapes.items():
            if found != wanted:
                raise UsageError(
                    f"A network's {name} have shape {found}; its units and outputs ask for {wanted}."
                )

    def __str__(self) -> str:
        names = ", ".join(str(r) for r in self.inputs)
        return f"Network: {names} → {len(self.outputs)} outputs, {self.units} units"

    @property
    def units(self) -> int:
        """Number of units h."""
        return int(self.factors.shape[0])

    @cached_property
    def centres(self) -> np.ndarray:
        """Scaled centres μ (h, n); least-norm points where A_k has fewer rows than columns."""
        return np.array(
            [np.linalg.pinv(A) @ b for A, b in zip(self.factors, self.shifts, strict=True)]
        ).reshape(self.units, len(self.inputs))

    @cached_property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """(centre, half, factors, shifts, rows): what the compiled kernels of `evaluate` take."""
        s = self.scaling
        rows = np.vstack([self.tail.T, self.weights.T]) * s.output_scale
        rows[0] += s.output_centre
        parts = (s.input_centre, s.input_half, self.factors, self.shifts, rows)
        return tuple(np.ascontiguousarray(a, dtype=np.float64) for a in parts)

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Outputs (N, m) at inputs X (N, n), both in physical (SI) units.

        Raises
        ------
        UsageError
            If X has the wrong number of columns.
        """
        X = np.ascontiguousarray(X, dtype=np.float64)
        if X.ndim != 2 or X.shape[1] != len(self.inputs):
            raise UsageError(
                f"The network takes {len(self.inputs)} inputs ({', '.join(r.name for r in self.inputs)}); "
                f"an array of shape {X.shape} came.",
                fix=f"Pass an array of shape (N, {len(self.inputs)}).",
            )
        Y = np.empty((X.shape[0], len(self.outputs)))
        evaluate.values_into(X, Y, *self.arrays)
        return Y

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """∂f/∂x (m, n) at one point x (n,), in output units per input unit."""
        J = np.empty((len(self.outputs), len(self.inputs)))
        evaluate.jacobian_into(np.ascontiguousarray(x, dtype=np.float64), J, *self.arrays)
        return J

    def evaluator(self) -> Evaluator:
        """An allocation-free single-point evaluator for the 1 kHz path."""
        return Evaluator(self)


class Evaluator:
    """Evaluates one point at a time into an array it owns: `y = evaluator(x)` allocates nothing.

    The returned array (m,) is overwritten by the next call; copy it to keep it.
    """

    def __init__(self, network: Network) -> None:
        self._arrays = network.arrays
        self._y = np.empty(len(network.outputs))
        self(np.array([r.low for r in network.inputs]))  # compile now, not in the loop

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Outputs (m,) at x (n,), float64, in SI units."""
        evaluate.value_into(x, self._y, *self._arrays)
        return self._y
