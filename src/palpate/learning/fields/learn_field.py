"""From solves of a touched body to a field surrogate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.fields.learn_snapshots import LearntField, learn_snapshots
from palpate.learning.fields.modes import lumped_mass
from palpate.learning.fields.solves import Snapshots
from palpate.rbf.sample_checks import numbers
from palpate.surrogates import TouchedSurface
from palpate.units import Range

__all__ = ["learn_displacement", "learn_field"]


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
        travelling=travelling,
        rise=rise,
        length=length,
        units_max=units_max,
        seconds=seconds,
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
