"""Growth and pruning of units over observations, with the held-out error beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.learning import History
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
        _draw_units(units, name, run, style)
        shown = run.heldout if run.heldout.size else run.error
        drawn.append(shown)
        errors.plot(np.arange(1, shown.size + 1), shown, label=name, zorder=3 if name == OWN else 2, **style)
    for axis in (units, errors):
        _draw_passes(axis, history)
        axis.set_xlabel("observation")
    units.set_title("Units: grown ▲, pruned ▼")
    units.set_ylim(bottom=0, top=max(2.0, 1.15 * max(int(r.units.max(initial=0)) for r in runs.values())))
    units.yaxis.get_major_locator().set_params(integer=True)
    errors.set_title(
        "Error on unseen solves, of full scale" if history.heldout.size else "Error before each update"
    )
    tidy_log(errors, drawn)
    if len(runs) > 1:
        fig.legend(*errors.get_legend_handles_labels(), loc="outside upper right", ncols=min(len(runs), 4))
    return fig


def _draw_units(axis: Any, name: str, run: History, style: Mapping[str, Any]) -> None:
    at = np.arange(1, run.units.size + 1)
    axis.step(at, run.units, where="post", label=name, zorder=3 if name == OWN else 2, **style)
    for mark, events in (("^", run.grew > 0), ("v", run.pruned > 0)):
        rows = np.flatnonzero(events)
        axis.plot(
            at[rows],
            run.units[rows],
            mark,
            color=style["color"],
            markersize=4.5,
            markeredgewidth=0,
            alpha=0.85,
        )


def _draw_passes(axis: Any, run: History) -> None:
    """Where each pass over the data ends."""
    if run.passes < 2 or not run.units.size:
        return
    for i in range(1, run.passes):
        axis.axvline(
            i * run.units.size / run.passes, color=INK, alpha=0.22, linewidth=0.8, linestyle=(0, (1, 3))
        )
