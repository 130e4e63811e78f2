"""Parting the samples of a sweep into chunks of neighbours, which share a solver and its warm start."""

from __future__ import annotations

import numpy as np

__all__ = ["chunks"]

LARGEST, SMALLEST = 32, 4


def chunks(unit: np.ndarray, rest: np.ndarray) -> list[np.ndarray]:
    """Row indices in chunks, each in an order that makes warm starts pay.

    The points are halved across their widest side until a chunk is small (a k-d tree); within a chunk the
    order goes from the point next to `rest` to its nearest neighbour and so on. The chunks depend on the
    points alone, not on the number of workers: the same sweep gives the same bits with any number of them.

    Parameters
    ----------
    unit : (N, n) array
        Points, scaled to [0, 1].
    rest : (n,) array
        The point without load, on the same scale.

    Returns
    -------
    list of int arrays
    """
    # some eight chunks at least, to keep the workers busy to the end
    largest = int(np.clip(len(unit) // 8, SMALLEST, LARGEST))
    pending, done = [np.arange(len(unit))], []
    while pending:
        rows = pending.pop()
        if rows.size > largest:
            axis = int(np.argmax(np.ptp(unit[rows], axis=0)))
            ranked = rows[np.argsort(unit[rows, axis], kind="stable")]
            # pushed in reverse, so that the list comes out in ascending order
            pending += [ranked[rows.size // 2 :], ranked[: rows.size // 2]]
        elif rows.size:
            done.append(_neighbours(unit, rows, rest))
    return done


def _neighbours(unit: np.ndarray, rows: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Order rows by going to the nearest one left, from the one next to `rest`."""
    left, here, order = list(rows), rest, []
    while left:
        nearest = int(np.argmin(((unit[left] - here) ** 2).sum(axis=1)))
        order.append(left.pop(nearest))
        here = unit[order[-1]]
    return np.array(order)
