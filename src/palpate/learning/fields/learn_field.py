"""From solves of a touched body to a field surrogate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.checks import numbers
from palpate.learning.fields.kernel import at_solves
from palpate.learning.fields.modes import lumped_mass
from palpate.learning.fields.parting import Parted, Solves, best_part
from palpate.learning.fields.search import FieldTrial, searched
from palpate.learning.freezing import freeze_refined, training_record
from palpate.network import Network, Scaling
from palpate.surrogates import FieldSurrogate, TouchedSurface
from palpate.surrogates.field.rise import RISES
from palpate.units import Quantity, Range, bounds

__all__ = ["LearntField", "learn_displacement", "learn_field"]

_TOLERANCE = 5e-3  # of the snapshots' root mean square


@dataclass(frozen=True, eq=False)
class LearntField:
    """A field surrogate, and how it was found.

    Attributes
    ----------
    field : FieldSurrogate
    trials : tuple of FieldTrial
        Networks that were tried.
    truncation : float
        What the modes miss of the training solves: root mean square over surface and solves, in the field's unit.
    truncation_left_out : float
        The same of solves that the modes were not made of (but the travelling part was).
    learning_left_out : float
        Left-out error of the coefficients, likewise.
    """

    field: FieldSurrogate
    trials: tuple[FieldTrial, ...]
    truncation: float
    truncation_left_out: float
    learning_left_out: float


def learn_displacement(data: Dataset, **options: Any) -> LearntField:
    """Learn the displacement of a body's surface from a dataset of touches; options are those of `learn_field`.

    Its points, triangles and inputs come from the dataset; rows that did not converge are left out.

    Raises
    ------
    UsageError
        As `learn_field`.
    """
    data = data.ok
    nodes, triangles = np.unique(data.triangles, return_inverse=True)
    known = {"inputs": data.ranges, "points": data.rest[nodes], "triangles": triangles.reshape(-1, 3)}
    return learn_field(data.X, data.displacement[:, nodes], **(known | options))


def learn_field(
    X: np.ndarray,
    values: np.ndarray,
    *,
    inputs: Sequence[Range],
    points: np.ndarray,
    triangles: np.ndarray,
    surface: TouchedSurface,
    radius: float,
    radius_input: int | None = None,
    name: str = "displacement",
    unit: str = "m",
    rest: np.ndarray | None = None,
    mass: np.ndarray | None = None,
    tolerance: float | None = None,
    modes_max: int = 60,
    travelling: bool = True,
    rise: str = "auto",
    length: float | None = None,
    groups: np.ndarray | None = None,
    units_max: int = 36,
    seconds: float = 30.0,
    seed: int = 0,
) -> LearntField:
    """Learn a field on a body's surface from solves.

    Parameters
    ----------
    X : (N, n)
        Centre of the probe (m), then further inputs.
    values : (N, nodes, components)
        The field at the nodes; (N, nodes) for one component.
    inputs : n ranges
    points : (nodes, 3)
        At rest, m.
    triangles : (t, 3)
        Of the surface, in these nodes.
    surface : TouchedSurface
    radius : float
        Of the probe, m; where it is an input, a usual one, by which the travelling part is as wide.
    radius_input : int, optional
        The input, 3 or later, that is the probe's radius.
    name, unit : str
    rest : (nodes, components), optional
        The field without contact; zero by default. A largest stretch rests at one.
    mass : (nodes,), optional
        What a node's error counts; its share of the area by default.
    tolerance : float, optional
        Of the modes: root mean square over surface and solves that they may miss, in the field's unit; half a
        percent of the field's own by default.
    modes_max : int
    travelling : bool
        Whether a part that travels with the probe is taken out first.
    rise : {"auto", "linear", "hertz", "square", "series"}
        How the field begins with depth; "auto" compares all by what is missed of solves left out.
    length : float, optional
        Crossing length a of "series", m; a tenth of the radius by default.
    groups : (N,) int, optional
        Solves of one group, such as a column, are left out together.
    units_max : int
    seconds : float
        For the search of a small network, which is taken where it misses less than a unit at every solve.
    seed : int

    Returns
    -------
    LearntField

    Raises
    ------
    UsageError
        If shapes disagree, an option is not one, or no solve has contact.
    """
    if rise != "auto" and rise not in RISES:
        raise UsageError(
            f"A field does not rise by {rise!r}.", fix=f"Choose 'auto' or one of {', '.join(RISES)}."
        )
    if not (seconds > 0 and modes_max > 0 and units_max >= 0 and radius > 0):
        raise UsageError(
            f"seconds={seconds}, modes_max={modes_max}, units_max={units_max}, radius={radius} allow no learning.",
            fix="Give positive numbers.",
        )
    solves, rest = _checked(
        X, values, tuple(inputs), points, triangles, surface, radius, radius_input, rest, mass, groups
    )
    if tolerance is None:
        tolerance = _TOLERANCE * float(np.sqrt(((solves.values**2).sum(axis=2) @ solves.mass).mean()))
    length = radius / 10.0 if length is None else length
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        names = RISES if rise == "auto" else (rise,)
        best = best_part(solves, names, length, tolerance, modes_max, travelling)
        network, error, trials = _learnt(best, solves.inputs, units_max, seconds, seed)
    meta = {
        **training_record(X, np.reshape(values, (len(X), -1)), solves.inputs),
        "solves": len(solves.X),
        "tolerance": tolerance,
        "modes": len(best.modes.modes),
        "rise": best.rise.name,
        "truncation": best.truncation,
        "truncation_left_out": _real(best.truncation_left_out),
        "learning_left_out": _real(error),
    }
    field = FieldSurrogate(
        *(name, unit, network),
        *(best.modes.modes, rest, solves.points, triangles, solves.mass),
        rise=best.rise,
        surface=surface,
        radius=radius if radius_input is None else math.nan,
        radius_input=radius_input,
        dimple=best.dimple,
        meta=meta,
    )
    return LearntField(field, trials, best.truncation, best.truncation_left_out, error)


def _checked(
    X: np.ndarray,
    values: np.ndarray,
    inputs: tuple[Range, ...],
    points: np.ndarray,
    triangles: np.ndarray,
    surface: TouchedSurface,
    radius: float,
    radius_input: int | None,
    rest: np.ndarray | None,
    mass: np.ndarray | None,
    groups: np.ndarray | None,
) -> tuple[Solves, np.ndarray]:
    """Solves in contact, and the field without any."""
    X = numbers("Inputs X", X, (None, len(inputs)))
    points = numbers("Points", points, (None, 3))
    N, nodes = len(X), len(points)
    values = np.asarray(values, float)
    values = values[..., None] if values.ndim == 2 else values
    if values.ndim != 3 or values.shape[:2] != (N, nodes) or not np.isfinite(values).all():
        raise UsageError(
            f"Fields of shape {values.shape} are not those of {N} solves on {nodes} nodes, or not finite.",
            fix="Pass an array (N, nodes, components) of the solves that converged.",
        )
    rest = np.zeros(values.shape[1:]) if rest is None else np.asarray(rest, float).reshape(values.shape[1:])
    mass = lumped_mass(points, triangles) if mass is None else numbers("Masses", mass, (nodes,))
    groups = np.arange(N) if groups is None else np.asarray(groups)
    depth = surface.depth(X[:, :3], radius if radius_input is None else X[:, radius_input])
    touching = depth > 0
    if not touching.any():
        raise UsageError(
            f"None of {N} solves has contact.",
            why="Without contact a field is what it is at rest.",
            fix="Press deeper, or check the surface and the probe's radius.",
        )
    parts = (X[touching], (values - rest)[touching], depth[touching], groups[touching])
    return Solves(*parts, inputs, surface, radius, points, mass / mass.sum(), radius_input), rest


def _learnt(
    best: Parted, inputs: tuple[Range, ...], units_max: int, seconds: float, seed: int
) -> tuple[Network, float, tuple[FieldTrial, ...]]:
    """The coefficients' network, its left-out error and what was tried: a unit at each solve, or a few that move."""
    whole = at_solves(best.problem)
    target = 0.1 * best.truncation
    found, error, trials = searched(
        best.problem, units_max=units_max, seconds=seconds, target=target, seed=seed
    )
    names, scaling = _outputs(best, inputs)
    if whole.error < error:
        return whole.network(inputs, names, scaling), whole.error, (*whole.trials, *trials)
    network = replace(freeze_refined(found, inputs, names, scaling), meta={})
    return network, error, (*whole.trials, *trials)


def _outputs(best: Parted, inputs: tuple[Range, ...]) -> tuple[list[Quantity], Scaling]:
    low, high = bounds(inputs)
    k = best.problem.along.shape[1]
    scale = np.full(k, best.problem.scale)
    scaling = Scaling((low + high) / 2, (high - low) / 2, np.zeros(k), scale)
    return [Quantity(f"coefficient {i}", "") for i in range(1, k + 1)], scaling


def _real(number: float) -> float | None:
    """What JSON can hold."""
    return number if math.isfinite(number) else None
