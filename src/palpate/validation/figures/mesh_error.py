"""The mesh's own error apart from the model's: the same touches solved with half the element size.

The force on a mesh of size h errs as C hᵖ, and differs from that on h/2 by C hᵖ (1 − 2⁻ᵖ). With p = 2, the least that
quadratic elements have at the edge of a contact, the whole error is 4/3 of the difference (Richardson 1911).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.format import count, share
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.figures.force import quantile
from palpate.validation.subject import Subject
from palpate.validation.unseen_solves import TouchFunction, TouchSolves
from palpate.validation.worst import Worst

__all__ = ["MeshErrors", "mesh_error", "mesh_errors", "own_errors", "part_of_mesh"]

ASKED = 20
"""Positions from which the mesh's error may be told (the figures above are claimed for both errors together)."""

WHOLE = 4 / 3
"""The whole error of a mesh over its difference from one twice as fine, 1/(1 − 2⁻²)."""

NORMAL = 1.645  # 95th percentile of a normal distribution over its deviation
SAME = 1e-9  # share of a range, within which inputs are those of the same solve


@dataclass(frozen=True)
class MeshErrors(Figure):
    """Relative errors of the force above f₀ against refined solves."""

    count: int  # refined solves above f₀
    together_median: float  # of the model: its own error and the mesh's, as the next
    together_p95: float
    paired: int  # how many of them were also solved on the ordinary mesh
    mesh_median: float | None  # of the ordinary mesh alone, as the next
    mesh_p95: float | None
    worst: Worst  # of both together
    part: float | None = None  # of the mesh in the force error, see `part_of_mesh`

    def measured(self) -> Measured:
        """Return the values that are compared with limits."""
        return {
            "mesh_force": (self.part, None),
            "refined_force_median": (self.together_median, self.worst),
            "refined_force_p95": (self.together_p95, self.worst),
        }

    def lines(self) -> list[str]:
        """Return the error of the mesh alone."""
        text = f"refined solves: {self.count} above f₀"
        if self.mesh_median is None or self.mesh_p95 is None:
            return [f"{text}, none of them solved on the ordinary mesh too"]
        alone = (
            f"{share(self.mesh_median)} median, {share(self.mesh_p95)} p95 ({count(self.paired, 'place')})"
        )
        return [f"{text}; the mesh alone is off by {alone}"]

    def notes(self) -> list[str]:
        """Return a sentence where refined solves are few."""
        if self.count >= ASKED:
            return []
        return [
            f"Refined solves are few: {self.count} above f₀, where {ASKED} are asked. They give an estimate of the "
            "mesh's part, and no error of all places."
        ]


def mesh_error(subject: Subject) -> MeshErrors | str | None:
    """Return the error of the mesh, where refined solves were given."""
    if subject.function is None or subject.solves is None or subject.samples is None:
        return None
    if subject.refined is None:
        return "The mesh's own error is not in these figures: no refined solves were given."
    return mesh_errors(subject.function, subject.solves, subject.refined, subject.samples.light)


def mesh_errors(model: TouchFunction, test: TouchSolves, refined: TouchSolves, light: float) -> MeshErrors:
    """Compare with refined solves above the light force f₀, N.

    Rows of `test` (ordinary mesh) and `refined` with the same inputs give the mesh's own error.
    """
    felt = np.linalg.norm(refined.force, axis=1) > light
    if not felt.any():
        raise UsageError(
            f"No refined solve has a force above f₀ = {light:.3g} N.", fix="Refine solves that press harder."
        )
    refined = refined.take(felt)
    size = np.linalg.norm(refined.force, axis=1)
    together = np.linalg.norm(model.force(refined.X) - refined.force, axis=1) / size
    mesh = own_errors(test, refined, np.array([r.high - r.low for r in model.inputs]))
    i = int(np.argmax(together))
    return MeshErrors(
        len(refined),
        float(np.median(together)),
        float(np.quantile(together, 0.95)),
        len(mesh),
        quantile(mesh, 0.5),
        quantile(mesh, 0.95),
        Worst.of(together[i], refined.X[i], model.inputs),
        part_of_mesh(mesh),
    )


def own_errors(test: TouchSolves, refined: TouchSolves, spans: np.ndarray) -> np.ndarray:
    """Return the relative differences (M,) of forces between rows of two meshes that have the same inputs.

    Inputs are the same within a share of their `spans` (n,).
    """
    apart = np.abs(refined.X[:, None] - test.X[None]) / spans
    other, own = np.nonzero((apart <= SAME).all(axis=2))
    size = np.linalg.norm(refined.force[other], axis=1)
    return np.asarray(np.linalg.norm(test.force[own] - refined.force[other], axis=1) / size)


def part_of_mesh(differences: np.ndarray) -> float | None:
    """Return the mesh's part in the relative force error, from differences (M,) to a mesh twice as fine; None of none.

    It is their 95th percentile. Of a few that is estimated as that of a normal distribution, mean + 1.645 deviations,
    and at least the largest of them: the largest of three alone is on average only their 75th percentile.
    """
    if len(differences) >= ASKED:
        return WHOLE * float(np.quantile(differences, 0.95))
    largest = quantile(differences, 1.0)
    if largest is None or len(differences) < 2:
        return None if largest is None else WHOLE * largest
    normal = float(differences.mean() + NORMAL * differences.std(ddof=1))
    return WHOLE * max(largest, normal)
