"""Checks that interactions share: directions, ranges, and that a body can't float away."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import number
from palpate.physics.interactions.interaction import Attached

__all__ = [
    "AXES",
    "Interval",
    "along",
    "axis_of",
    "direction_of",
    "free_motions",
    "interval",
    "range_of",
    "require_support",
    "tag",
]

Interval = float | tuple[float, float]
"""A fixed value, or the two ends between which an input varies."""

AXES = ("x", "y", "z")
NOTHING = 1e-9  # share of the largest constraint or stiffness that counts as none
MOTIONS = (
    "moves along x",
    "moves along y",
    "moves along z",
    "turns about x",
    "turns about y",
    "turns about z",
)


def interval(what: str, value: Any, unit: str) -> Interval:
    """Return a finite number, or two finite numbers in ascending order: an empty range is refused."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        return checks.finite(what, value, unit)
    ends = tuple(value)
    if len(ends) != 2:
        raise UsageError(
            f"{what} is {value!r}.",
            why=f"It is either one number in {unit}, which stays, or two, between which it varies.",
            fix="Give a number, or (low, high).",
        )
    low, high = (checks.finite(what, end, unit) for end in ends)
    if low >= high:
        raise UsageError(
            f"The range of {what[0].lower()}{what[1:]} is empty: {low:g} … {high:g} {unit}.",
            why="A range needs two ends, the lower one first.",
            fix="Swap the ends, or give one number for a value that stays.",
        )
    return low, high


def range_of(what: str, value: Any, unit: str) -> tuple[float, float]:
    """Return the two ends of a range in ascending order; a single number is refused."""
    ends = interval(what, value, unit)
    if isinstance(ends, tuple):
        return ends
    raise UsageError(
        f"{what} is the single number {ends:g} {unit}.",
        why="An input needs a range.",
        fix=f"Give (low, high) in {unit}; what stays is `Fixed` with a value within its range.",
    )


def direction_of(what: str, value: Any) -> tuple[float, float, float]:
    """Return a direction as a unit vector; ``"x"``, ``"-z"`` and the like stand for axes."""
    if isinstance(value, str):
        axis, sign = axis_of(what, value)
        return (sign * (axis == 0) + 0.0, sign * (axis == 1) + 0.0, sign * (axis == 2) + 0.0)
    parts = tuple(value) if isinstance(value, Iterable) else (value,)
    if len(parts) != 3:
        raise UsageError(
            f"{what} is {value!r}.",
            why="A direction in space has three parts, along x, y and z.",
            fix='Give (x, y, z), or the name of an axis such as "-z".',
        )
    for part in parts:
        checks.finite(what, part)
    length = math.hypot(*parts)
    if not (math.isfinite(length) and length > 0):
        raise UsageError(
            f"{what} is {value!r}, without a length.",
            why="A direction needs a finite length above zero.",
            fix="Give (x, y, z), for example (0, 0, -1) for downwards.",
        )
    # adding zero turns -0.0 into 0.0, so that equal directions are written alike
    x, y, z = (part / length + 0.0 for part in parts)
    return x, y, z


def axis_of(what: str, value: str) -> tuple[int, float]:
    """Index and sign of an axis named ``"x"``, ``"+x"`` or ``"-x"``."""
    name, sign = value.strip().lower(), 1.0
    if name[:1] in {"+", "-"}:
        sign, name = (-1.0 if name[0] == "-" else 1.0), name[1:]
    if name not in AXES:
        raise UsageError(
            f"{what} is {value!r}.",
            why="Axes are x, y and z, with a sign if need be.",
            fix='Say "z" or "-z".',
        )
    return AXES.index(name), sign


def along(direction: tuple[float, float, float] | str) -> str:
    """A direction in words: the axis with its sign, else its parts."""
    if isinstance(direction, str):
        return direction
    size = max(map(abs, direction))
    axis = max(range(3), key=lambda i: abs(direction[i]))
    if size == 1.0:
        return ("-" if direction[axis] < 0 else "") + AXES[axis]
    return f"({', '.join(map(number, direction))})"


def tag(name: str, part: str) -> str:
    """Name of an input: that of its interaction, if it has one, and its own."""
    return f"{name} {part}" if name else part


def free_motions(field: Any, attached: Iterable[Attached]) -> np.ndarray:
    """Return the rigid motions of a body at rest that cost no energy.

    Parameters
    ----------
    field : Field
        Displacement of the body.
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
        if term.constrained is not None:
            given |= term.constrained
    loose = _null_space(motions[:, given].T)
    if not len(loose):
        return loose
    stiffness = loose @ _stiffness(field, terms, motions) @ loose.T
    return np.asarray(_null_space(stiffness) @ loose)


def require_support(field: Any, attached: Iterable[Attached]) -> None:
    """Refuse a body that could float away.

    Raises
    ------
    UsageError
        If a rigid motion of the body is free.
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
    """Return the unknowns of the six unit motions, shape (6, dof)."""
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
    """Return orthonormal rows spanning the null space of a matrix (k, n), shape (m, n)."""
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
    """Return the second derivative of the interactions' energies along the motions, at rest, shape (6, 6)."""
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
