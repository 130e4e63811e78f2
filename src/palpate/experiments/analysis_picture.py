"""The picture of an analysis: psychometric functions with their data, and each person's μ with the group's."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.experiments.analysis import Analysis, PersonResult
from palpate.experiments.psychometric import JND
from palpate.experiments.study_folder import StudyFolder
from palpate.validation.report.style import BLUE, INK, ORANGE, figure
from palpate.validation.report.trace_pictures import save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_analysis", "save_pictures"]

_WIDTH, _TOP, _ROW = 4.6, 3.2, 0.22  # inches: of a condition, of its functions, of a person
_LARGEST = 70.0  # points², of the dot of the most answers


def save_pictures(analysis: Analysis, folder: StudyFolder) -> list[Path]:
    """Write the picture into the experiment's folder, anew each time; nothing of ratings alone."""
    if not analysis.people:
        return []
    folder.pictures[0].parent.mkdir(exist_ok=True)
    return [save_figure(path, lambda: draw_analysis(analysis)) for path in folder.pictures]


def draw_analysis(analysis: Analysis) -> Figure:
    """Return the figure: a column for each condition, functions above and people's μ with their intervals below."""
    names = [c.name for c in analysis.plan.comparison if any(p.condition == c.name for p in analysis.people)]
    labels = sorted({p.participant for p in analysis.people})  # of the rows, which all columns share
    below = max(_ROW * (len(labels) + 1) + 0.6, 1.1)
    drawn, axes = figure(
        2, len(names), size=(_WIDTH * len(names), _TOP + below), height_ratios=(_TOP, below),
        sharex="col", sharey="row",
    )  # fmt: skip
    for column, name in enumerate(names):
        people = [p for p in analysis.people if p.condition == name]
        _functions(axes[0, column], analysis, people)
        _locations(axes[1, column], analysis, labels, people)
        axes[0, column].set_title(name)
    axes[0, 0].set_ylabel(
        "share named stiffer" if analysis.plan.question == "discrimination" else "share right"
    )
    return drawn


def _functions(axes: Axes, analysis: Analysis, people: list[PersonResult]) -> None:
    plan = analysis.plan
    x = np.linspace(plan.levels[0], plan.levels[-1], 200)
    signed = plan.question == "discrimination"
    most = max(count for p in people for _, _, count in p.points)

    def curve(mu: float, spread: float, lapse: float) -> np.ndarray:
        sigma = spread / JND if signed else spread
        guess = float(np.mean(plan.function.guess))
        return plan.function.probability(x, np.array(mu), np.array(sigma), np.array(lapse), guess)

    for person in people:
        level, share, count = np.array(person.points).T
        axes.scatter(level, share, _LARGEST * count / most, color=BLUE, alpha=0.35, linewidths=0)
        axes.plot(x, curve(person.location[1], person.spread[1], person.lapse), color=BLUE, alpha=0.6, lw=0.9)
    group = next((g for g in analysis.groups if g.condition == people[0].condition), None)
    if group is not None:
        lapse = float(np.mean([p.lapse for p in people]))
        middle = curve(group.location.mean, float(np.exp(group.log_spread.mean)), lapse)
        axes.plot(x, middle, color=ORANGE, lw=2.2, label=f"group of {group.location.people}")
        axes.legend(frameon=False, loc="lower right")
    axes.set_ylim(-0.03, 1.03)
    axes.axvline(0.0, color=INK, lw=0.5, visible=signed)


def _locations(axes: Axes, analysis: Analysis, labels: list[str], people: list[PersonResult]) -> None:
    plan = analysis.plan
    for person in people:
        row = 1 + labels.index(person.participant)
        low, middle, high = person.location
        axes.plot([low, high], [row, row], color=BLUE, lw=1.6)
        axes.plot([middle], [row], "o", color=BLUE, ms=4)
    group = next((g for g in analysis.groups if g.condition == people[0].condition), None)
    if group is not None:
        mean = group.location
        axes.plot([mean.low, mean.high], [0, 0], color=ORANGE, lw=2.4)
        axes.plot([mean.mean], [0], "D", color=ORANGE, ms=6)
        if group.same is not None:
            half = group.same.margin * float(np.exp(group.log_spread.mean))
            axes.axvspan(-half, half, color=ORANGE, alpha=0.12, lw=0)
    axes.set_yticks(range(len(labels) + 1), ["group", *labels])
    axes.set_ylim(len(labels) + 0.6, -0.6)
    low, high = plan.levels[[0, -1]]
    middle = 0.0 if low < 0.0 < high and plan.question == "discrimination" else (low + high) / 2.0
    ticks = [low, (low + middle) / 2.0, middle, (middle + high) / 2.0, high]
    axes.set_xticks(ticks, [f"{plan.value(float(t)):.3g}" for t in ticks])
    axes.set_xlabel("ratio to the reference" if plan.vary.what == "force" else plan.vary.what)
