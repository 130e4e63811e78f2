"""What a network of arrays answers at one place, for a person and for a program."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.cli.answers import beyond, outside, place_in_words, within_in_words
from palpate.learning import Fitted
from palpate.network import Network
from palpate.units import Quantity, Range

__all__ = ["Prediction", "predicted"]


@dataclass(frozen=True)
class Prediction:
    """Outputs at one place.

    Attributes
    ----------
    inputs : (n,)
        In the inputs' units.
    outputs : m quantities
    values : (m,)
    deviations : (m,), optional
        Standard deviation of what would be measured; None where the file has none. Beyond the ranges it says nothing
        and is not-a-number.
    inside : bool, optional
        Whether a training sample is near; None where the file does not tell.
    """

    inputs: np.ndarray
    outputs: tuple[Quantity, ...]
    values: np.ndarray
    deviations: np.ndarray | None
    inside: bool | None

    def words(self, names: Sequence[Range]) -> str:
        """For a person."""
        lines = [place_in_words(self.inputs, names)]
        width = max(len(one.name) for one in self.outputs)
        sure = [None] * len(self.values) if self.deviations is None else self.deviations
        for one, value, deviation in zip(self.outputs, self.values, sure, strict=True):
            spread = "" if deviation is None or math.isnan(deviation) else f" ± {deviation:.2g}"
            lines.append(f"  {one.name:{width}}  {value:.6g}{spread} {one.unit}".rstrip())
        return "\n".join([*lines, f"  trust: {within_in_words(self.inputs, names, inside=self.inside)}"])

    def as_dict(self, names: Sequence[Range]) -> dict[str, Any]:
        """For a program; `beyond` are the inputs out of range."""
        return {
            "inputs": self.inputs.tolist(),
            "outputs": {one.name: float(v) for one, v in zip(self.outputs, self.values, strict=True)},
            "deviations": None if self.deviations is None else self.deviations.tolist(),
            "inside": self.inside,
            "beyond": beyond(self.inputs, names),
        }


def predicted(network: Network | Fitted, X: np.ndarray) -> list[Prediction]:
    """Answers at places (N, n)."""
    if isinstance(network, Network):
        return [
            Prediction(x, network.outputs, y, None, None) for x, y in zip(X, network.predict(X), strict=True)
        ]
    outputs = network.network.outputs
    Y, spread = (np.reshape(a, (len(X), -1)) for a in (network.predict(X), network.deviation(X)))
    trusted = network.trusted(X)
    spread = np.where(outside(X, network.network.inputs).any(axis=1, keepdims=True), math.nan, spread)
    return [Prediction(x, outputs, y, d, bool(i)) for x, y, d, i in zip(X, Y, spread, trusted, strict=True)]
