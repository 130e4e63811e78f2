"""Fields of a symmetric body at mirror images of the solved places: u(M c)(M X) = M u(c)(X); numbers stay the same."""

from __future__ import annotations

import numpy as np

from palpate.learning.bodies.touches import Touches
from palpate.learning.fields import Snapshots, lumped_mass

__all__ = ["snapshots_of"]

# shapes to learn a field from. A dome has 16 images of each solve: of 80, 400 shapes leave the largest error of unseen
# ones at 0.35 mm, 800 at 0.20 and all at 0.17, learnt in 1, 1½ and 3 minutes
MOST = 800


def snapshots_of(
    touches: Touches, field: str = "displacement", *, seed: int = 0, most: int = MOST
) -> list[Snapshots]:
    """All solves as they are and their images, each on its own nodes; vectors turn with the body.

    Of too many images whole columns are drawn at random.
    """
    data, columns = touches.data, touches.columns
    nodes, own = np.unique(data.triangles, return_inverse=True)
    points, triangles = data.rest[nodes], own.reshape(-1, 3)
    mass = lumped_mass(points, triangles)
    solved = np.asarray(data[field])[:, nodes].reshape(len(data), len(nodes), -1)
    chosen = _chosen(columns, len(touches.matrices), most, seed)
    images = []
    for matrix, some in zip(touches.matrices, chosen, strict=True):
        rows = np.flatnonzero(np.isin(columns, some))
        if not rows.size:
            continue
        X, values = data.X[rows].copy(), solved[rows]
        X[:, :3] = touches.about + (X[:, :3] - touches.about) @ matrix.T
        values = values @ matrix.T if values.shape[2] == 3 else values
        places = touches.about + (points - touches.about) @ matrix.T
        # seen in a mirror, a triangle runs round the other way
        around = triangles if np.linalg.det(matrix) > 0 else triangles[:, ::-1]
        images.append(Snapshots(X, values, columns[rows], places, mass, around))
    return images


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
