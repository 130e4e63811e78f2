"""Limits that a model is asked to keep, and why: thresholds from what a hand and an eye can tell apart.

Just noticeable differences: force about 7 % from 2.5 to 10 N and 10 to 15 % below 1 N (Jones 1989; Pang, Tan &
Durlach 1991), stiffness 8 to 23 % (Jones & Hunter 1990; Tan, Durlach, Beauregard & Srinivasan 1995), direction
of a force 25 to 35° (Barbagli, Salisbury, Ho, Spence & Tan 2006; Tan, Barbagli, Salisbury, Ho & Spence 2006). A
limit is half a just noticeable difference at the median, one at the 95th percentile; "good" is half of that and
better. What concerns time (Vogels 2004; Di Luca & Mahnan 2019) is judged where the loop and the viewer run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Literal

from palpate.errors import UsageError

__all__ = ["CRITERIA", "FAINT", "FAINT_JND", "FORCE_JND", "Bound", "Check", "Criterion", "Grade", "Limits"]

FORCE_JND = 0.07
"""Just noticeable relative difference of a force (Jones 1989; Pang, Tan & Durlach 1991)."""

FAINT, FAINT_JND = 1.0, 0.10
"""Below so many newtons a difference is noticed from 10 to 15 % on (the same sources); the stricter end is taken."""

Grade = Literal["good", "pass", "fail"]
Kind = Literal["scale", "metres", "share", "degrees", "times"]
Bound = float | tuple[float, float]
"""The largest figure that passes, or the smallest and the largest."""


def _within(value: float, bound: Bound) -> bool:
    """Return whether a figure keeps a bound; not-a-number never does."""
    low, high = bound if isinstance(bound, tuple) else (-math.inf, bound)
    return bool(low <= value <= high)


@dataclass(frozen=True)
class Limits:
    """Largest figures that pass, on solves that the networks have never seen; None asks nothing.

    Attributes
    ----------
    rmse : float
        Of the refined network, over full scale: the largest displacement in the test set.
    filter_rmse : float
        The same of the sequential filter's own network.
    filter_outer_ratio : float
        RMSE of the filter's network in the outer 10 % of the range over that in the rest.
    filter_regression : float
        Largest ratio of the filter's held-out error to its best so far: what tells drift from convergence.
    displacement_mean, displacement_max : float
        Distance of the shown shape's nodes from the finite-element ones, m.
    force_median, force_p95 : float
        ‖ΔF‖/‖F‖ where ‖F‖ > f₀ = min(0.5 N, 5 % of the largest).
    light_force_p95 : float
        ‖ΔF‖/f₀ at smaller forces.
    stiffness_p95 : float
        |ΔK|/K of the force's slope.
    direction_p95 : float
        Angle between the forces in degrees, where ‖F‖ > f₀.
    loop_work : float
        Largest net work around closed paths, over the energy given on the way.
    border_loop_work : float
        The same around paths that cross the border of the trained region.
    smoothness : float
        Largest second difference of the force along strokes over that of a reference.
    interval_coverage : (float, float)
        Smallest and largest share of the errors that the 90 % interval holds.
    contrast_p95 : float
        Error of the change of force by a hidden lump over that change, where it is above 1 % of the force.
    mesh_force : float
        The mesh's part in the force error ‖ΔF‖/‖F‖, from the same touches on elements half as large.
    refined_force_median, refined_force_p95 : float
        ‖ΔF‖/‖F‖ against solves on a refined mesh: the model's error and the mesh's together.
    history_force_median, history_force_p95 : float
        |ΔF| along histories of a body with memory, over the largest |F| of the test: along unloading the force passes
        through zero.
    history_energy : float
        Share of the steps of these histories that give lost energy back.
    answer_p95 : float
        Error of numbers, fields and curves over the range of each, 95th percentile over solves and places.
    answer_coverage : (float, float)
        Smallest and largest share of these errors that the 90 % interval holds, all solves and places together.

    Raises
    ------
    UsageError
        If a limit is not positive, or a smallest figure not below the largest.
    """

    rmse: float | None = 1e-3
    filter_rmse: float | None = None
    filter_outer_ratio: float | None = None
    filter_regression: float | None = None
    displacement_mean: float | None = 0.35e-3
    displacement_max: float | None = 1e-3
    force_median: float | None = 0.035
    force_p95: float | None = 0.07
    light_force_p95: float | None = 0.07
    stiffness_p95: float | None = 0.15
    direction_p95: float | None = 10.0
    loop_work: float | None = 0.01
    border_loop_work: float | None = 0.01
    smoothness: float | None = 3.0
    interval_coverage: tuple[float, float] | None = (0.80, 0.97)
    contrast_p95: float | None = 0.25
    mesh_force: float | None = 0.07
    refined_force_median: float | None = 0.035
    refined_force_p95: float | None = 0.07
    history_force_median: float | None = 0.01
    history_force_p95: float | None = 0.035
    history_energy: float | None = 1e-9
    answer_p95: float | None = 0.01
    answer_coverage: tuple[float, float] | None = (0.80, 0.97)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple):
                _refuse_band(field.name, value)
            elif value is not None and not (value > 0 and math.isfinite(value)):
                raise UsageError(
                    f"The limit {field.name} is {value}; it must be a positive number.",
                    fix="Give a positive limit, or none to ask nothing.",
                )


def _refuse_band(name: str, band: tuple[float, ...]) -> None:
    if not (len(band) == 2 and all(map(math.isfinite, band)) and 0 <= band[0] < band[1]):
        raise UsageError(
            f"The limit {name} is {band}; it must be a smallest and a largest figure, in that order.",
            fix="Give two numbers, or none to ask nothing.",
        )


@dataclass(frozen=True)
class Criterion:
    """One thing that is judged."""

    key: str  # its name in `Limits`
    label: str  # in words, for tables
    kind: Kind  # how its figures are written
    good: Bound | None  # nothing is gained beyond it, or between its two; None where there is none
    source: str  # where the threshold comes from
    fix: str  # what to do about a miss


@dataclass(frozen=True)
class Check:
    """One figure against its limit.

    Attributes
    ----------
    criterion : Criterion
        What is compared.
    measured : float
        Measured value.
    limit : float or (float, float)
        Largest value that passes, or the smallest and the largest.
    where : str
        The worst case in words; empty where there is none to name.
    """

    criterion: Criterion
    measured: float
    limit: Bound
    where: str = ""

    @property
    def passed(self) -> bool:
        """True if the figure is within its limit; not-a-number never is."""
        return _within(self.measured, self.limit)

    @property
    def most(self) -> float:
        """The largest figure that passes."""
        return self.limit[1] if isinstance(self.limit, tuple) else self.limit

    @property
    def grade(self) -> Grade:
        """Judgement in one word."""
        if not self.passed:
            return "fail"
        good = self.criterion.good
        return "good" if good is not None and _within(self.measured, good) else "pass"

    def __str__(self) -> str:
        """Return the measured value and the limit, and after a miss the worst case and the advice."""
        from palpate.format import criterion_figure

        kind = self.criterion.kind
        measured, limit = criterion_figure(self.measured, kind), criterion_figure(self.limit, kind)
        text = f"{self.criterion.label}: {measured} measured, {limit} asked."
        if self.passed:
            return text
        if self.where:
            text += f" The worst case is {self.where}."
        return f"{text} {self.criterion.fix}"


_MORE = (
    "Sweep more loads (`samples` in [sweep]), or allow the refined networks more units and solves (`units_max` and "
    "`samples` in [learning])."
)
_FORCE = "Jones 1989; Pang, Tan & Durlach 1991"
_FILTER = (
    "Give the filter more `passes` in [filter], or let it grow more: `settings = { error_min = …, error_rms_min = … }` "
    "there, with smaller values."
)
_TARGET = "the study's own target"
_MESH = "Refine the mesh where the probe touches, or sweep more solves: the two errors stand apart below the table."
_FINER = (
    "Take smaller elements where the probe touches (`element` in [sweep], or --element auto), and solve anew: more "
    "solves on the same mesh can't mend it."
)
_ROUGH = "palpate's own: at 0.1 m/s and 1 kHz, three times the roughness of the body itself"
_COVER = "calibration: an interval should hold what it says (Gneiting, Balabdaoui & Raftery 2007)"
_HISTORIES = "Learn from more histories, or from a finer mesh and smaller steps."
_JONES = (
    "half of half a just noticeable difference, over the largest force (Jones 1989; Pang, Tan & Durlach 1991)"
)
_EYE = "palpate's own: about a pixel where a body of 1 m fills a screen"

CRITERIA = (
    Criterion(
        "rmse", "Refined network, RMSE over full scale", "scale", None, "the study's own target", _MORE
    ),
    Criterion(
        "filter_rmse",
        "Sequential filter, RMSE over full scale",
        "scale",
        None,
        "the study's own target",
        _FILTER,
    ),
    Criterion(
        "filter_outer_ratio",
        "Sequential filter, outer 10 % against the rest",
        "times",
        1.0,
        "Narayanan, Singla, Garimella, Waz & Krovi 2011 report drift at the ends of the range",
        "Believe the ends of the range more: `settings = { edge_weight = … }` in [filter], with a smaller value; or "
        "sweep more loads (`samples` in [sweep]).",
    ),
    Criterion(
        "filter_regression",
        "Sequential filter, held-out error against its best so far",
        "times",
        1.1,
        _TARGET,
        "Guard the filter: `settings = { noise_share = … }` in [filter] with a larger value, or `noise`, or "
        "`step_bound` with a smaller one.",
    ),
    Criterion("displacement_mean", "Shape, mean distance of nodes", "metres", 0.1e-3, _EYE, _MORE),
    Criterion("displacement_max", "Shape, largest distance of a node", "metres", 0.3e-3, _EYE, _MORE),
    Criterion("force_median", "Force error, median", "share", 0.01, _FORCE, _MORE),
    Criterion("force_p95", "Force error, 95th percentile", "share", 0.035, _FORCE, _MORE),
    Criterion(
        "light_force_p95", "Force error at light touch, 95th percentile of f₀", "share", 0.035, _FORCE, _MORE
    ),
    Criterion(
        "stiffness_p95",
        "Stiffness error, 95th percentile",
        "share",
        0.08,
        "Jones & Hunter 1990; Tan, Durlach, Beauregard & Srinivasan 1995",
        _MORE,
    ),
    Criterion(
        "direction_p95",
        "Direction of the force, 95th percentile",
        "degrees",
        5.0,
        "Barbagli, Salisbury, Ho, Spence & Tan 2006; Tan, Barbagli, Salisbury, Ho & Spence 2006",
        _MORE,
    ),
    Criterion(
        "loop_work",
        "Work around a closed path, largest",
        "share",
        1e-9,
        "passivity: a body at rest gives nothing away (Colgate & Schenkel 1997)",
        "The force is not the gradient of an energy: sweep more loads (`samples` in [sweep]), or touch one load only.",
    ),
    Criterion(
        "border_loop_work",
        "Work around paths across the trained border, largest",
        "share",
        1e-9,
        "passivity: a body at rest gives nothing away (Colgate & Schenkel 1997)",
        "Beyond its training the force is not the gradient of an energy: continue the energy there, and never scale "
        "the force itself.",
    ),
    Criterion(
        "smoothness",
        "Second difference of the force along strokes, against the reference",
        "times",
        1.5,
        _ROUGH,
        "The force ripples: learn from more solves, or with fewer or wider units. Under the law s² its slope jumps at "
        'first touch: learn with `law=ContactLaw("series", length)`.',
    ),
    Criterion(
        "interval_coverage",
        "Share of errors within the 90 % interval",
        "share",
        (0.85, 0.95),
        _COVER,
        "The model is surer of itself than it may be, or less: learn again, or calibrate its deviation by solves "
        "that were left out.",
    ),
    Criterion(
        "contrast_p95",
        "Change of force by a lump, error over the change, 95th percentile",
        "share",
        0.12,
        "palpate's own: of a lump that changes the force by a just noticeable 7 % it is a quarter of that difference",
        "What lumps add is missed: sweep more presses, with more lookups in each.",
    ),
    Criterion("mesh_force", "Force error, the mesh's part", "share", 0.01, _FORCE, _FINER),
    Criterion(
        "refined_force_median", "Force error and mesh error together, median", "share", 0.01, _FORCE, _MESH
    ),
    Criterion(
        "refined_force_p95",
        "Force error and mesh error together, 95th percentile",
        "share",
        0.035,
        _FORCE,
        _MESH,
    ),
    Criterion(
        "history_force_median", "Force error, median, of the largest force", "share", 0.01, _JONES, _HISTORIES
    ),
    Criterion(
        "history_force_p95",
        "Force error, 95th percentile, of the largest force",
        "share",
        0.035,
        _JONES,
        _HISTORIES,
    ),
    Criterion(
        "history_energy",
        "Steps that give back lost energy, or store less than none",
        "share",
        0.0,
        "second law of thermodynamics",
        "A stiffness or a time of its elements is negative: learn the body anew.",
    ),
    Criterion(
        "answer_p95",
        "Numbers and fields, error over their range, 95th percentile",
        "share",
        0.005,
        "palpate's own: a tenth of what the colours of a picture tell apart",
        "Solve more cases, or cases nearer to the worst one, and learn again.",
    ),
    Criterion(
        "answer_coverage",
        "Share of these errors within the 90 % interval",
        "share",
        (0.85, 0.95),
        _COVER,
        "Learn from more solves: of few the widths themselves are uncertain.",
    ),
)
"""Everything that is judged, in the order in which it is told."""
