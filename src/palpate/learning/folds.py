"""The splitting of samples into those to learn from and those to judge by; what belongs together stays together."""

from __future__ import annotations

import numpy as np

__all__ = ["fold_masks", "fold_numbers", "held_out", "near_places"]

_NEIGHBOURS = (
    10  # the distance to the tenth tells how far places are apart, whatever copies there are of each
)
_NEAR = (
    0.05  # of that distance: copies of one place, such as a stand's returns or a star of finite differences
)
_ASKED = 1000  # samples that tell the typical distance
_TREE_INPUTS = 6  # up to which trees are fast
_DISTANCES = 4_000_000  # in one block: 32 MB


def near_places(X: np.ndarray) -> np.ndarray:
    """Return the number (N,) of the place of each scaled sample X (N, n); copies, exact or nearly, are at one place.

    Samples are nearly copies where they are twenty times nearer to each other than a tenth neighbour typically is.
    """
    exact, own = np.unique(X, axis=0, return_inverse=True)
    neighbours = min(_NEIGHBOURS, len(exact) // 4)
    if neighbours < 1:
        return np.asarray(own.ravel())
    count = _ASKED if X.shape[1] <= _TREE_INPUTS else _ASKED // 4
    some = exact[np.linspace(0, len(exact) - 1, min(len(exact), count)).astype(int)]
    reach = _NEAR * float(np.median(_neighbour_distances(exact, some, neighbours)))
    if reach <= 0.0:
        return np.asarray(own.ravel())
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    # what is in one cell is near: so pairs are sought among cells, however many copies a place has
    cells = np.floor(exact * (np.sqrt(exact.shape[1]) / reach))
    _, first, cell = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    pairs = _pairs_within(exact[first], reach)
    ones = np.ones(len(pairs), dtype=bool)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(first), len(first)))
    return np.asarray(connected_components(graph, directed=False)[1][cell.ravel()][own.ravel()])


def _neighbour_distances(X: np.ndarray, some: np.ndarray, k: int) -> np.ndarray:
    """Return the distance of each of some samples (S, n) of X (N, n) to its k-th neighbour."""
    if X.shape[1] <= _TREE_INPUTS:
        from scipy.spatial import KDTree

        return np.asarray(KDTree(X).query(some, k + 1)[0])[:, -1]
    squares = (X * X).sum(axis=1)
    step = max(1, _DISTANCES // len(X))
    parts = [
        np.partition(squares - 2.0 * Z @ X.T, k, axis=1)[:, k] + (Z * Z).sum(axis=1)
        for Z in (some[i : i + step] for i in range(0, len(some), step))
    ]
    return np.asarray(np.sqrt(np.maximum(np.concatenate(parts), 0.0)))


def _pairs_within(X: np.ndarray, reach: float) -> np.ndarray:
    """Return the pairs (P, 2) of samples of X (N, n) that are no farther apart.

    Of many inputs pairs are sought along the six directions in which samples differ most, and then looked at in all.
    """
    from scipy.spatial import KDTree

    if X.shape[1] <= _TREE_INPUTS:
        return np.asarray(KDTree(X).query_pairs(reach, output_type="ndarray"))
    axes = np.linalg.eigh(np.cov(X.T))[1][:, -_TREE_INPUTS:]
    pairs = KDTree(X @ axes).query_pairs(reach * (1.0 + 1e-9), output_type="ndarray")
    apart = ((X[pairs[:, 0]] - X[pairs[:, 1]]) ** 2).sum(axis=1)
    return np.asarray(pairs[apart <= reach * reach])


def fold_numbers(groups: np.ndarray, folds: int, *, seed: int = 0) -> np.ndarray:
    """Return the fold (N,) of each sample, 0 to `folds` − 1 at most.

    Samples of one of the groups (N,), such as the depths over one place, are in one fold; with fewer groups than folds
    each group is a fold. One seed deals for all networks: they are compared over the same folds.
    """
    _, own = np.unique(groups, return_inverse=True)
    order = np.random.default_rng(seed).permutation(int(own.max()) + 1)
    return np.asarray(order[own.ravel()] % folds)


def fold_masks(groups: np.ndarray, folds: int, *, seed: int = 0) -> list[np.ndarray]:
    """Return for each fold the mask (N,) of its samples; see `fold_numbers`."""
    fold = fold_numbers(groups, folds, seed=seed)
    return [fold == k for k in range(int(fold.max()) + 1)]


def held_out(places: np.ndarray, share: float, *, seed: int, fold: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Split samples in two: indices (N,) to learn from, in a random order, and a mask of those to judge by.

    Samples at one of the `places` (N,) stay together, as far as two parts can be made: a copy of what was learnt judges
    nothing. Held out is the `fold`-th share of the shuffled places; folds beyond the last begin again.
    """
    order = np.random.default_rng(seed).permutation(len(places))
    shuffled = places[order]
    dealt = shuffled[np.sort(np.unique(shuffled, return_index=True)[1])]
    count = max(1 if len(dealt) < len(places) else 2, round(share * len(dealt)))
    first = (fold * count) % max(1, len(dealt) - count + 1)
    held = np.isin(places, dealt[first : first + count])
    return order[~held[order]], held
