"""The coefficients by a unit at every solve, all with one metric: where many small shapes follow the place, it wins.

Scales and ridge are those of the largest likelihood (`choosing.kernel_layer`), the radial function is chosen by what is
missed of groups of solves left out, as for the small networks of `search`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from palpate.learning.choosing.kernel_layer import KernelLayer, Metric, likely_metric
from palpate.learning.fields.search import Coefficients, FieldTrial, parts_of
from palpate.network import Network, Scaling
from palpate.network.radial import RadialFunction
from palpate.units import Quantity, Range

__all__ = ["AtSolves", "at_solves"]

_RADIALS: tuple[RadialFunction, ...] = ("matern-5/2", "inverse-multiquadric", "gaussian")


@dataclass(frozen=True, eq=False)
class AtSolves:
    """A fitted layer, and its left-out error in the field's unit.

    Attributes
    ----------
    layer : KernelLayer
        Of scaled inputs and b over its scale.
    error : float
        Root mean square over surface and solves of what is missed of groups left out; infinite for one group.
    trials : tuple of FieldTrial
    """

    layer: KernelLayer
    error: float
    trials: tuple[FieldTrial, ...]

    def network(self, inputs: tuple[Range, ...], names: list[Quantity], scaling: Scaling) -> Network:
        """The same as a network value; its tail and scaling are in scaled inputs."""
        factors, shifts = self.layer.units()
        return Network(
            inputs,
            tuple(names),
            factors,
            shifts,
            self.layer.weights.T,
            self.layer.tail.T,
            scaling,
            radial=self.layer.metric.radial,
        )


def at_solves(problem: Coefficients, *, radials: tuple[RadialFunction, ...] = _RADIALS) -> AtSolves:
    """The layer of the radial function that misses least of solves left out."""
    b = problem.along / problem.rise[:, None] / problem.scale
    found: list[tuple[float, Metric]] = []
    trials: list[FieldTrial] = []
    for name in radials:
        begun = time.monotonic()
        metric = likely_metric(name, problem.X, b)
        error = _left_out(problem, metric, b)
        found.append((error, metric))
        trials.append(FieldTrial("at solves", name, len(b), error, time.monotonic() - begun))
    error, metric = min(found, key=lambda one: one[0])
    return AtSolves(KernelLayer.fit(metric, problem.X, b), error, tuple(trials))


def _left_out(problem: Coefficients, metric: Metric, b: np.ndarray) -> float:
    total, parts = 0.0, parts_of(problem.groups)
    if len(parts) < 2:
        return float("inf")
    for out in parts:
        answered = KernelLayer.fit(metric, problem.X[~out], b[~out]).predict(problem.X[out])
        answered *= (problem.scale * problem.rise[out])[:, None]
        total += float(((answered - problem.along[out]) ** 2).sum())
    return float(np.sqrt(total / len(b)))
