"""Unloaded directions: the deformation of a specimen where it carries no stress, as the least energy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from palpate.physics.materials.tensors import Scalar, Tensor, gradient

__all__ = ["relaxed"]

ITERATIONS = 60
DIFFERENCE = 1e-5  # of the free components, for the tangent
ROUNDING = 1e-14  # of the stiffest direction: what is left of a sum of large terms
TOLERANCE = 1e-10  # of the last Newton step, whose square is the error left


def relaxed(
    energy: Callable[[Tensor], Scalar], F: np.ndarray, free: tuple[tuple[int, int], ...], small: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Minimise the energy of each state over the free components, by Newton steps that may only descend."""
    index = np.array([3 * i + j for i, j in free])
    F, done = F.copy(), np.zeros(len(F), dtype=bool)
    for _ in range(ITERATIONS):
        slope = gradient(energy, F).reshape(-1, 9)[:, index]
        tangent = _tangent(energy, F, index)
        step, stiffest = _descent(tangent, slope), np.abs(tangent).max(axis=(1, 2))
        move = np.zeros((len(F), 9))
        move[:, index] = step
        gain = np.einsum("ni,ni->n", step, slope)
        taken = _shorten(energy, F, move.reshape(F.shape), gain, ROUNDING * stiffest, small)
        F = F + taken[:, None, None] * move.reshape(F.shape)
        settled = np.abs(step).max(axis=1) < TOLERANCE
        balanced = np.abs(slope).max(axis=1) < ROUNDING * stiffest
        done = (taken > 0) & (settled | balanced)
        volume = _volume(F, small)
        # an energy without a minimum lets the body vanish or grow without bound
        lost = (taken == 0) | (volume < 1e-3) | (volume > 1e3)
        if (done | lost).all():
            break
    return F, done & ~lost


def _tangent(energy: Callable[[Tensor], Scalar], F: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Second derivatives with respect to the free components (n, free, free), good to 1e-9: enough for Newton steps."""
    move = DIFFERENCE * np.eye(9)[index].reshape(-1, 1, 3, 3)
    slopes = (gradient(energy, F + move) - gradient(energy, F - move)) / (2 * DIFFERENCE)
    tangent = np.moveaxis(slopes.reshape(len(index), len(F), 9)[..., index], 0, -1)
    symmetric: np.ndarray = (tangent + np.swapaxes(tangent, 1, 2)) / 2
    return symmetric


def _descent(tangent: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """The Newton step, with the tangent's negative curvatures turned round; NaN states stay where they are."""
    bad = ~(np.isfinite(tangent).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1))
    values, vectors = np.linalg.eigh(np.where(bad[:, None, None], np.eye(slope.shape[1]), tangent))
    least = 1e-12 * np.abs(values).max(axis=1, keepdims=True)
    along = np.einsum("nji,nj->ni", vectors, np.where(bad[:, None], 0.0, slope))
    step = -np.einsum("nij,nj->ni", vectors, along / np.maximum(np.abs(values), least))
    return np.where(bad[:, None], 1.0, step)  # a step that the energy, NaN there, refuses


def _shorten(
    energy: Callable[[Tensor], Scalar],
    F: np.ndarray,
    move: np.ndarray,
    slope: np.ndarray,
    rounding: np.ndarray,
    small: bool,
) -> np.ndarray:
    """The share of each step that lowers the energy, up to rounding, and keeps its volume; 0 where none does."""
    start = energy(F)
    rounding = rounding + 1e-12 * np.abs(start)
    share, found = np.ones(len(F)), np.zeros(len(F), dtype=bool)
    for _ in range(40):
        trial = F + share[:, None, None] * move
        value = energy(trial)
        found = (_volume(trial, small) > 0) & (value <= start + 1e-4 * share * slope + rounding)
        if found.all():
            break
        share = np.where(found, share, share / 2)
    return np.where(found, share, 0.0)


def _volume(F: np.ndarray, small: bool) -> np.ndarray:
    """Volume ratios (n,); a small-strain law has none that could vanish."""
    return np.ones(len(F)) if small else np.linalg.det(F)
