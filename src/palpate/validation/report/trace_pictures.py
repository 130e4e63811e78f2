"""Pictures of recorded touches: a touch in time and by depth, and two answers to one hand with their difference."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.devices.trace_file import Trace
from palpate.errors import UsageError
from palpate.files import writing
from palpate.format import plain, share
from palpate.output_files import picture_metadata
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.style import BLUE, INK, ORANGE, Picture, figure, picture, styled
from palpate.validation.touch_comparison import TouchComparison

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["comparison_pictures", "plot_comparison", "plot_trace", "save_figure"]

_POINTS = 4000  # points of a line; the eye can't tell more
Solved = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Depths (k,) of solves, m, and the sizes of their forces and of the surrogate's at the same places, N."""


def plot_trace(trace: Trace, solved: Solved | None = None) -> Figure:
    """Draw force and depth in time, and the force by depth, with the finite elements beside it where there are some."""
    fig, axes = figure(1, 2, size=(9.2, 3.6), width_ratios=(1.7, 1.0))
    time, size = trace.time, np.linalg.norm(trace.ticks["force"], axis=1)
    depth = 1e3 * np.maximum(trace.ticks["depth"].astype(float), 0.0)
    rows = slice(None, None, max(1, len(time) // _POINTS))
    left, right = axes[0]
    left.plot(time[rows], size[rows], color=BLUE, label="‖F‖ / N")
    left.set_xlabel("time / s")
    left.set_ylabel("force as sent / N")
    deep = left.twinx()
    deep.plot(time[rows], depth[rows], color=ORANGE, linestyle=(0, (5, 1.5)), label="depth / mm")
    deep.set_ylabel("depth / mm")
    deep.grid(visible=False)
    deep.spines["right"].set_visible(True)
    _shade_faults(left, trace)
    handles = [*left.get_lines(), *deep.get_lines()]
    left.legend(handles=handles, labels=[str(h.get_label()) for h in handles], loc="upper right")
    felt = trace.flag("grabbed") & (trace.ticks["fault"] == 0)
    some = slice(None, None, max(1, int(felt.sum()) // _POINTS))
    right.plot(depth[felt][some], size[felt][some], color=BLUE, linewidth=0.9, label="recorded")
    if solved is not None and len(solved[0]):
        deep_at, force_at, answer = solved
        right.plot(
            1e3 * deep_at, force_at, "o", color=ORANGE, markersize=4, label="finite elements beside it"
        )
        right.plot(
            1e3 * deep_at, answer, "o", color=BLUE, markersize=7, fillstyle="none", label="surrogate there"
        )
    right.set_xlabel("depth / mm")
    right.set_ylabel("‖F‖ / N")
    right.set_xlim(left=0)
    right.set_ylim(bottom=0)
    right.legend(loc="upper left")
    return fig


def _shade_faults(axis: Axes, trace: Trace) -> None:
    """Shade the time in which a fault held the force at zero."""
    bad = np.concatenate([[False], trace.ticks["fault"] != 0, [False]])
    starts, ends = (np.flatnonzero(np.diff(bad.astype(int)) == sign) for sign in (1, -1))
    for start, end in list(zip(starts, ends, strict=True))[:200]:
        axis.axvspan(trace.time[start], trace.time[end - 1], color=ORANGE, alpha=0.2, linewidth=0)


def plot_comparison(comparison: TouchComparison) -> Figure:
    """Draw two forces along one stroke, below each other with their difference in just noticeable differences."""
    fig, axes = figure(2, 1, size=(7.6, 5.0), sharex=True, height_ratios=(1.6, 1.0))
    upper, lower = axes[:, 0]
    rows = slice(None, None, max(1, len(comparison.time) // _POINTS))
    time, sparse = comparison.time[rows], len(comparison.time) < 400
    for name, force, style in (
        (comparison.names[0], comparison.reference, {"color": ORANGE, "linestyle": "-"}),
        (comparison.names[1], comparison.other, {"color": BLUE, "linestyle": (0, (5, 1.5))}),
    ):
        marks: dict[str, Any] = {"marker": "o", "markersize": 2.5} if sparse else {}
        upper.plot(time, np.linalg.norm(force[rows], axis=1), label=name, **style, **marks)
    upper.set_ylabel("‖F‖ / N")
    upper.set_ylim(bottom=0)
    upper.legend(loc="upper right")
    lower.plot(time, comparison.jnd[rows], color=INK, linewidth=1.1)
    lower.axhline(1.0, color=ORANGE, linewidth=1.2)
    lower.annotate("a person notices", (1.0, 1.0), (-2, 2), xycoords=("axes fraction", "data"),
                   textcoords="offset points", ha="right", va="bottom", fontsize=8.5)  # fmt: skip
    lower.set_ylim(0, max(1.25, 1.1 * float(comparison.jnd.max(initial=0.0))))
    lower.set_xlabel("time / s")
    lower.set_ylabel("difference / JND")
    return fig


def comparison_pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw each recorded touch of a chapter beside the full model."""
    made = []
    for k, comparison in enumerate(chapter.comparisons, 1):
        values = comparison.as_dict()
        felt = "Neither force is more than zero."
        if values["felt"]:
            felt = (
                f"Half of the moments differ by at most {plain(values['jnd_median'])} JND, 95 of 100 by at most "
                f"{plain(values['jnd_p95'])}; a person notices {share(values['noticeable'])} of the touch."
            )
        made.append(
            picture(
                f"{key}-trace{k}",
                f"A recorded touch: {comparison.names[1]} beside {comparison.names[0]}",
                f"Force of {comparison.names[0]} and {comparison.names[1]} in time, and their difference. {felt}",
                f"{felt} 1 JND is 7 % of the force, 10 % below 1 N. {comparison.note}".strip(),
                _drawing(comparison),
            )
        )
    return made


def _drawing(comparison: TouchComparison) -> Callable[[], Figure]:
    return lambda: plot_comparison(comparison)


def save_figure(path: str | os.PathLike[str], draw: Callable[[], Figure]) -> Path:
    """Write a drawing as a file of its own, on white; the ending says in which format, such as ``.svg`` or ``.png``."""
    target = Path(path)
    with styled(target.stem), writing(target) as part:
        try:
            draw().savefig(
                part,
                dpi=160,
                facecolor="white",
                format=target.suffix[1:] or "svg",
                metadata=picture_metadata(target),
            )
        except ValueError as error:
            raise UsageError(
                f"{target.name} names no format of a picture.",
                why=str(error),
                fix="Let it end with .svg, .png or .pdf.",
            ) from error
    return target
