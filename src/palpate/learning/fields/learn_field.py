"""From solves of a touched body, each on the mesh where it was solved, to a field surrogate on one mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate import checks
from palpate.dataset import Dataset
from palpate.dataset.carried_surface import CarriedSurface
from palpate.errors import UsageError
from palpate.learning.fields.decompose_field import Decomposition, best_decomposition, lumped_mass
from palpate.learning.fields.field_search import layer_at_solves, search_coefficients
from palpate.learning.fields.snapshots import Snapshots, Solves
from palpate.learning.search import Budget, Trial
from palpate.network import Network, Scaling
from palpate.options import FieldOptions, takes
from palpate.rbf.freezing import freeze_refined, training_record
from palpate.rbf.sample_checks import numbers
from palpate.surrogates import FieldSurrogate, TouchedSurface
from palpate.surrogates.fields.depth_amplitude import AMPLITUDES
from palpate.surrogates.fields.posed_contact import PosedContact
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


@takes(FieldOptions)
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
    drawn: CarriedSurface | None = None,
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
    tool: str | None = None,
    options: FieldOptions,
) -> LearntField:
    """Learn a field on a mesh from snapshots on the meshes that they were solved on; the context is `learn_field`'s.

    `drawn` is the body's own surface, which the mesh carries in pictures; `shift` and `tool` are those of
    `FieldSurrogate`.

    Raises
    ------
    UsageError
        If an option is not one, or no snapshot has contact.

    Notes ----- The other parameters are those of `learn_field`.
    """
    checks.positive("The radius of the probe", radius, "m")
    budget = Budget.of(options.effort, options.seconds)
    context = (inputs, surface, radius, points, triangles, mass, radius_input, shift)
    contact = PosedContact(tool, surface) if tool else None
    solves = Solves.of(snapshots, *context, contact).touching
    tolerance = _TOLERANCE * solves.size if options.tolerance is None else options.tolerance
    length = radius / 10.0 if options.length is None else options.length
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        names = AMPLITUDES if options.amplitude == "auto" else (options.amplitude,)
        best = best_decomposition(solves, names, length, tolerance, options.modes_max, options.moving)
        network, error, trials = _learnt(best, solves.inputs, budget, options)
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
        *(options.name, options.unit, network, best.modes.modes),
        *(np.zeros((len(points), solves.components)) if rest is None else rest, points, triangles, mass),
        amplitude=best.amplitude,
        surface=surface,
        radius=radius if radius_input is None else math.nan,
        radius_input=radius_input,
        local_mode=best.local_mode,
        meta=meta,
        drawn=drawn,
        shift=shift,
        tool=tool,
    )
    return LearntField(field, trials, best.truncation, best.truncation_left_out, error)


def _learnt(
    best: Decomposition, inputs: tuple[Range, ...], budget: Budget, options: FieldOptions
) -> tuple[Network, float, tuple[Trial, ...]]:
    """The coefficients' network, its left-out error and what was tried: a unit at each solve, or a few that move."""
    whole = layer_at_solves(best.problem)
    target = 0.1 * best.truncation
    network_of_b, error, trials = search_coefficients(
        best.problem, budget=budget, target=target, options=options
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


@takes(FieldOptions)
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
    rest: np.ndarray | None = None,
    mass: np.ndarray | None = None,
    groups: np.ndarray | None = None,
    options: FieldOptions,
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
    rest : (nodes, components), optional
        The field without contact; zero by default. A largest stretch rests at one.
    mass : (nodes,), optional
        What a node's error counts; its share of the area by default.
    groups : (N,) int, optional
        Solves of one group, such as a column, are left out together.

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
        options=options,
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
