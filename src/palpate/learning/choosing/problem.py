"""Samples as a fit wants them: scaled, the outputs reduced to their leading modes; and the way back to a network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.network import Network, Scaling
from palpate.network.radial import RadialFunction
from palpate.units import Quantity, Range

__all__ = ["Problem"]

_FEWEST = 20
_MODES_MAX = 96


@dataclass(frozen=True, eq=False)
class Problem:
    """What is to be learnt, in scaled inputs and latent outputs.

    Attributes
    ----------
    inputs, outputs : tuples of n ranges and m quantities
    X : (N, n)
        Scaled to [−1, 1] over the declared ranges.
    Y : (N, k)
        Latent outputs: scaled outputs are Y @ basis, but for 1e-8 of them or what is beyond 96 modes.
    basis : (k, m)
        Orthonormal.
    scaling : Scaling
        Outputs by the standard deviation of all of them together.
    """

    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    X: np.ndarray
    Y: np.ndarray
    basis: np.ndarray
    scaling: Scaling

    @classmethod
    def of(
        cls, X: np.ndarray, Y: np.ndarray, inputs: Sequence[Range], outputs: Sequence[Quantity]
    ) -> Problem:
        """From X (N, n) and Y (N, m) in SI units.

        Raises
        ------
        UsageError
            If there are fewer than 20 samples, shapes disagree or numbers are not finite.
        """
        X, Y = np.asarray(X, float), np.asarray(Y, float)
        _check(X, Y, inputs, outputs)
        spread = float(np.sqrt(((Y - Y.mean(axis=0)) ** 2).mean()))
        constant = spread <= 1e-13 * float(np.abs(Y).max())
        scaling = Scaling.of(inputs, Y, scale=1.0 if constant else spread)
        latent, basis = _leading(np.zeros_like(Y) if constant else scaling.scale_outputs(Y))
        return cls(tuple(inputs), tuple(outputs), scaling.scale_inputs(X), latent, basis, scaling)

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
        meta = {"heldout": heldout, "refined": True}
        if m <= k:  # as many modes as outputs: no need of them
            return Network(self.inputs, self.outputs, A, b, basis @ W, basis @ T, self.scaling, meta, radial)
        return Network(self.inputs, self.outputs, A, b, W, T, self.scaling, meta, radial, basis)


def _leading(Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Y (N, m) ≈ L (N, k) V (k, m): the modes that carry all but 1e-8 of it, 96 at most.

    A range finder with one power iteration (Halko, Martinsson & Tropp 2011). Unlike `rows.modes`, it may drop what
    is too small or too irregular to be learnt.
    """
    count = min(*Y.shape, _MODES_MAX + 10)
    sample = Y @ np.random.default_rng(0).normal(size=(Y.shape[1], count))
    Q = np.linalg.qr(Y @ (Y.T @ np.linalg.qr(sample)[0]))[0]
    U, s, V = np.linalg.svd(Q.T @ Y, full_matrices=False)
    rest = np.sqrt(np.maximum(np.cumsum((s**2)[::-1])[::-1], 0.0))
    k = int(np.clip((rest > 1e-8 * max(float(rest[0]), 1e-300)).sum(), 1, _MODES_MAX))
    return np.ascontiguousarray(Q @ (U[:, :k] * s[:k])), np.ascontiguousarray(V[:k])


def _check(X: np.ndarray, Y: np.ndarray, inputs: Sequence[Range], outputs: Sequence[Quantity]) -> None:
    if X.ndim != 2 or Y.ndim != 2 or X.shape != (len(Y), len(inputs)) or Y.shape[1] != len(outputs):
        raise UsageError(
            f"Inputs {X.shape} and outputs {Y.shape} are not samples of {len(inputs)} inputs and {len(outputs)} "
            "outputs.",
            fix="Pass X (N, n) and Y (N, m) with one range for each input and one quantity for each output.",
        )
    if len(X) < _FEWEST or not (np.isfinite(X).all() and np.isfinite(Y).all()):
        raise UsageError(
            f"{len(X)} samples, or some that are not finite, are too little to choose a network by.",
            fix=f"Give at least {_FEWEST} finite samples.",
        )
