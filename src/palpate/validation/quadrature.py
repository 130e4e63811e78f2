"""Work of a force around closed polygons, by a quadrature that goes on until it has converged.

The integrand F·(b − a) along an edge is smooth in pieces: it begins at first touch and bends where training ends. An
interval is halved while its 8-point Gauss–Lobatto rule and those of its halves disagree, so only the places where it
bends are resolved finely. Lobatto's rule has points at both ends, so that a bend near an end isn't passed over.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

__all__ = ["Work", "work_of_polygons"]

ORDER = 8
FIRST = 32  # intervals of an edge to begin with: a touch shorter than that may be passed over
LEVELS = 24  # halvings at most: an interval of an edge of 10 mm is then 10 picometres
TOLERANCE = 1e-13  # disagreement that an interval may keep, over the energy of its loop


@dataclass(frozen=True, eq=False)
class Work:
    """Of each polygon: net work ∮F·dx, energy given on the way ½∮|F·dx|, and what the quadrature left open, all J."""

    net: np.ndarray
    energy: np.ndarray
    open: np.ndarray


def work_of_polygons(
    force: Callable[[np.ndarray], np.ndarray], corners: list[np.ndarray], most: int = 40_000
) -> Work:
    """Integrate around every polygon.

    Parameters
    ----------
    force : callable (M, n) → (M, 3)
    corners : list of (c, n)
        Inputs at the corners, m; the last leads back to the first. Inputs beyond the third must not change.
    most : int
        Intervals halved at a time, at most; the others are left open.
    """
    begin, end = np.concatenate(corners), np.concatenate([np.roll(c, -1, axis=0) for c in corners])
    loop = np.repeat(np.arange(len(corners)), [len(c) for c in corners])
    edge = np.repeat(np.arange(len(begin)), FIRST)
    low, width = np.tile(np.arange(FIRST) / FIRST, len(begin)), np.full(len(edge), 1.0 / FIRST)

    def rule(edge: np.ndarray, low: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _rule(force, begin[edge], end[edge], low, width)

    value, size = rule(edge, low, width)
    net, energy, left = (np.zeros(len(corners)) for _ in range(3))
    for _ in range(LEVELS):
        scale = energy + np.bincount(loop[edge], size, len(corners))
        halves = (np.repeat(edge, 2), _halves(low, width), np.repeat(width / 2, 2))
        fine, fine_size = rule(*halves)
        apart = np.abs(fine.reshape(-1, 2).sum(axis=1) - value)
        done = apart <= TOLERANCE * scale[loop[edge]]
        if (~done).sum() > most:
            done |= apart < np.partition(apart, -most)[-most]
            left += np.bincount(loop[edge], np.where(done, apart, 0.0), len(corners))
        both = np.repeat(done, 2)
        of = loop[halves[0][both]]
        net += np.bincount(of, fine[both], len(corners))
        energy += np.bincount(of, fine_size[both], len(corners))
        edge, low, width = (part[~both] for part in halves)
        value, size = fine[~both], fine_size[~both]
        if not len(edge):
            break
    of = loop[edge]
    net, energy = net + np.bincount(of, value, len(corners)), energy + np.bincount(of, size, len(corners))
    return Work(net, energy / 2, left + np.bincount(of, size, len(corners)))


def _halves(low: np.ndarray, width: np.ndarray) -> np.ndarray:
    return np.stack([low, low + width / 2], axis=1).ravel()


def _rule(
    force: Callable[[np.ndarray], np.ndarray],
    begin: np.ndarray,
    end: np.ndarray,
    low: np.ndarray,
    width: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """∫F·dx and ∫|F·dx| over pieces (M,) of edges from begin to end (M, n)."""
    x, w = _lobatto()
    t = low[:, None] + width[:, None] * (x + 1) / 2
    X = begin[:, None] + t[:, :, None] * (end - begin)[:, None]
    F = force(np.ascontiguousarray(X.reshape(-1, X.shape[2]))).reshape(len(t), ORDER, 3)
    power = np.einsum("mqi,mi->mq", F, (end - begin)[:, :3]) * w / 2 * width[:, None]
    return power.sum(axis=1), np.abs(power).sum(axis=1)


@functools.cache
def _lobatto() -> tuple[np.ndarray, np.ndarray]:
    """Points in [−1, 1] and weights: the ends and the roots of P'₇, 2/(n (n − 1) P₇²) (Abramowitz & Stegun 25.4.32)."""
    last = np.polynomial.legendre.Legendre.basis(ORDER - 1)
    x = np.concatenate([[-1.0], np.sort(last.deriv().roots().real), [1.0]])
    return x, 2.0 / (ORDER * (ORDER - 1) * last(x) ** 2)
