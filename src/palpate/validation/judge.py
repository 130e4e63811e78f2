"""Figures against limits, one `Check` per figure that could be measured and is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from palpate.validation.coverage import Coverage
from palpate.validation.field import FieldErrors
from palpate.validation.force import ForceErrors
from palpate.validation.limits import CRITERIA, Check, Limits
from palpate.validation.loops import LoopWork
from palpate.validation.mesh_error import MeshErrors
from palpate.validation.outputs import OutputErrors
from palpate.validation.region import Worst
from palpate.validation.shown import ShownErrors
from palpate.validation.stiffness import StiffnessErrors
from palpate.validation.strokes import Smoothness

__all__ = ["SURROGATE_FIXES", "checks", "figures", "surrogate_figures"]

_MORE = (
    "Learn from more solves, placed where the worst cases are, or let learning take longer: `samples` in [sweep], "
    "`seconds` and `units_max` in [learning], or of learn_surrogate."
)
_LEARNT = ("force_median", "force_p95", "light_force_p95", "stiffness_p95", "direction_p95")
_SHAPE = ("displacement_mean", "displacement_max")
SURROGATE_FIXES = dict.fromkeys((*_LEARNT, *_SHAPE), _MORE) | {
    "loop_work": "The force is not the gradient of an energy: learn the energy and take its gradient, as a "
    "TouchSurrogate does."
}
"""What to do about a miss of a touch surrogate, with a study file or without."""

Figure = tuple[float, Worst | None]
Possible = tuple[float | None, Worst | None]


def checks(
    measured: Mapping[str, Figure], limits: Limits, fixes: Mapping[str, str] | None = None
) -> tuple[Check, ...]:
    """Judge the measured figures (by the names of `Limits`), in the order of `CRITERIA`.

    Parameters
    ----------
    measured : mapping
    limits : Limits
    fixes : mapping of names to what to do about a miss, optional
        Where it differs from what the criterion says.
    """
    found = []
    for criterion in CRITERIA:
        if fixes and criterion.key in fixes:
            criterion = replace(criterion, fix=fixes[criterion.key])
        limit, figure = getattr(limits, criterion.key), measured.get(criterion.key)
        if limit is not None and figure is not None:
            value, worst = figure
            found.append(Check(criterion, value, limit, str(worst) if worst else ""))
    return tuple(found)


def figures(
    networks: Mapping[str, OutputErrors],
    field: FieldErrors,
    force: ForceErrors,
    stiffness: StiffnessErrors | None,
    loops: LoopWork | None,
    relapse: float | None,
) -> dict[str, Figure]:
    """Every figure that there is, by the names of `Limits`, with the sample that is worst."""
    possible: dict[str, Possible] = {
        "rmse": (networks["refined"].relative, networks["refined"].worst),
        "displacement_mean": (field.mean, field.worst),
        "displacement_max": (field.max, field.worst),
        "filter_relapse": (relapse, None),
        **_touch(force, stiffness, loops),
    }
    if "filter" in networks:
        own = networks["filter"]
        possible["filter_rmse"] = (own.relative, own.worst)
        possible["filter_outer_ratio"] = (own.outer_ratio, own.worst)
    return _known(possible)


def surrogate_figures(
    force: ForceErrors,
    stiffness: StiffnessErrors | None,
    loops: LoopWork | None,
    border: LoopWork | None,
    smooth: Smoothness | None,
    held: Coverage | None,
    mesh: MeshErrors | None,
    shape: ShownErrors | None = None,
) -> dict[str, Figure]:
    """The same of a touch surrogate."""
    possible = _touch(force, stiffness, loops)
    if shape:
        possible["displacement_mean"] = (shape.mean, None)
        possible["displacement_max"] = (shape.max, shape.worst)
    if border:
        possible["border_loop_work"] = (border.max, None)
    if smooth:
        possible["smoothness"] = (smooth.p95, smooth.worst)
    if held:
        possible["interval_coverage"] = (held.share, None)
    if mesh:
        possible["refined_force_median"] = (mesh.together_median, mesh.worst)
        possible["refined_force_p95"] = (mesh.together_p95, mesh.worst)
    return _known(possible)


def _touch(
    force: ForceErrors, stiffness: StiffnessErrors | None, loops: LoopWork | None
) -> dict[str, Possible]:
    """What a hand feels of any model."""
    return {
        "force_median": (force.median, force.worst),
        "force_p95": (force.p95, force.worst),
        "light_force_p95": (force.light_p95, force.light_worst),
        "direction_p95": (force.direction_p95, force.direction_worst),
        "stiffness_p95": (stiffness.p95, stiffness.worst) if stiffness else (None, None),
        "loop_work": (loops.max if loops else None, None),
    }


def _known(possible: Mapping[str, Possible]) -> dict[str, Figure]:
    return {key: (value, worst) for key, (value, worst) in possible.items() if value is not None}
