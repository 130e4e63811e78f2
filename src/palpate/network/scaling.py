"""Affine maps between physical and scaled quantities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.units import Range, bounds

__all__ = ["Scaling"]


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

    def select(self, outputs: slice | Sequence[int]) -> Scaling:
        """The scaling of some of the outputs."""
        rows = outputs if isinstance(outputs, slice) else list(outputs)
        return Scaling(self.input_centre, self.input_half, self.output_centre[rows], self.output_scale[rows])
