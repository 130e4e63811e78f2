"""Pictures of the force on the hand: its error as a hand feels it, and its course where the hand holds the body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.format import plain, share
from palpate.validation.limits import FAINT, FAINT_JND, FORCE_JND
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.style import BLUE, ORANGE, Picture, figure, logarithmic, picture, series
from palpate.validation.unseen_solves import ForceSamples, TouchFunction, TouchSolves

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["hand_pictures", "plot_course", "plot_force_errors"]


def hand_pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw the force error in just noticeable differences, and the course of the force, where one was judged."""
    force, samples = chapter.validation.force, chapter.subject.samples
    if force is None or samples is None:
        return []
    function, solves = chapter.subject.function, chapter.subject.solves
    made = []
    if function is not None and solves is not None and function.holds:
        made.append(
            picture(
                f"{key}-course",
                "Force against displacement",
                f"Size of the force on the hand against the displacement of {chapter.name}, learnt and solved.",
                "Straight lines from rest to the unseen solves that are displaced farthest. Dots: finite elements.",
                lambda: plot_course(function, solves),
            )
        )
    felt = "No touch was strong enough to judge in relative terms."
    if force.p95 is not None and force.max is not None:
        felt = f"95 of 100 forces are within {share(force.p95)}, all within {share(force.max)}; a person notices 7 %."
    made.append(
        picture(
            f"{key}-felt",
            "Force error as a hand feels it",
            f"Share of unseen solves of {chapter.name} against force error in just noticeable differences. {felt}",
            f"{felt} Touches up to f₀ = {plain(force.light)} N ({force.light_count} of {len(samples.size)}) are judged "
            "against f₀ instead.",
            lambda: plot_force_errors(samples),
        )
    )
    return made


def plot_course(function: TouchFunction, solves: TouchSolves, most: int = 4) -> Figure:
    """Draw the size of the force on straight lines from rest to the solves that are displaced farthest."""
    fig, axes = figure(1, 1, size=(4.6, 3.4))
    axis = axes[0, 0]
    size = np.linalg.norm(solves.X[:, :3], axis=1)
    rows = np.argsort(-size, kind="stable")[:most]
    along = np.linspace(0.0, 1.0, 61)
    for row, style in zip(rows, series(len(rows)), strict=True):
        line = np.repeat(solves.X[row][None], len(along), axis=0)
        line[:, :3] *= along[:, None]
        axis.plot(1e3 * along * size[row], np.linalg.norm(function.force(line), axis=1), **style)
        axis.plot(
            1e3 * size[row], np.linalg.norm(solves.force[row]), "o", color=style["color"], markersize=4.5
        )
    axis.set_xlabel("displacement of the hand / mm")
    axis.set_ylabel("‖F‖ / N")
    axis.set_xlim(left=0)
    axis.set_ylim(bottom=0)
    return fig


def plot_force_errors(samples: ForceSamples) -> Figure:
    """Draw the share of the unseen solves whose force error is at most so many just noticeable differences."""
    fig, axes = figure(1, 1, size=(4.6, 3.4))
    axis = axes[0, 0]
    relative = samples.jnd[samples.heavy]
    shown = np.sort(np.maximum(relative[np.isfinite(relative)], 1e-9))  # zero has no place on this axis
    held = 100 * np.arange(1, shown.size + 1) / max(relative.size, 1)
    low = min(0.1, 10 ** np.floor(np.log10(shown[0]))) if shown.size else 1e-3
    high = max(10.0, 3 * float(shown[-1])) if shown.size else 10.0
    logarithmic(axis, "x", low, high)
    axis.step(shown, held, where="post", color=BLUE)
    axis.set_ylim(0, 104)
    axis.axvspan(1.0, high, color=ORANGE, alpha=0.16, linewidth=0)
    axis.axvline(1.0, color=ORANGE, linewidth=1.2)
    axis.annotate(
        "a person notices",
        (1.0, 50),
        (-4, 0),
        textcoords="offset points",
        rotation=90,
        ha="right",
        va="center",
        fontsize=8.5,
    )
    faint = np.any(samples.size[samples.heavy] < FAINT)
    one = f"{share(FORCE_JND)}; {share(FAINT_JND)} below 1 N" if faint else f"1 JND = {share(FORCE_JND)}"
    axis.set_xlabel(f"force error / just noticeable differences ({one})")
    axis.set_ylabel("unseen solves / %")
    return fig
