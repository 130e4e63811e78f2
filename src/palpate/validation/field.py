"""Errors of the whole deflected shape: what the eye sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.surrogates import TouchModel
from palpate.validation.region import Worst

__all__ = ["FieldErrors", "field_errors", "predicted_field"]


@dataclass(frozen=True)
class FieldErrors:
    """Distances of all mesh nodes from where finite elements put them.

    Attributes
    ----------
    units : int
        Units of the network.
    nodes : int
        Mesh nodes.
    mean, max : float
        m.
    reach : float
        Largest displacement of the held node in training, m.
    relative_mean, relative_max : float
        Over the reach.
    worst : Worst
    """

    units: int
    nodes: int
    mean: float
    max: float
    reach: float
    relative_mean: float
    relative_max: float
    worst: Worst


def predicted_field(touch: TouchModel, X: np.ndarray) -> np.ndarray:
    """Displacement (N, nodes, 2) of the mesh nodes under loads X (N, n), m."""
    return touch.networks["field"].predict(X).reshape(len(X), -1, 2)


def field_errors(touch: TouchModel, test: Dataset) -> FieldErrors:
    """Errors of the shape on unseen solves."""
    error = np.linalg.norm(predicted_field(touch, test.X) - test.displacement[:, :, :2], axis=2)
    sample, node = (int(i) for i in np.unravel_index(np.argmax(error), error.shape))
    mean, largest = float(error.mean()), float(error.max())
    return FieldErrors(
        units=touch.networks["field"].units,
        nodes=error.shape[1],
        mean=mean,
        max=largest,
        reach=touch.reach,
        relative_mean=mean / touch.reach,
        relative_max=largest / touch.reach,
        worst=Worst.of(largest, test.X[sample], test.ranges, f"the node at {test.rest[node, 0]:g} m"),
    )
