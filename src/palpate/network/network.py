"""A trained radial-basis-function network as a frozen value, its scaling, and its allocation-free evaluator."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numba.core.errors import TypingError

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.kernels import for_rows
from palpate.network.network_kernels import (
    Precision,
    hessian_into,
    jacobian_into,
    packed,
    pattern,
    value_and_jacobian_into,
    value_into,
    values_into,
    workspace,
)
from palpate.network.radial import RADIAL_FUNCTIONS, RadialFunction
from palpate.network.soundness import check_shapes, unreal
from palpate.tables import column_names, columns_in_order
from palpate.units import Quantity, Range, bounds

__all__ = ["Evaluator", "Network", "Scaling"]


@dataclass(frozen=True, eq=False)
class Scaling:
    """Maps between physical and scaled quantities: affine for outputs, and for inputs without a bend.

    Inputs: ξ = (x − c)/(h + b (x − c)) with centre c, half width h and bend b, in [−1, 1] over the declared ranges.
    Without a bend this is affine. With the bend of `log_bend` equal ratios of x are about equal steps of ξ; unlike a
    logarithm it is exact arithmetic on every machine. Outputs: y = output_centre + output_scale · η, one scale for a
    whole group of outputs so that their errors compare.

    Attributes
    ----------
    input_centre, input_half : (n,)
        Value of each input at ξ = 0, and its change there by ξ, in its unit; without a bend middle and half width of
        its range.
    output_centre, output_scale : (m,)
        Zero and unit of each scaled output, in its unit.
    input_bend : (n,), optional
        b of each input, between −1 and 1; by default zero. Far outside of the range, where the denominator falls below
        h / (2 (1 + |b|)), it stays at that, so that ξ is finite everywhere.
    """

    input_centre: np.ndarray
    input_half: np.ndarray
    output_centre: np.ndarray
    output_scale: np.ndarray
    input_bend: np.ndarray = field(default_factory=lambda: np.zeros(0))  # zeros: see __post_init__

    def __post_init__(self) -> None:
        if not self.input_bend.size:
            object.__setattr__(self, "input_bend", np.zeros(np.shape(self.input_half)))

    @classmethod
    def of(
        cls,
        inputs: Sequence[Range],
        Y: np.ndarray,
        *,
        scale: float | np.ndarray | None = None,
        bends: np.ndarray | None = None,
    ) -> Scaling:
        """Scaling from declared ranges and training outputs Y (N, m), one scale for all of them or one each.

        `bends` (n,) are those of the inputs, by default zero.
        """
        low, high = bounds(inputs)
        centre = Y.mean(axis=0)
        size = scale if scale is not None else float(np.abs(Y - centre).max())
        sizes = np.broadcast_to(np.where(np.asarray(size) > 0, size, 1.0), Y.shape[1:]).astype(float)
        b = np.zeros(len(low)) if bends is None else np.asarray(bends, float)
        middle, half = ((low + high) - b * (high - low)) / 2, (high - low) / 2 * (1.0 - b**2)
        return cls(middle, half, centre, sizes, b)

    @property
    def is_bent(self) -> bool:
        """True where an input's scale is not affine."""
        return bool(np.any(self.input_bend))

    def scale_inputs(self, X: np.ndarray) -> np.ndarray:
        """Physical inputs (…, n) to scaled ones."""
        far = X - self.input_centre
        return np.asarray(far / self._denominators(far))

    def unscale_inputs(self, xi: np.ndarray) -> np.ndarray:
        """Scaled inputs (…, n), which are in [−1, 1] or not far outside, to physical ones."""
        return np.asarray(self.input_centre + self.input_half * xi / (1.0 - self.input_bend * xi))

    def _denominators(self, far: np.ndarray) -> np.ndarray:
        """Return h + b (x − c), no less than h / (2 (1 + |b|)), of offsets x − c (…, n)."""
        least = self.input_half / (2.0 * (1.0 + np.abs(self.input_bend)))
        bent = np.maximum(self.input_half + self.input_bend * far, least)
        return np.where(self.input_bend == 0.0, self.input_half, bent)

    def scale_outputs(self, Y: np.ndarray) -> np.ndarray:
        """Physical outputs (…, m) to scaled ones."""
        return np.asarray((Y - self.output_centre) / self.output_scale)

    def select(self, outputs: slice | Sequence[int]) -> Scaling:
        """The scaling of some of the outputs."""
        rows = outputs if isinstance(outputs, slice) else list(outputs)
        outer = self.output_centre[rows], self.output_scale[rows]
        return Scaling(self.input_centre, self.input_half, *outer, self.input_bend)


_DOUBLE = np.dtype(np.float64)


class Evaluator:
    """Evaluates one point at a time into arrays it owns: `y = evaluator(x)` allocates nothing.

    The returned array (m,), and `jacobian` (m, n) if it was asked for, are overwritten by the next call; copy
    them to keep them. One evaluator serves one thread at a time.

    Parameters
    ----------
    network : Network
        The network to evaluate.
    precision : {"double", "single"}
        In single precision units, weights and outputs are 32-bit numbers; how much that costs is for
        `Network.precision_error` to measure, it is not known beforehand.
    jacobian : bool
        Whether each call also renews `jacobian`.
    """

    def __init__(self, network: Network, *, precision: Precision = "double", jacobian: bool = False) -> None:
        compiled = network.compiled(precision)
        self._inputs = network.inputs
        kind = compiled[0].dtype
        self._y = np.zeros(len(network.outputs), kind)
        self._J = np.zeros((len(network.inputs) if jacobian else 0, len(network.outputs)), kind)
        self._kernel: Callable[..., bool]
        self._rest: tuple[np.ndarray, ...]
        if jacobian:
            self._kernel, self._rest = value_and_jacobian_into, (self._y, self._J, *compiled)
        else:
            self._kernel, self._rest = value_into, (self._y, *compiled)
        self(np.array([r.low for r in network.inputs]))  # compile now, not in the loop

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Outputs (m,) at x (n,), in SI units.

        A contiguous float64 array is taken as it is; anything else is converted first.

        Raises
        ------
        UsageError
            If x has not n numbers.
        """
        if type(x) is not np.ndarray or x.dtype is not _DOUBLE:
            x = np.ascontiguousarray(x, dtype=np.float64)
        try:
            fits = self._kernel(x, *self._rest)
        except TypingError:  # not one-dimensional
            fits = False
        if not fits:
            raise _refused(x, len(self._inputs))
        return self._y

    @property
    def jacobian(self) -> np.ndarray:
        """∂f/∂x (m, n) where the last call evaluated, in output units per input unit.

        Raises
        ------
        UsageError
            If the evaluator was made without it.
        """
        if not len(self._J):
            raise UsageError(
                "This evaluator gives no Jacobian.", fix="Make it by network.evaluator(jacobian=True)."
            )
        return self._J.T

    def __repr__(self) -> str:
        return f"Evaluator: {len(self._inputs)} inputs → {np.array2string(self._y, threshold=8)}"


def _refused(x: np.ndarray, inputs: int) -> UsageError:
    """The error for a point that has another shape than (n,)."""
    return UsageError(
        f"A point of shape {x.shape} can't be evaluated.", fix=f"Pass an array of shape ({inputs},)."
    )


@dataclass(frozen=True, eq=False)
class Network:
    """f(x) = basis · (T·[1, ξ] + Σ_k w_k g(‖A_k ξ − b_k‖²)) in scaled inputs ξ and scaled outputs.

    Platt 1991 (resource-allocating network); the affine tail T is palpate's addition.

    Attributes
    ----------
    inputs : n ranges
        Names, units and the trained interval of each input.
    outputs : m quantities
        Names and units.
    factors : (h, r, n)
        A_k. Axis-aligned Gaussians have A_k = diag(1/σ_k).
    shifts : (h, r)
        b_k = A_k μ_k.
    weights : (k, h)
        Of k latent outputs; without a basis these are the m outputs.
    tail : (k, 1 + n)
        Zero where there is none, or no slope.
    scaling : Scaling
        Between physical and scaled inputs and outputs.
    radial : {"gaussian", "inverse-multiquadric", "matern-5/2"}
        The radial function g.
    basis : (m, k), optional
        Output modes: m outputs of which only k move independently.
    extras : mapping of name to array
        Further arrays that belong to the network and travel in its file, such as the posterior covariance.
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
    radial: RadialFunction = "gaussian"
    basis: np.ndarray | None = None
    extras: Mapping[str, np.ndarray] = field(default_factory=dict)

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
        """Network of axis-aligned Gaussians from centres (h, n) and widths σ (h, n), both scaled.

        Raises
        ------
        UsageError
            If these are not of one shape, a width is not positive, or the parts do not fit together.
        """
        centres, widths = np.asarray(centres, float), np.asarray(widths, float)
        if (
            centres.ndim != 2
            or widths.shape != centres.shape
            or not ((widths > 0) & np.isfinite(widths)).all()
        ):
            raise UsageError(
                f"Centres of shape {centres.shape} and widths of shape {widths.shape} make no Gaussians.",
                why="Each unit has a centre and a positive, finite width along every input.",
                fix="Pass centres (h, n) and widths (h, n).",
            )
        h, n = centres.shape
        factors = np.zeros((h, n, n))
        factors[:, np.arange(n), np.arange(n)] = 1.0 / widths
        return cls(
            tuple(inputs), tuple(outputs), factors, centres / widths, weights, tail, scaling, dict(meta or {})
        )

    def __post_init__(self) -> None:
        own_arrays(self, "factors", "shifts", "weights", "tail", "basis")
        object.__setattr__(self, "inputs", tuple(self.inputs))
        object.__setattr__(self, "outputs", tuple(self.outputs))
        check_shapes(self)
        if self.radial not in RADIAL_FUNCTIONS:
            raise UsageError(
                f"There is no radial function {self.radial!r}.",
                fix=f"Choose one of {', '.join(RADIAL_FUNCTIONS)}.",
            )
        if fault := unreal(self):
            raise UsageError(
                f"A network can't be made: {fault}.",
                why="Every answer it gave would be not-a-number.",
                fix="Learn it again, from finite samples over ranges that are not empty.",
            )

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        names = ", ".join(str(r) for r in self.inputs)
        modes = "" if self.basis is None else f" through {self.basis.shape[1]} modes"
        kind = f" ({self.form}, {self.radial})" if self.units else ""
        return f"Network: {names} → {len(self.outputs)} outputs{modes}, {self.units} units{kind}"

    @property
    def units(self) -> int:
        """Number of units h."""
        return int(self.factors.shape[0])

    @property
    def form(self) -> str:
        """The shape of the factors: isotropic, axis-aligned, rotated (triangular), full, or their rank."""
        r, n = self.factors.shape[1:]
        rows, columns = pattern(self.factors).T
        if r < n:
            return f"rank {r}"
        if (rows == columns).all():
            diagonal = np.diagonal(self.factors, axis1=1, axis2=2)
            return "isotropic" if n == 1 or (diagonal == diagonal[:, :1]).all() else "axis-aligned"
        return "rotated" if (rows >= columns).all() else "full"

    @cached_property
    def centres(self) -> np.ndarray:
        """Scaled centres μ (h, n); least-norm points where A_k has fewer rows than columns."""
        return np.array(
            [np.linalg.pinv(A) @ b for A, b in zip(self.factors, self.shifts, strict=True)]
        ).reshape(self.units, len(self.inputs))

    @cached_property
    def _packed(self) -> tuple[np.ndarray, ...]:
        return packed(self, "double")

    def compiled(self, precision: Precision = "double") -> tuple[np.ndarray, ...]:
        """The arguments that `network_kernels` take after their own, with a workspace for one thread."""
        parts = self._packed if precision == "double" else packed(self, precision)
        return (*workspace(parts), *parts)

    def predict(self, X: np.ndarray, *, precision: Precision = "double") -> np.ndarray:
        """Outputs (N, m) at inputs X (N, n), both in physical (SI) units; a table's columns are matched by name.

        Raises
        ------
        UsageError
            If X has the wrong number of columns, a table other ones, or there is no such precision.
        """
        if column_names(X):
            X = columns_in_order("Inputs X", X, [r.name for r in self.inputs])
        X = np.ascontiguousarray(X, dtype=np.float64)
        if X.ndim != 2 or X.shape[1] != len(self.inputs):
            raise UsageError(
                f"The network takes {len(self.inputs)} inputs ({', '.join(r.name for r in self.inputs)}); "
                f"an array of shape {X.shape} came.",
                fix=f"Pass an array of shape (N, {len(self.inputs)}).",
            )
        compiled = self.compiled(precision)
        Y = np.empty((X.shape[0], len(self.outputs)), compiled[0].dtype)
        for_rows(values_into, len(X))(X, Y, *compiled)
        return Y

    def precision_error(self, X: np.ndarray) -> np.ndarray:
        """Largest |single − double| (m,) of each output over the points X (N, n), in output units: a measurement.

        Raises
        ------
        UsageError
            If X has the wrong number of columns.
        """
        difference = self.predict(X, precision="single") - self.predict(X)
        return np.asarray(np.abs(difference).max(axis=0, initial=0.0))

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """∂f/∂x (m, n) at one point x (n,), in output units per input unit.

        Raises
        ------
        UsageError
            If x has another shape.
        """
        J = np.empty((len(self.inputs), len(self.outputs)))
        for_rows(jacobian_into, 1)(self._point(x), J, *self.compiled())
        return np.ascontiguousarray(J.T)

    def hessian(self, x: np.ndarray) -> np.ndarray:
        """∂²f/∂x² (n, n) at one point x (n,) of a network with one output.

        Raises
        ------
        UsageError
            If the network has several outputs, or x another shape.
        """
        if len(self.outputs) != 1:
            raise UsageError(
                f"A Hessian is of one output; this network has {len(self.outputs)}.",
                fix="Pick one: network.select([0]).hessian(x).",
            )
        n = len(self.inputs)
        H = np.empty((n, n))
        for_rows(hessian_into, 1)(self._point(x), H, np.empty((n, n)), np.empty(n), *self.compiled())
        return H

    def _point(self, x: np.ndarray) -> np.ndarray:
        x = np.ascontiguousarray(x, dtype=np.float64)
        if x.shape != (len(self.inputs),):
            raise _refused(x, len(self.inputs))
        return x

    def evaluator(self, *, precision: Precision = "double", jacobian: bool = False) -> Evaluator:
        """An allocation-free single-point evaluator for the 1 kHz path, with the Jacobian if asked."""
        return Evaluator(self, precision=precision, jacobian=jacobian)

    def select(self, outputs: slice | Sequence[int]) -> Network:
        """The network of some of the outputs, without `extras`; a basis larger than them is multiplied out.

        Raises
        ------
        UsageError
            If there are no such outputs, or none are asked for.
        """
        rows = outputs if isinstance(outputs, slice) else list(outputs)
        try:
            kept = tuple(np.array(self.outputs, dtype=object)[rows])
        except IndexError as error:
            raise UsageError(
                f"There are no outputs {rows} in a network of {len(self.outputs)}.",
                why=str(error),
                fix=f"Count from 0 to {len(self.outputs) - 1}.",
            ) from error
        if not kept:
            raise UsageError("No output is selected.", fix="Pick one at least: network.select([0]).")
        basis, weights, tail = self.basis, self.weights, self.tail
        if basis is None:
            weights, tail = weights[rows], tail[rows]
        else:
            basis = basis[rows]
            if basis.shape[0] <= basis.shape[1]:
                weights, tail, basis = basis @ weights, basis @ tail, None
        return replace(
            self,
            outputs=kept,
            weights=weights,
            tail=tail,
            basis=basis,
            scaling=self.scaling.select(outputs),
            extras={},
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write this network alone to a file.

        Raises
        ------
        UsageError
            If the folder does not exist or can't be written, or the network's numbers can't be evaluated.
        """
        from palpate.network.archive import Archive, save_archive

        return save_archive(path, Archive({"network": self}))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Network:
        """Read back what `save` wrote, bit for bit.

        Raises
        ------
        FileFormatError
            If the file is missing, truncated, corrupt, foreign or from a later version, or holds something else.
        """
        from palpate.network.archive import load_single_network

        return load_single_network(path)
