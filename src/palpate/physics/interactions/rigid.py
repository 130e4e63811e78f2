"""Whether a body is held: which of its six rigid motions nothing resists."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.interaction import Attached

__all__ = ["free_motions", "require_held"]

NOTHING = 1e-9  # share of the largest constraint or stiffness that counts as none
MOTIONS = (
    "moves along x",
    "moves along y",
    "moves along z",
    "turns about x",
    "turns about y",
    "turns about z",
)


def free_motions(field: Any, attached: Iterable[Attached]) -> np.ndarray:
    """Rigid motions of a body at rest that cost no energy.

    Parameters
    ----------
    field : Field
    attached : iterable of Attached
        Interactions at work. The stiffness of those counts that leave the body alone where all inputs are zero, as
        a glued pad does; a sphere holds nothing before it touches.

    Returns
    -------
    (m, 6) array
        Orthonormal combinations of unit translations along and rotations about x, y, z through the body's middle;
        a rotation is scaled so that it moves the corners of the body about as far.
    """
    terms = list(attached)
    motions = _rigid(field)
    given = ~np.fromiter(field.space.FreeDofs(), dtype=bool, count=field.size)
    given[3 * (field.base.space.ndof // 3) :] = False
    for term in terms:
        if term.held is not None:
            given |= term.held
    loose = _null_space(motions[:, given].T)
    if not len(loose):
        return loose
    stiffness = loose @ _stiffness(field, terms, motions) @ loose.T
    return np.asarray(_null_space(stiffness) @ loose)


def require_held(field: Any, attached: Iterable[Attached]) -> None:
    """Refuse a body that could float away.

    Raises
    ------
    UsageError
        Naming the motions that nothing resists.
    """
    loose = free_motions(field, attached)
    if not len(loose):
        return
    share = np.linalg.norm(loose, axis=0)
    words = [word for word, part in zip(MOTIONS, share, strict=True) if part > 0.5]
    raise UsageError(
        f"The body is not held: it {', '.join(words) or 'moves and turns'} freely.",
        why=f"Nothing resists {len(loose)} of its six rigid motions, so its equilibrium is not unique.",
        fix="Fix a surface (fixed='bottom'), hold one with a prescribed displacement, or glue a pad to it; a sphere "
        "that has not touched yet, and forces, hold nothing.",
    )


def _rigid(field: Any) -> np.ndarray:
    """Unknowns of the six unit motions, shape (6, dof)."""
    import ngsolve as ng

    low, high = field.rest.corners
    middle, scale = (low + high) / 2, 2 / float(np.linalg.norm(high - low))
    place = [scale * (axis - value) for axis, value in zip((ng.x, ng.y, ng.z), middle.tolist(), strict=True)]
    motions = [tuple(float(i == j) for j in range(3)) for i in range(3)]
    zero = ng.CF(0.0)
    motions += [
        (zero, -place[2], place[1]),
        (place[2], zero, -place[0]),
        (-place[1], place[0], zero),
    ]
    return np.array([field.interpolate(ng.CF(motion)) for motion in motions])


def _null_space(rows: np.ndarray) -> np.ndarray:
    """Orthonormal rows spanning what the matrix (k, n) maps to nothing, shape (m, n)."""
    if not rows.size:
        return np.eye(rows.shape[1])
    # by way of R, since the full left factor of many rows would fill the memory
    _, values, right = np.linalg.svd(np.linalg.qr(rows, mode="r"))
    rank = int((values > NOTHING * max(values[0], np.finfo(float).tiny)).sum())
    return np.asarray(right[rank:])


def _idle_at_zero(term: Attached) -> bool:
    zero = np.zeros(len(term.parameters))
    start = term.approach(zero)
    return start is not None and not start.any()


def _stiffness(field: Any, attached: list[Attached], motions: np.ndarray) -> np.ndarray:
    """Second derivative of the interactions' energies along the motions, at rest, shape (6, 6)."""
    import ngsolve as ng

    energies = [energy for term in attached if _idle_at_zero(term) for energy in term.energies]
    if not energies:
        return np.zeros((6, 6))
    form = ng.BilinearForm(field.space, symmetric=True)
    for energy in energies:
        form += ng.Variation(energy.density * energy.measure)
    state = ng.GridFunction(field.space).vec
    form.AssembleLinearization(state)
    given, image = state.CreateVector(), state.CreateVector()
    products = []
    for motion in motions:
        given.FV().NumPy()[:] = motion
        image.data = form.mat * given
        products.append(motions @ image.FV().NumPy())
    return np.array(products)
