"""From solves of a touched body, each on the mesh where it was solved, to a field surrogate on one mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.fields.decompose_field import Decomposition, best_decomposition, lumped_mass
from palpate.learning.fields.field_search import layer_at_solves, search_coefficients
from palpate.learning.fields.snapshots import Snapshots, Solves
from palpate.learning.search import Budget, Trial
from palpate.network import Network, Scaling
from palpate.rbf.freezing import freeze_refined, training_record
from palpate.rbf.sample_checks import numbers
from palpate.surrogates import FieldSurrogate, TouchedSurface
from palpate.surrogates.fields.depth_amplitude import AMPLITUDES
from palpate.units import Quantity, Range, bounds

__all__ = [
    "LearntField",
    "learn_displacement",
    "learn_field",
    "learn_snapshots",
]

_TOLERANCE = 5e-3  # of the snapshots' root mean square


@dataclass(frozen=True, eq=False)
class LearntField:
    """A field surrogate, and how it was found.

    Attributes
    ----------
    field : FieldSurrogate
        The surrogate, to be asked and kept.
    trials : tuple of Trial
        Networks that were tried.
    truncation : float
        What the modes miss of the training solves: root mean square over surface and solves, in the field's unit.
    truncation_left_out : float
        The same of solves that the modes were not made of (but the moving part was).
    learning_left_out : float
        Left-out error of the coefficients, likewise.
    """

    field: FieldSurrogate
    trials: tuple[Trial, ...]
    truncation: float
    truncation_left_out: float
    learning_left_out: float


def learn_snapshots(
    snapshots: Sequence[Snapshots],
    *,
    inputs: Sequence[Range],
    points: np.ndarray,
    triangles: np.ndarray,
    mass: np.ndarray,
    surface: TouchedSurface,
    radius: float,
    radius_input: int | None = None,
    rest: np.ndarray | None = None,
    name: str = "displacement",
    unit: str = "m",
    tolerance: float | None = None,
    modes_max: int = 60,
    moving: bool = True,
    amplitude: str = "auto",
    length: float | None = None,
    units_max: int = 36,
    effort: float = 1.0,
    seconds: float | None = None,
    workers: int | None = None,
    seed: int = 0,
) -> LearntField:
    """Learn a field on a mesh from snapshots on the meshes that they were solved on.

    Parameters
    ----------
    snapshots : sequence of Snapshots
        Solves, each on a mesh of its own.

    Raises
    ------
    UsageError
        If an option is not one, or no snapshot has contact.

    Notes ----- The other parameters are those of `learn_field`.
    """
    if amplitude != "auto" and amplitude not in AMPLITUDES:
        raise UsageError(
            f"A field does not grow by {amplitude!r}.",
            fix=f"Choose 'auto' or one of {', '.join(AMPLITUDES)}.",
        )
    budget = Budget.of(effort, seconds)
    if not (modes_max > 0 and units_max >= 0 and radius > 0):
        raise UsageError(
            f"modes_max={modes_max}, units_max={units_max}, radius={radius} allow no learning.",
            fix="Give positive numbers.",
        )
    context = (inputs, surface, radius, points, triangles, mass, radius_input)
    solves = Solves.of(snapshots, *context).touching
    tolerance = _TOLERANCE * solves.size if tolerance is None else tolerance
    length = radius / 10.0 if length is None else length
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        names = AMPLITUDES if amplitude == "auto" else (amplitude,)
        best = best_decomposition(solves, names, length, tolerance, modes_max, moving)
        network, error, trials = _learnt(best, solves.inputs, units_max, budget, seed, workers)
    fields = np.concatenate([values.ravel() for values in solves.values])
    meta = {
        **training_record(solves.X, fields, solves.inputs),
        "solves": len(solves.X),
        "tolerance": tolerance,
        "modes": len(best.modes.modes),
        "amplitude": best.amplitude.name,
        "truncation": best.truncation,
        "truncation_left_out": _real(best.truncation_left_out),
        "learning_left_out": _real(error),
    }
    field = FieldSurrogate(
        *(name, unit, network, best.modes.modes),
        *(np.zeros((len(points), solves.components)) if rest is None else rest, points, triangles, mass),
        amplitude=best.amplitude,
        surface=surface,
        radius=radius if radius_input is None else math.nan,
        radius_input=radius_input,
        local_mode=best.local_mode,
        meta=meta,
    )
    return LearntField(field, trials, best.truncation, best.truncation_left_out, error)


def _learnt(
    best: Decomposition,
    inputs: tuple[Range, ...],
    units_max: int,
    budget: Budget,
    seed: int,
    workers: int | None,
) -> tuple[Network, float, tuple[Trial, ...]]:
    """The coefficients' network, its left-out error and what was tried: a unit at each solve, or a few that move."""
    whole = layer_at_solves(best.problem)
    target = 0.1 * best.truncation
    network_of_b, error, trials = search_coefficients(
        best.problem, units_max=units_max, budget=budget, target=target, seed=seed, workers=workers
    )
    names, scaling = _outputs(best, inputs)
    if whole.error < error:
        return whole.network(inputs, names, scaling), whole.error, (*whole.trials, *trials)
    network = replace(freeze_refined(network_of_b, inputs, names, scaling), meta={})
    return network, error, (*whole.trials, *trials)


def _outputs(best: Decomposition, inputs: tuple[Range, ...]) -> tuple[list[Quantity], Scaling]:
    low, high = bounds(inputs)
    k = best.problem.along.shape[1]
    scale = np.full(k, best.problem.scale)
    scaling = Scaling((low + high) / 2, (high - low) / 2, np.zeros(k), scale)
    return [Quantity(f"coefficient {i}", "") for i in range(1, k + 1)], scaling


def _real(number: float) -> float | None:
    """Return a number as JSON can hold it."""
    return number if math.isfinite(number) else None


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
    context = {"inputs": data.ranges, "points": data.rest[nodes], "triangles": triangles.reshape(-1, 3)}
    return learn_field(data.X, data.displacement[:, nodes], **(context | options))


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
    moving: bool = True,
    amplitude: str = "auto",
    length: float | None = None,
    groups: np.ndarray | None = None,
    units_max: int = 36,
    effort: float = 1.0,
    seconds: float | None = None,
    workers: int | None = None,
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
        Names, units and ranges of the columns of X.
    points : (nodes, 3)
        At rest, m.
    triangles : (t, 3)
        Of the surface, in these nodes.
    surface : TouchedSurface
        The surface that the probe touches, with its signed distance.
    radius : float
        Of the probe, m; where it is an input, a usual one, by which the moving part is as wide.
    radius_input : int, optional
        The input, 3 or later, that is the probe's radius.
    name, unit : str
        Name and SI unit of the field, such as "displacement" and "m".
    rest : (nodes, components), optional
        The field without contact; zero by default. A largest stretch rests at one.
    mass : (nodes,), optional
        What a node's error counts; its share of the area by default.
    tolerance : float, optional
        Of the modes: root mean square over surface and solves that they may miss, in the field's unit; half a
        percent of the field's own by default.
    modes_max : int
        Most modes, however much they miss.
    moving : bool
        Whether a part that travels with the probe is taken out first.
    amplitude : {"auto", "linear", "hertz", "square", "series"}
        How the field begins with depth; "auto" compares all by what is missed of solves left out.
    length : float, optional
        Crossing length a of "series", m; a tenth of the radius by default.
    groups : (N,) int, optional
        Solves of one group, such as a column, are left out together.
    units_max : int
        Most units of the small network.
    effort : float
        Multiplies the iterations of the search of a small network, which is taken where it misses less than a unit at
        every solve; 0.1 gives a quick look.
    seconds : float, optional
        Limit on that search's time; by default none. A limit that ends the search early makes the result depend on
        the machine.
    workers : int, optional
        Processes that search at a time; one for each core by default, at most eight. The result is the same with any
        number.
    seed : int
        Decides the starts of the search.

    Returns
    -------
    LearntField

    Raises
    ------
    UsageError
        If shapes disagree, an option is not one, or no solve has contact.
    """
    values, rest, mass, groups = _checked(X, values, len(inputs), points, triangles, rest, mass, groups)
    here = {"points": np.asarray(points, float), "triangles": triangles, "mass": mass}
    return learn_snapshots(
        [Snapshots(np.asarray(X, float), values - rest, groups, **here)],
        **here,
        inputs=inputs,
        surface=surface,
        radius=radius,
        radius_input=radius_input,
        rest=rest,
        name=name,
        unit=unit,
        tolerance=tolerance,
        modes_max=modes_max,
        moving=moving,
        amplitude=amplitude,
        length=length,
        units_max=units_max,
        effort=effort,
        seconds=seconds,
        workers=workers,
        seed=seed,
    )


def _checked(
    X: np.ndarray,
    values: np.ndarray,
    count: int,
    points: np.ndarray,
    triangles: np.ndarray,
    rest: np.ndarray | None,
    mass: np.ndarray | None,
    groups: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Fields, the one without contact, shares of the surface and groups."""
    N, nodes = len(numbers("Inputs X", X, (None, count))), len(numbers("Points", points, (None, 3)))
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
    return values, rest, mass / mass.sum(), groups
