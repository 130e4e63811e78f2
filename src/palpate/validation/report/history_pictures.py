"""Pictures of a body with memory: force against displacement along unseen histories, and its energy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from palpate.format import share
from palpate.validation.figures.history_following import Followed
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.style import BLUE, ORANGE, Picture, figure, picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["history_pictures", "plot_energies", "plot_loops"]

MOST = 4  # histories to draw
GREY = "#8a929b"


def history_pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw the pictures of a body with memory along unseen histories; none of other models."""
    errors, followed = chapter.validation.histories, chapter.followed
    if errors is None:
        return []
    off = f"95 of 100 forces are within {share(errors.p95)} of the largest."
    return [
        picture(
            f"{key}-loops",
            "Force against displacement",
            f"Force that holds {chapter.name} against the displacement of the held node, learnt and solved. {off}",
            f"Unseen histories; the dashed line has no memory and is cut off where it leaves the picture. {off}",
            lambda: plot_loops(followed),
        ),
        picture(
            f"{key}-energies",
            "Energy stored and lost",
            f"Energy stored and lost in {chapter.name} along a history, learnt and solved.",
            "Neither was fitted: both follow from the elements that the force gave.",
            lambda: plot_energies(followed),
        ),
    ]


def plot_loops(followed: Sequence[Followed]) -> Figure:
    """Draw one panel for each history; dots of finite elements, a line of the body, a thin one without memory."""
    drawn = followed[:MOST]
    fig, axes = figure(1, len(drawn), size=(9.4, 3.2), sharey=True)
    for i, (axis, one) in enumerate(zip(axes[0], drawn, strict=True)):
        w = 1e3 * np.concatenate([[0.0], one.path.place])
        order = np.argsort(w)
        elastic = np.concatenate([[0.0], one.elastic])
        axis.plot(w[order], elastic[order], color=GREY, linestyle="--", linewidth=1.0, label="without memory")
        axis.plot(w, np.concatenate([[0.0], one.force]), color=BLUE, label="learnt body")
        axis.plot(w[1:], one.path.force, "o", color=ORANGE, markersize=2.2, label="finite elements")
        axis.set_title(f"history {i + 1}")
        axis.set_xlabel("w / mm")
    # what has no memory may need many times the force: it is cut off
    room = 1.15 * max(float(np.abs(one.path.force).max()) for one in drawn)
    axes[0, 0].set_ylim(-room, room)
    axes[0, 0].set_ylabel("P / N")
    axes[0, 0].legend(loc="best")
    return fig


def plot_energies(followed: Sequence[Followed]) -> Figure:
    """Draw the energy stored and lost along the first history, over its samples."""
    one = followed[0]
    fig, axes = figure(1, 1, size=(4.6, 3.2))
    axis, steps = axes[0, 0], np.arange(1, len(one.path) + 1)
    for name, learnt, solved, colour in (
        ("stored", one.stored, one.path.stored, BLUE),
        ("lost", one.lost, one.path.lost, ORANGE),
    ):
        axis.plot(steps, learnt, color=colour, label=name)
        axis.plot(steps, solved, "o", color=colour, markersize=2.2)
    axis.set_xlabel("sample of history 1")
    axis.set_ylabel("energy / J")
    axis.legend(loc="best", title="line: learnt body, dots: finite elements", title_fontsize=8.5)
    return fig
