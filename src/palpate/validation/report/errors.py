"""Error at each node against load, of the sequential filter and of the refined network; outer part against rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Dataset
from palpate.surrogates import TouchModel
from palpate.validation.report.networks import units_of
from palpate.validation.report.style import BLUE, INK, ORANGE, figure, logarithmic, series, tidy_log
from palpate.validation.result import NETWORKS, Validation, node_truth

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["node_errors", "plot_node_errors", "plot_outer"]

TITLES = {"filter": "Sequential filter", "refined": "Refined network"}


def node_errors(touch: TouchModel, data: Dataset, label: str) -> tuple[list[str], np.ndarray]:
    """Names of the nodes, and the length of each one's error (N, nodes) in m.

    Parameters
    ----------
    touch : TouchModel
    data : Dataset
    label : "refined" or "filter"
    """
    network = touch.networks[NETWORKS[label]]
    error = network.predict(data.X) - node_truth(touch, data)
    places = [q.name.partition(" at ")[2] or q.name for q in network.outputs]
    names = list(dict.fromkeys(places))
    columns = [[i for i, place in enumerate(places) if place == name] for name in names]
    return names, np.stack([np.linalg.norm(error[:, c], axis=1) for c in columns], axis=1)


def plot_node_errors(touch: TouchModel, data: Dataset, limit: float | None = None) -> Figure:
    """One column of panels per network, one row per input; error on a logarithmic axis.

    Parameters
    ----------
    touch : TouchModel
    data : Dataset
        Converged solves that the networks have never seen.
    limit : float, optional
        RMSE asked of the refined network in m, drawn across its panels.
    """
    labels = [k for k in TITLES if NETWORKS[k] in touch.networks]
    rows = len(data.ranges)
    height = 3.3 if rows == 1 else 0.7 + 2.1 * rows
    fig, axes = figure(rows, len(labels), size=(9.4, height), sharey=True, sharex="row")
    values = []
    for column, label in enumerate(labels):
        names, error = node_errors(touch, data, label)
        values.append(error)
        for row, axis in enumerate(axes[:, column]):
            _draw(axis, data.X[:, row], names, error, lines=rows == 1)
            axis.set_xlabel(_with_unit(data.ranges[row]))
            if limit is not None and label == "refined":
                axis.axhline(limit, color=INK, linewidth=0.9, linestyle=(0, (2, 2)))
                _note(axis, "RMSE asked", limit)
        axes[0, column].set_title(f"{TITLES[label]}: {units_of(touch, NETWORKS[label])}")
    for axis in axes[:, 0]:
        axis.set_ylabel("|error| / m")
    tidy_log(axes[0, 0], [*values, np.array([limit or 0.0])])
    handles, names = axes[0, 0].get_legend_handles_labels()
    fig.legend(
        handles, names, loc="outside upper right", ncols=len(names), title="node at", title_fontsize=8.5
    )
    return fig


def plot_outer(validation: Validation) -> Figure:
    """RMSE in the outer part of the range beside the rest, one row per network."""
    labels = [k for k in TITLES if k in validation.networks]
    fig, axes = figure(1, 1, size=(9.4, 0.9 + 0.42 * len(labels)))
    axis, points = axes[0, 0], []
    for row, label in enumerate(labels):
        found = validation.networks[label]
        rest = (found.rest or 0.0) / found.full_scale
        outer = (found.outer or 0.0) / found.full_scale
        points += [rest, outer]
        axis.plot([rest, outer], [row, row], color=INK, alpha=0.35, linewidth=2, zorder=1)
        axis.plot(rest, row, "o", color=BLUE, markersize=8, label="the rest" if row == 0 else None)
        axis.plot(outer, row, "D", color=ORANGE, markersize=7, label="outer part" if row == 0 else None)
        if found.outer_ratio:
            axis.annotate(
                f"{found.outer_ratio:.2g} ×",
                (max(rest, outer), row),
                (9, -3),
                textcoords="offset points",
                fontsize=8.5,
            )
    positive = [p for p in points if p > 0]
    low, high = (min(positive), max(positive)) if positive else (1e-15, 1e-10)
    logarithmic(axis, "x", 10 ** np.floor(np.log10(low) - 0.1), 10 ** np.ceil(np.log10(high) + 0.2))
    axis.set_yticks(range(len(labels)), [TITLES[k] for k in labels])
    axis.set_ylim(len(labels) - 0.5, -0.5)
    axis.set_xlabel("RMSE over full scale")
    axis.grid(visible=False, axis="y")
    axis.figure.legend(loc="outside upper right", ncols=2)
    return fig


def _draw(axis: Any, x: np.ndarray, names: list[str], error: np.ndarray, *, lines: bool) -> None:
    order = np.argsort(x)
    marks = "osD^vP"
    for i, (name, style) in enumerate(zip(names, series(len(names)), strict=True)):
        if lines:
            axis.plot(x[order], error[order, i], label=name, linewidth=1.1, **style)
        else:
            axis.plot(
                x,
                error[:, i],
                marks[i % 6],
                color=style["color"],
                markersize=3,
                alpha=0.8,
                rasterized=True,  # thousands of marks weigh more than their picture
                markeredgewidth=0,
                label=name,
            )


def _note(axis: Any, text: str, height: float) -> None:
    note = axis.annotate(
        text,
        (0.995, height),
        (0, 3),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        fontsize=8,
        annotation_clip=True,
    )
    note.set_in_layout(False)  # a limit far below the axis must not squeeze the panels


def _with_unit(quantity: Any) -> str:
    return f"{quantity.name} / {quantity.unit}" if quantity.unit else str(quantity.name)
