"""The mesh's own error apart from the model's: the same touches solved with half the element size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.validation.force import quantile
from palpate.validation.region import Worst
from palpate.validation.solves import TouchFunction, TouchSolves

__all__ = ["MeshErrors", "mesh_errors"]

ASKED = 20
"""Positions from which the mesh's error may be told (the figures above are claimed for both errors together)."""

SAME = 1e-9  # of a range: inputs of the same solve


@dataclass(frozen=True)
class MeshErrors:
    """Relative errors of the force above f₀ against refined solves.

    Attributes
    ----------
    count : int
        Refined solves above f₀.
    together_median, together_p95 : float
        Of the model: its own error and the mesh's.
    paired : int
        How many of them were also solved on the ordinary mesh.
    mesh_median, mesh_p95 : float or None
        Of the ordinary mesh alone.
    worst : Worst
        Of both together.
    """

    count: int
    together_median: float
    together_p95: float
    paired: int
    mesh_median: float | None
    mesh_p95: float | None
    worst: Worst


def mesh_errors(model: TouchFunction, test: TouchSolves, refined: TouchSolves, light: float) -> MeshErrors:
    """Compare with refined solves.

    Parameters
    ----------
    model : TouchFunction
    test, refined : TouchSolves
        Of the ordinary and of the refined mesh; rows of both with the same inputs give the mesh's own error.
    light : float
        f₀, N.

    Raises
    ------
    UsageError
        If no refined solve is above f₀.
    """
    felt = np.linalg.norm(refined.force, axis=1) > light
    if not felt.any():
        raise UsageError(
            f"No refined solve has a force above f₀ = {light:.3g} N.", fix="Refine solves that press harder."
        )
    refined = refined.take(felt)
    size = np.linalg.norm(refined.force, axis=1)
    together = np.linalg.norm(model.force(refined.X) - refined.force, axis=1) / size
    own, other = _pairs(test, refined, np.array([r.high - r.low for r in model.inputs]))
    mesh = np.linalg.norm(test.force[own] - refined.force[other], axis=1) / size[other]
    i = int(np.argmax(together))
    return MeshErrors(
        len(refined),
        float(np.median(together)),
        float(np.quantile(together, 0.95)),
        len(own),
        quantile(mesh, 0.5),
        quantile(mesh, 0.95),
        Worst.of(together[i], refined.X[i], model.inputs),
    )


def _pairs(test: TouchSolves, refined: TouchSolves, spans: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of either that have the same inputs."""
    apart = np.abs(refined.X[:, None] - test.X[None]) / spans
    other, own = np.nonzero((apart <= SAME).all(axis=2))
    return own, other
