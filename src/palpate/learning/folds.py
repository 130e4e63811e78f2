"""The splitting of samples into those to learn from and those to judge by; what belongs together stays together."""

from __future__ import annotations

import numpy as np

__all__ = ["fold_masks", "fold_numbers", "held_out"]


def fold_numbers(groups: np.ndarray, folds: int, *, seed: int = 0) -> np.ndarray:
    """Return the fold (N,) of each sample, 0 to `folds` − 1 at most.

    Parameters
    ----------
    groups : (N,) array
        Samples of one group, such as the depths over one place, are in one fold. With fewer groups than folds each
        group is a fold.
    folds : int
        Largest number of folds; they hold as many groups as each other, but for one.
    seed : int
        Decides how groups are dealt out. One seed for all networks: they are compared over the same folds.
    """
    _, own = np.unique(groups, return_inverse=True)
    order = np.random.default_rng(seed).permutation(int(own.max()) + 1)
    return np.asarray(order[own.ravel()] % folds)


def fold_masks(groups: np.ndarray, folds: int) -> list[np.ndarray]:
    """Return for each fold the mask (N,) of its samples; see `fold_numbers`."""
    fold = fold_numbers(groups, folds)
    return [fold == k for k in range(int(fold.max()) + 1)]


def held_out(X: np.ndarray, share: float, *, seed: int, fold: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Split samples in two: indices (N,) to learn from, in a random order, and a mask of those to judge by.

    Samples at one place stay together, as far as two parts can be made: a copy of what was learnt judges nothing.

    Parameters
    ----------
    X : (N, n) array
        Inputs.
    share : float
        Of the places to judge by.
    seed : int
        Decides the shuffle.
    fold : int
        Number of the share of that shuffle; folds beyond the last begin again.
    """
    order = np.random.default_rng(seed).permutation(len(X))
    place = np.unique(X, axis=0, return_inverse=True)[1].ravel()
    copies = place.max() + 1 < len(X)
    if copies:
        shuffled = place[order]
        places = shuffled[np.sort(np.unique(shuffled, return_index=True)[1])]
    else:
        places, place = order, np.arange(len(X))
    count = max(1 if copies else 2, round(share * len(places)))
    first = (fold * count) % max(1, len(places) - count + 1)
    held = np.isin(place, places[first : first + count])
    return order[~held[order]], held
