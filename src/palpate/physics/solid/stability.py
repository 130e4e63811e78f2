"""Whether a factorised tangent can be trusted, and whether the equilibrium it belongs to is stable."""

from __future__ import annotations

import numpy as np

from palpate.physics.solid.system import System

__all__ = ["is_accurate", "is_stable"]

STEPS = 6  # Lanczos steps: each costs a back-substitution
ACCURATE = 1e-6  # relative residual of a back-substitution


def is_accurate(system: System) -> bool:
    """Whether K K⁻¹ b = b for a vector b: elimination without pivoting can fail on a saddle point."""
    right = _start(system)
    error = (system.multiply(system.solve(right)) - right) * system.free
    return bool(np.linalg.norm(error) <= ACCURATE * np.linalg.norm(right))


def is_stable(system: System) -> bool:
    """Whether the tangent is positive definite on the displacements, as far as a few Lanczos steps can see.

    For loads on the displacements alone, the displacement part of K⁻¹ is S⁻¹ with the Schur complement S that
    the pressures leave, so mixed and displacement form are one case. Lanczos' method (1950) on S⁻¹ finds its
    outermost eigenvalues first: a slightly negative one of S is a very negative one of S⁻¹.
    """
    vectors = [_start(system)]
    vectors[0] /= np.linalg.norm(vectors[0])
    diagonal, off = [], []
    moving = system.field.moving
    for _ in range(STEPS):
        image = system.solve(vectors[-1]) * moving
        diagonal.append(float(image @ vectors[-1]))
        for vector in vectors:  # orthogonalised against all: rounding would bring back what was found
            image = image - (image @ vector) * vector
        length = float(np.linalg.norm(image))
        if length <= 1e-12 * abs(diagonal[0]):
            break
        off.append(length)
        vectors.append(image / length)
    size = len(diagonal)
    band = np.diag(diagonal) + np.diag(off[: size - 1], 1) + np.diag(off[: size - 1], -1)
    return bool(np.linalg.eigvalsh(band)[0] > 0)


def _start(system: System) -> np.ndarray:
    """The same vector each time, with a share of every mode."""
    values = np.random.default_rng(0).standard_normal(system.field.size)
    return np.asarray(values * system.free * system.field.moving)
