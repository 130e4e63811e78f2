"""Figures against limits, one `Check` per figure that could be measured and is asked for."""

from __future__ import annotations

from collections.abc import Mapping

from palpate.validation.field import FieldErrors
from palpate.validation.force import ForceErrors
from palpate.validation.limits import CRITERIA, Check, Limits
from palpate.validation.loops import LoopWork
from palpate.validation.outputs import OutputErrors
from palpate.validation.region import Worst
from palpate.validation.stiffness import StiffnessErrors

__all__ = ["checks", "figures"]

Figure = tuple[float, Worst | None]


def checks(measured: Mapping[str, Figure], limits: Limits) -> tuple[Check, ...]:
    """Judge the measured figures (by the names of `Limits`), in the order of `CRITERIA`."""
    found = []
    for criterion in CRITERIA:
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
    possible: dict[str, tuple[float | None, Worst | None]] = {
        "rmse": (networks["refined"].relative, networks["refined"].worst),
        "displacement_mean": (field.mean, field.worst),
        "displacement_max": (field.max, field.worst),
        "force_median": (force.median, force.worst),
        "force_p95": (force.p95, force.worst),
        "light_force_p95": (force.light_p95, force.light_worst),
        "direction_p95": (force.direction_p95, force.direction_worst),
        "filter_relapse": (relapse, None),
    }
    if "filter" in networks:
        own = networks["filter"]
        possible["filter_rmse"] = (own.relative, own.worst)
        possible["filter_outer_ratio"] = (own.outer_ratio, own.worst)
    if stiffness:
        possible["stiffness_p95"] = (stiffness.p95, stiffness.worst)
    if loops:
        possible["loop_work"] = (loops.max, None)
    return {key: (value, worst) for key, (value, worst) in possible.items() if value is not None}
