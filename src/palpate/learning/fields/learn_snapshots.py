"""From snapshots, each where it was solved, to a field surrogate on one mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.learning.fields.kernel import at_solves
from palpate.learning.fields.parting import Parted, best_part
from palpate.learning.fields.search import FieldTrial, searched
from palpate.learning.fields.solves import Snapshots, Solves
from palpate.network import Network, Scaling
from palpate.rbf.freezing import freeze_refined, training_record
from palpate.surrogates import FieldSurrogate, TouchedSurface
from palpate.surrogates.field.rise import RISES
from palpate.units import Quantity, Range, bounds

__all__ = ["LearntField", "learn_snapshots"]

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
    travelling: bool = True,
    rise: str = "auto",
    length: float | None = None,
    units_max: int = 36,
    seconds: float = 30.0,
    seed: int = 0,
) -> LearntField:
    """Learn a field on a mesh from snapshots on the meshes that they were solved on; the options are `learn_field`'s.

    Raises
    ------
    UsageError
        If an option is not one, or no snapshot has contact.
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
    known = (inputs, surface, radius, points, triangles, mass, radius_input)
    solves = Solves.of(snapshots, *known).touching
    tolerance = _TOLERANCE * solves.size if tolerance is None else tolerance
    length = radius / 10.0 if length is None else length
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        names = RISES if rise == "auto" else (rise,)
        best = best_part(solves, names, length, tolerance, modes_max, travelling)
        network, error, trials = _learnt(best, solves.inputs, units_max, seconds, seed)
    fields = np.concatenate([values.ravel() for values in solves.values])
    meta = {
        **training_record(solves.X, fields, solves.inputs),
        "solves": len(solves.X),
        "tolerance": tolerance,
        "modes": len(best.modes.modes),
        "rise": best.rise.name,
        "truncation": best.truncation,
        "truncation_left_out": _real(best.truncation_left_out),
        "learning_left_out": _real(error),
    }
    field = FieldSurrogate(
        *(name, unit, network, best.modes.modes),
        *(np.zeros((len(points), solves.components)) if rest is None else rest, points, triangles, mass),
        rise=best.rise,
        surface=surface,
        radius=radius if radius_input is None else math.nan,
        radius_input=radius_input,
        dimple=best.dimple,
        meta=meta,
    )
    return LearntField(field, trials, best.truncation, best.truncation_left_out, error)


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
