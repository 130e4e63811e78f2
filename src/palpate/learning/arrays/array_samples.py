"""Samples as a user has them, and as a fit wants them: scaled, the outputs reduced to their leading modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.format import count
from palpate.learning.learn import ranges_of
from palpate.network import Network, Scaling
from palpate.network.radial import RadialFunction
from palpate.rbf.freezing import training_record
from palpate.rbf.output_modes import leading_modes
from palpate.rbf.sample_checks import samples, spread_of
from palpate.tables import column_names, columns_in_order, numbers_of
from palpate.units import Quantity, Range

__all__ = ["FEWEST", "ArrayProblem", "Samples", "constant", "points"]

FEWEST = 20
_MODES_MAX = 96
_LARGEST = 1e100  # its square is still a number


@dataclass(frozen=True, eq=False)
class Samples:
    """Checked samples."""

    X: np.ndarray  # (N, n), SI units
    Y: np.ndarray  # (N, m), SI units
    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    one_output: bool  # Y came as (N,)
    # of the table that are the inputs, in their order; of a bare array names of the inputs
    columns: tuple[str, ...]
    # of each row in the table, by which notes name a sample; None where they count rows from 0
    lines: tuple[int, ...] | None = None
    rows: tuple[int, ...] | None = None  # of the table, one for each sample, where some rows are left out
    bends: np.ndarray | None = None  # (n,), of the inputs' scales; None where all are straight

    @classmethod
    def of(
        cls,
        X: Any,
        Y: Any,
        inputs: Sequence[Range] | None = None,
        outputs: Sequence[Quantity] | None = None,
        lines: Sequence[int] | None = None,
    ) -> Samples:
        """Check what a user has; see `palpate.fit`."""
        X, columns = _numbers_and_names("Inputs X", X, inputs)
        Y, names = _numbers_and_names("Outputs Y", Y, outputs)
        one = Y.ndim == 1
        X, Y = (a[:, None] if a.ndim == 1 else a for a in (X, Y))
        columns, names = _complete_names(columns, X, "x"), _complete_names(names, Y, "y")
        _check_rows(X, Y, columns + names)
        declared = ranges_of(X, columns) if inputs is None else tuple(inputs)
        named = tuple(map(Quantity, names)) if outputs is None else tuple(outputs)
        _check_declared(declared, X.shape[1], Range, "input", 'palpate.Range("force", 0.0, 5.0, "N")')
        _check_declared(named, Y.shape[1], Quantity, "output", 'palpate.Quantity("tip", "m")')
        if lines is not None and len(lines) != len(X):
            raise UsageError(
                f"{len(lines)} lines do not number {len(X)} samples.", fix="Pass one line for each row of X."
            )
        return cls(X, Y, declared, named, one, columns, None if lines is None else tuple(lines))


@dataclass(frozen=True, eq=False)
class ArrayProblem:
    """The samples to learn from, in scaled inputs and latent outputs."""

    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    X: np.ndarray  # (N, n), scaled to [−1, 1] over the declared ranges
    # (N, k), latent outputs: scaled ones are Y @ basis, but for 1e-8 of them or what is beyond 96 modes
    Y: np.ndarray
    basis: np.ndarray  # (k, m), orthonormal
    scaling: Scaling  # outputs by the standard deviation of all of one unit together
    # of the samples in SI units, for the network's `meta`
    record: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        X: np.ndarray,
        Y: np.ndarray,
        inputs: Sequence[Range],
        outputs: Sequence[Quantity],
        bends: np.ndarray | None = None,
    ) -> ArrayProblem:
        """Scale X (N, n) and Y (N, m), which are in SI units; 20 samples at least."""
        X, Y, _, _, _ = samples(X, Y, inputs=len(inputs), outputs=len(outputs), fewest=FEWEST)
        spread = spread_of(Y)
        constant = not np.ptp(Y, axis=0).any() or spread <= 1e-13 * float(np.abs(Y).max())
        scaling = Scaling.of(inputs, Y, scale=1.0 if constant else _scales(Y, outputs), bends=bends)
        latent, basis = leading_modes(
            np.zeros_like(Y) if constant else scaling.scale_outputs(Y), most=_MODES_MAX
        )
        record = training_record(X, Y, inputs)
        return cls(tuple(inputs), tuple(outputs), scaling.scale_inputs(X), latent, basis, scaling, record)

    @property
    def unit(self) -> float:
        """Error per latent output where the error is one standard deviation of the outputs."""
        return float(np.sqrt(self.basis.shape[1] / self.basis.shape[0]))

    def network(
        self,
        A: np.ndarray,
        b: np.ndarray,
        weights: np.ndarray,
        tail: np.ndarray,
        radial: RadialFunction,
        *,
        heldout: float,
    ) -> Network:
        """The network of factors A (h, r, n), shifts b (h, r), latent weights (h, k) and tail (1 + n, k).

        `heldout` is its error on held-out samples relative to the outputs' standard deviation.
        """
        k, m = self.basis.shape
        W, T, basis = weights.T, tail.T, self.basis.T
        meta = {"heldout": heldout, "refined": True, **self.record}
        if m <= k:  # as many modes as outputs: no need of them
            return Network(self.inputs, self.outputs, A, b, basis @ W, basis @ T, self.scaling, meta, radial)
        return Network(self.inputs, self.outputs, A, b, W, T, self.scaling, meta, radial, basis)


def _scales(Y: np.ndarray, outputs: Sequence[Quantity]) -> float | np.ndarray:
    """Return the outputs' scale: their common spread, or where their units differ that of each unit (m,)."""
    units = [q.unit for q in outputs]
    if len(set(units)) == 1:
        return float(spread_of(Y))
    spread = {unit: float(spread_of(Y[:, [u == unit for u in units]])) for unit in set(units)}
    return np.array([spread[unit] or 1.0 for unit in units])


def points(X: Any, inputs: Sequence[Range], columns: Sequence[str] = ()) -> np.ndarray:
    """Return inputs (N, n) at which something is asked; of a single input (N,) will do.

    A table's columns may stand in any order; their names are `columns`, by default those of the inputs.
    """
    n = len(inputs)
    asked = columns_in_order("Inputs X", X, columns or [r.name for r in inputs])
    if asked.ndim == 1 and n == 1:
        asked = asked[:, None]
    if asked.ndim != 2 or asked.shape[1] != n:
        names = ", ".join(r.name for r in inputs)
        raise UsageError(
            f"The network takes {n} inputs ({names}); an array of shape {asked.shape} came.",
            fix=f"Pass an array of shape (N, {n}), one row per point.",
        )
    return asked


def constant(Y: np.ndarray) -> bool:
    """Return true where no column of Y (N, m) changes by more than rounding."""
    return not bool((np.ptp(Y, axis=0) > 1e-13 * np.abs(Y).max()).any())


def _numbers_and_names(
    what: str, given: Any, declared: Sequence[Range] | Sequence[Quantity] | None
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return numbers, and the names of a table's columns, in the order of what is declared where the names agree."""
    own = column_names(given) or ()
    stated = [str(getattr(item, "name", "")) for item in declared or ()]
    if stated and set(stated) & set(own):
        return columns_in_order(what, given, stated), tuple(stated)
    return numbers_of(what, given), own or tuple(stated)


def _complete_names(own: tuple[str, ...], values: np.ndarray, letter: str) -> tuple[str, ...]:
    """Return a name for each column: the table's own where it has them, else x0, x1 and so on."""
    count = values.shape[-1] if values.ndim == 2 else 0
    return own if len(own) == count else tuple(f"{letter}{i}" for i in range(count))


def _check_rows(X: np.ndarray, Y: np.ndarray, names: Sequence[str]) -> None:
    if X.ndim != 2 or Y.ndim != 2 or len(X) != len(Y) or not X.shape[1] or not Y.shape[1]:
        raise UsageError(
            f"Inputs of shape {X.shape} and outputs of shape {Y.shape} are not samples.",
            why="Each row of X is one sample's inputs, the same row of Y its outputs.",
            fix="Pass X (N, n) and Y (N, m), or Y (N,) for one output.",
        )
    if len(X) < FEWEST:
        raise UsageError(
            f"{count(len(X), 'sample')}: too few to choose a network by.",
            why="Some must be held out to judge by.",
            fix=f"Give {FEWEST} at least.",
        )
    finite = np.hstack([np.isfinite(X), np.isfinite(Y)])
    bad = ~finite.all(axis=1)
    if bad.any():
        first = int(bad.argmax())
        raise UsageError(
            f"{bad.sum()} of {len(X)} samples hold NaN or infinity, the first in row {first}"
            f" (column {names[int(np.argmin(finite[first]))]!r}).",
            why="A sample without a value says nothing, and would spoil the others.",
            fix="Leave them out: ok = np.isfinite(X).all(1) & np.isfinite(Y).all(1); X[ok], Y[ok].",
        )
    if max(np.abs(X).max(), np.abs(Y).max()) > _LARGEST:
        raise UsageError(
            f"Numbers beyond {_LARGEST:.0e} can't be squared.", fix="Give the samples in other units."
        )
    if constant(X):
        raise UsageError(
            f"All {len(X)} samples have the same inputs.",
            why="Outputs can't be told apart by inputs that do not change.",
            fix="Check which columns of the data became X.",
        )
    if constant(Y):
        raise UsageError(
            f"All {len(Y)} samples have the same outputs.",
            why="There is nothing to learn, and no error to compare by.",
            fix="Check which columns of the data became Y.",
        )


def _check_declared(given: tuple[Any, ...], count: int, kind: type, word: str, example: str) -> None:
    if len(given) != count or not all(isinstance(one, kind) for one in given):
        raise UsageError(
            f"The {word}s declared do not fit the {count} {word}s of the samples: {given!r:.80}.",
            fix=f"Give one {kind.__name__} for each column, such as {example}, or leave {word}s out.",
        )
