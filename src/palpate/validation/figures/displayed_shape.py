"""Errors of the displayed shape: distances of its nodes from where finite elements put them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.surrogates import FieldSurrogate
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject
from palpate.validation.worst import Worst

__all__ = ["ShapeErrors", "displayed_shape", "shape_errors"]


@dataclass(frozen=True)
class ShapeErrors(Figure):
    """Distances of all nodes of the solves' surface, over all solves."""

    mean: float  # m
    max: float  # m
    largest: float  # largest displacement of the solves, m
    worst: Worst  # node and solve with the largest distance

    def measured(self) -> Measured:
        """Return the values that are compared with limits."""
        return {"displacement_mean": (self.mean, None), "displacement_max": (self.max, self.worst)}

    @classmethod
    def of(
        cls, shown: np.ndarray, solved: np.ndarray, test: Dataset, names: Callable[[int], str]
    ) -> ShapeErrors:
        """Compare displacements (N, nodes, axes) that are shown and solved, in m; `names` tells a node in words."""
        error = np.linalg.norm(shown - solved, axis=2)
        sample, node = (int(i) for i in np.unravel_index(np.argmax(error), error.shape))
        worst = Worst.of(float(error.max()), test.X[sample], test.ranges, names(node))
        largest = float(np.linalg.norm(solved, axis=2).max())
        return cls(float(error.mean()), float(error.max()), largest, worst)


def displayed_shape(subject: Subject) -> ShapeErrors | str | None:
    """Return the errors of the displayed shape, or the reason why there are none."""
    if subject.function is None:
        return None
    if subject.field is None:
        return "Displacement is not judged: the model answers none."
    if subject.data is None:
        return "Displacement is not judged: the solves are given without theirs."
    return shape_errors(subject.field, subject.data)


def shape_errors(field: FieldSurrogate, test: Dataset) -> ShapeErrors:
    """Return the errors of a displacement field on the converged rows of unseen solves.

    The field's mesh may be another than the solves': it is asked at their nodes.
    """
    test = test.ok
    nodes, own = np.unique(test.triangles, return_inverse=True)
    points = test.rest[nodes]
    shown = field.values_at(test.X, points, own.reshape(-1, 3))

    def name(node: int) -> str:
        return "the node at " + ", ".join(f"{1e3 * x:.3g}" for x in points[node]) + " mm"

    return ShapeErrors.of(shown, test.displacement[:, nodes], test, name)
