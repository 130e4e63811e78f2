"""Errors of a network's outputs on samples that it has never seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.network import Network
from palpate.validation.region import Worst, outer_part

__all__ = ["OutputError", "OutputErrors", "output_errors"]


@dataclass(frozen=True)
class OutputError:
    """One output: its name, root mean square error and largest error, in the output's unit."""

    name: str
    rmse: float
    max: float


@dataclass(frozen=True)
class OutputErrors:
    """Errors over N samples of m outputs that share a unit.

    Attributes
    ----------
    units : int
        Units of the network.
    full_scale : float
        Largest magnitude of any output in the test set: for a beam the largest tip deflection, m.
    rmse, max : float
        Over all outputs, in their unit.
    relative, relative_max : float
        The same over full scale.
    per_output : tuple of OutputError
    outer_count : int
        Samples with any input within 5 % of an end of its range.
    outer, rest : float or None
        RMSE there and elsewhere; None without samples.
    outer_ratio : float or None
        outer / rest.
    worst : Worst
        Where the largest error is.
    """

    units: int
    full_scale: float
    rmse: float
    max: float
    relative: float
    relative_max: float
    per_output: tuple[OutputError, ...]
    outer_count: int
    outer: float | None
    rest: float | None
    outer_ratio: float | None
    worst: Worst


def output_errors(network: Network, X: np.ndarray, truth: np.ndarray) -> OutputErrors:
    """Errors of a network at X (N, n) against truth (N, m).

    Raises
    ------
    UsageError
        If every output is zero, so that there is no scale to judge by.
    """
    full = float(np.abs(truth).max())
    if not full > 0:
        raise UsageError(
            "In the test set nothing moves, so errors have no scale.",
            fix="Test under loads that bend the body.",
        )
    error = network.predict(X) - truth
    sample, output = (int(i) for i in np.unravel_index(np.argmax(np.abs(error)), error.shape))
    outside = outer_part(X, network.inputs)
    outer, rest = _rms(error[outside]), _rms(error[~outside])
    rmse, largest = float(_rms(error) or 0.0), float(np.abs(error).max())
    return OutputErrors(
        units=network.units,
        full_scale=full,
        rmse=rmse,
        max=largest,
        relative=rmse / full,
        relative_max=largest / full,
        per_output=tuple(
            OutputError(q.name, float(_rms(e) or 0.0), float(np.abs(e).max()))
            for q, e in zip(network.outputs, error.T, strict=True)
        ),
        outer_count=int(outside.sum()),
        outer=outer,
        rest=rest,
        outer_ratio=outer / rest if outer is not None and rest else None,
        worst=Worst.of(error[sample, output], X[sample], network.inputs, network.outputs[output].name),
    )


def _rms(error: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(error**2))) if error.size else None
