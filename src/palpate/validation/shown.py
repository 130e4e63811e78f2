"""Errors of the shape that is shown of a touched body: distances of its nodes from where finite elements put them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.surrogates import FieldSurrogate
from palpate.validation.region import Worst

__all__ = ["ShownErrors", "shown_errors"]


@dataclass(frozen=True)
class ShownErrors:
    """Distances of all nodes of the solves' surface, over all solves.

    Attributes
    ----------
    mean, max : float
        m.
    largest : float
        Largest displacement of the solves, m.
    worst : Worst
    """

    mean: float
    max: float
    largest: float
    worst: Worst


def shown_errors(field: FieldSurrogate, test: Dataset) -> ShownErrors:
    """Of a displacement field on the converged rows of unseen solves.

    The field's mesh may be another than the solves': it is asked at their nodes.
    """
    test = test.ok
    nodes, own = np.unique(test.triangles, return_inverse=True)
    points = test.rest[nodes]
    shown = field.values_at(test.X, points, own.reshape(-1, 3))
    error = np.linalg.norm(shown - test.displacement[:, nodes], axis=2)
    sample, node = (int(i) for i in np.unravel_index(np.argmax(error), error.shape))
    place = "the node at " + ", ".join(f"{1e3 * x:.3g}" for x in points[node]) + " mm"
    return ShownErrors(
        float(error.mean()),
        float(error.max()),
        float(np.linalg.norm(test.displacement[:, nodes], axis=2).max()),
        Worst.of(float(error.max()), test.X[sample], test.ranges, place),
    )
