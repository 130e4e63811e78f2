"""Growth and pruning of units over observations, with the held-out error beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from palpate.learning import History
from palpate.learning.drawing import draw_passes, draw_units
from palpate.validation.report.style import INK, figure, series, tidy_log

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_history"]

OWN = "this filter"


def plot_history(history: History, rivals: Mapping[str, History] | None = None) -> Figure:
    """Units on the left, held-out error on the right (the error before each update where nothing was held out).

    Parameters
    ----------
    history : History
    rivals : mapping of str to History, optional
        Other runs to draw in other colours and dashes.
    """
    runs = {OWN: history, **(rivals or {})}
    fig, axes = figure(1, 2, size=(9.4, 3.1))
    units, errors = axes[0]
    drawn = []
    for (name, run), style in zip(runs.items(), series(len(runs)), strict=True):
        draw_units(units, run, style, label=name, zorder=3 if name == OWN else 2)
        shown = run.heldout if run.heldout.size else run.error
        drawn.append(shown)
        errors.plot(np.arange(1, shown.size + 1), shown, label=name, zorder=3 if name == OWN else 2, **style)
    for axis in (units, errors):
        draw_passes(axis, history, INK)
        axis.set_xlabel("observation")
    units.set_title("Units: grown ▲, pruned ▼")
    errors.set_title(
        "Error on unseen solves, of full scale" if history.heldout.size else "Error before each update"
    )
    tidy_log(errors, drawn)
    if len(runs) > 1:
        fig.legend(*errors.get_legend_handles_labels(), loc="outside upper right", ncols=min(len(runs), 4))
    return fig
