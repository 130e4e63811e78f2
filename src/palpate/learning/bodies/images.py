"""Fields of a symmetric body at mirror images of the solved places: u(M c)(M X) = M u(c)(X); numbers stay the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.learning.bodies.touches import Touches
from palpate.surrogates.field.carrying import Carrier, node_normals

__all__ = ["Shapes", "shapes_of"]

MOST = 400  # shapes to learn a field from; more images of one solve tell little that is new


@dataclass(frozen=True, eq=False)
class Shapes:
    """A field at a surface's nodes, images among them.

    Attributes
    ----------
    X : (N, n) array
    values : (N, P, 3) or (N, P, 1) array
        Of vectors, which turn with the body, or of numbers.
    groups : (N,) array of int
        Column of the solve that each comes from.
    """

    X: np.ndarray
    values: np.ndarray
    groups: np.ndarray


def shapes_of(touches: Touches, field: str = "displacement", *, seed: int = 0, most: int = MOST) -> Shapes:
    """All solves as they are and their images, of which whole columns are drawn at random if they are too many."""
    data, columns = touches.data, touches.columns
    nodes, own = np.unique(data.triangles, return_inverse=True)
    points, triangles = data.rest[nodes], own.reshape(-1, 3)
    solved = np.asarray(data[field])[:, nodes].reshape(len(data), len(nodes), -1)
    facing = node_normals(touches.points, touches.triangles)
    chosen = _chosen(columns, len(touches.matrices), most, seed)
    X, values, groups = [], [], []
    for matrix, some in zip(touches.matrices, chosen, strict=True):
        rows = np.flatnonzero(np.isin(columns, some))
        if not rows.size:
            continue
        places = touches.about + (touches.points - touches.about) @ matrix  # the images under its inverse
        carried = Carrier.of(points, triangles, places, facing @ matrix)(solved[rows])
        image = data.X[rows].copy()
        image[:, :3] = touches.about + (image[:, :3] - touches.about) @ matrix.T
        X.append(image)
        values.append(carried @ matrix.T if solved.shape[2] == 3 else carried)
        groups.append(columns[rows])
    return Shapes(np.concatenate(X), np.concatenate(values), np.concatenate(groups))


def _chosen(columns: np.ndarray, images: int, most: int, seed: int) -> list[np.ndarray]:
    """For each isometry the columns that are imaged: all, or so many at random that some `most` solves come out."""
    known = np.unique(columns)
    share = min(1.0, most / (images * len(columns)))
    if share == 1.0:
        return [known] * images
    random = np.random.default_rng(seed)
    pairs = random.permutation([(image, column) for image in range(images) for column in known])
    # each column at least once
    kept = pairs[: max(round(share * len(pairs)), 1)]
    missing = np.setdiff1d(known, kept[:, 1])
    kept = (
        np.concatenate([kept, [(int(random.integers(images)), column) for column in missing]])
        if missing.size
        else kept
    )
    return [np.unique(kept[kept[:, 0] == image, 1]) for image in range(images)]
