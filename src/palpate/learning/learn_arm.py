"""The torque on a tool of fixed orientation, learnt from solves as the torque per newton of force, in m."""

from __future__ import annotations

import numpy as np

from palpate.dataset import Dataset
from palpate.learning.arrays.fit import fit
from palpate.learning.arrays.fitted import Fitted
from palpate.options import FitOptions
from palpate.units import Quantity, Range

__all__ = ["ARM_OUTPUTS", "learn_arm"]

ARM_OUTPUTS = tuple(Quantity(f"arm_{axis}", "m") for axis in "xyz")
FAINT = 0.01  # of the largest force: below it an arm is mostly the mesh's error
FEWEST = 20  # solves that a fit takes
CLEAN = 1e-6  # of the largest arm: a component that is smaller everywhere is zero by symmetry


def learn_arm(
    data: Dataset,
    inputs: tuple[Range, ...],
    options: FitOptions,
    *,
    matrices: np.ndarray | None = None,
    about: np.ndarray | None = None,
) -> Fitted | None:
    """Return the arm learnt from converged solves; None where they tell no torque or are too few.

    `inputs` are those of the energy beside which it is learnt, `matrices` (k, 3, 3) the symmetry of body and tool, the
    identity among it, and `about` (3,) the point that stays, m. An arm turns with the body; a mirror turns it round.
    Images count where no solve is: among solves they would let a network look better, left out, than it is.
    """
    if "torque" not in data:
        return None
    force, torque = data.response[:, :3], data["torque"]
    size = np.linalg.norm(force, axis=1)
    rows = (size > FAINT * size.max(initial=0.0)) & np.isfinite(torque).all(axis=1)
    if rows.sum() < FEWEST:
        return None
    arm = torque[rows] / size[rows, None]
    largest = np.abs(arm).max(axis=0)
    arm[:, largest <= CLEAN * largest.max()] = 0.0
    if not np.ptp(arm, axis=0).any():
        return None
    X = data.X[rows]
    if matrices is not None and len(matrices) > 1:
        point = np.zeros(3) if about is None else about
        images = [((X[:, :3] - point) @ M.T + point, np.linalg.det(M) * arm @ M.T) for M in matrices]
        places, turned = (np.vstack(parts) for parts in zip(*images, strict=True))
        low, high = X[:, :3].min(axis=0), X[:, :3].max(axis=0)
        new = ((places < low) | (places > high)).any(axis=1)
        X = np.vstack([X, np.hstack([places, np.tile(X[:, 3:], (len(matrices), 1))])[new]])
        arm = np.vstack([arm, turned[new]])
    return fit(X, arm, list(inputs), list(ARM_OUTPUTS), options=options)
