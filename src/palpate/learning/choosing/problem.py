"""Samples as a fit wants them: scaled, the outputs reduced to their leading modes; and the way back to a network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.network import Network, Scaling
from palpate.network.radial import RadialFunction
from palpate.rbf.freezing import training_record
from palpate.rbf.output_modes import leading_modes
from palpate.rbf.sample_checks import samples, spread_of
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
    record : mapping
        Of the samples in SI units, for the network's `meta`.
    """

    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    X: np.ndarray
    Y: np.ndarray
    basis: np.ndarray
    scaling: Scaling
    record: Mapping[str, Any] = field(default_factory=dict)

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
        X, Y, _, _, _ = samples(X, Y, inputs=len(inputs), outputs=len(outputs), fewest=_FEWEST)
        spread = spread_of(Y)
        constant = not np.ptp(Y, axis=0).any() or spread <= 1e-13 * float(np.abs(Y).max())
        scaling = Scaling.of(inputs, Y, scale=1.0 if constant else spread)
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
