"""Pictures of networks that answer by load: errors at the nodes, growth while learning, the ends of the range."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Dataset
from palpate.format import count, length, plain, scientific
from palpate.learning import History
from palpate.learning.learning_history import draw_passes, draw_units
from palpate.surrogates import Surrogate
from palpate.validation.figures.by_load import NETWORKS, NetworkErrors, node_truth
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.style import (
    BLUE,
    INK,
    ORANGE,
    Picture,
    figure,
    logarithmic,
    picture,
    series,
    tidy_log,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "ROLES",
    "error_picture",
    "growth_picture",
    "network_rows",
    "node_errors",
    "outer_picture",
    "plot_history",
    "plot_node_errors",
    "plot_outer",
    "units_of",
    "with_unit",
]

ROLES = {
    "nodes": "loads → the displacements asked for",
    "displacement": "loads → the whole shape, for the eye",
    "energy": "where the hand is → the energy, whose slope is the force on the hand",
    "filter": "the sequential network before refinement, kept to be compared with nodes",
}
"""Purpose of each network."""

TITLES = {"filter": "Sequential filter", "refined": "Refined network"}
OWN = "this filter"


def error_picture(chapter: Chapter, model: Surrogate, data: Dataset, key: str) -> Picture:
    """Draw the error at each node against load."""
    v = chapter.validation
    refined, own = v.networks.refined, v.networks.filter
    limit = next((c.most * refined.full_scale for c in v.checks if c.criterion.key == "rmse"), None)
    text = f"Refinement (network “nodes”) leaves at most {length(refined.max)} ({refined.worst})."
    if own:
        text = (
            f"The filter alone (network “filter”) is off by at most {length(own.max)} ({own.worst}). {text}"
        )
    dips = " Dips are loads at which an error changes sign." if len(refined.worst.inputs) == 1 else ""
    return picture(
        f"{key}-errors",
        "Error at each node against load",
        f"Error at each node of {chapter.name} against load, on a logarithmic axis. {text}",
        text + dips,
        lambda: plot_node_errors(model, data, limit),
    )


def growth_picture(chapter: Chapter, h: History, key: str) -> Picture:
    """Draw the growth and pruning of the sequential filter."""
    text = _grown(h) + _compared(chapter.rivals)
    return picture(
        f"{key}-growth",
        "Growth and pruning while learning",
        f"Units of the sequential filter over observations of {chapter.name}, with the error beside them. {text}",
        f"Network “filter”: {text} Dotted lines part the passes over the data.",
        lambda: plot_history(h, chapter.rivals),
    )


def _grown(h: History) -> str:
    left = int(h.units[-1]) if h.units.size else 0
    text = (
        f"{count(int(h.grew.sum()), 'unit')} grown and {int(h.pruned.sum())} pruned over "
        f"{count(h.units.size, 'observation')}; {count(left, 'unit')} left."
    )
    if h.heldout.size:
        text += (
            f" The error on unseen solves ends at {scientific(float(h.heldout[-1]))} of full scale and was never above "
            f"{plain(h.regression, 3)} times its best so far."
        )
    return text


def _compared(rivals: Mapping[str, History]) -> str:
    told = [
        f"{name} ends at {scientific(float(r.heldout[-1]))} with {count(int(r.units[-1]), 'unit')} and rose to "
        f"{plain(r.regression, 3)} times its best"
        for name, r in rivals.items()
        if r.heldout.size
    ]
    return f" For comparison: {'; '.join(told)}." if told else ""


def outer_picture(chapter: Chapter, key: str) -> Picture:
    """Draw the errors at the ends of the range beside the rest."""
    v = chapter.validation
    parts = [
        f"{'refined network' if k == 'refined' else k} {plain(e.outer_ratio)} times the rest"
        for k, e in v.networks.named().items()
        if e.outer_ratio is not None
    ]
    place = "in the outer 5 % at either end of the range"
    if len(chapter.subject.ranges) > 1:
        place = "with any load in the outer 5 % of its range"
    lie = f"{v.networks.refined.outer_count} of {v.samples} unseen solves lie {place}."
    text = f"{lie} RMSE there: {', '.join(parts) or 'not known'}."
    return picture(
        f"{key}-outer",
        "Ends of the range against the rest",
        f"Errors of {chapter.name} at the ends of the range beside the rest. {text}",
        text,
        lambda: plot_outer(v.networks),
    )


def network_rows(model: Surrogate) -> list[tuple[str, str, str]]:
    """Return name, purpose and number of units of each network, in the order of `ROLES`."""
    own = {key: field.network.units for key, field in model.fields.items()} | {
        "energy": model.hand_energy.network.units
    }
    return [(k, role, str(own[k])) for k, role in ROLES.items() if k in own]


def units_of(model: Surrogate, key: str) -> str:
    """Return one network by its name with its number of units, for titles and captions."""
    network = model.hand_energy.network if key == "energy" else model.fields[key].network
    return f"network “{key}”, {count(network.units, 'unit')}"


def node_errors(model: Surrogate, data: Dataset, label: str) -> tuple[list[str], np.ndarray]:
    """Return the nodes' names and the lengths of their errors (N, nodes) in m; `label` is "refined" or "filter"."""
    network = model.fields[NETWORKS[label]].network
    error = network.predict(data.X) - node_truth(model, data)
    places = [q.name.partition(" at ")[2] or q.name for q in network.outputs]
    names = list(dict.fromkeys(places))
    columns = [[i for i, place in enumerate(places) if place == name] for name in names]
    return names, np.stack([np.linalg.norm(error[:, c], axis=1) for c in columns], axis=1)


def plot_node_errors(model: Surrogate, data: Dataset, limit: float | None = None) -> Figure:
    """Draw one column of panels per network, one row per input; error on a logarithmic axis.

    The solves are converged and unseen. `limit` is the RMSE in m asked of the refined network, drawn across its panels.
    """
    labels = [k for k in TITLES if NETWORKS[k] in model.fields]
    rows = len(data.ranges)
    height = 3.3 if rows == 1 else 0.7 + 2.1 * rows
    fig, axes = figure(rows, len(labels), size=(9.4, height), sharey=True, sharex="row")
    values = []
    for column, label in enumerate(labels):
        names, error = node_errors(model, data, label)
        values.append(error)
        for row, axis in enumerate(axes[:, column]):
            _draw_errors(axis, data.X[:, row], names, error, lines=rows == 1)
            axis.set_xlabel(with_unit(data.ranges[row]))
            if limit is not None and label == "refined":
                axis.axhline(limit, color=INK, linewidth=0.9, linestyle=(0, (2, 2)))
                _note(axis, "RMSE asked", limit)
        axes[0, column].set_title(f"{TITLES[label]}: {units_of(model, NETWORKS[label])}")
    for axis in axes[:, 0]:
        axis.set_ylabel("|error| / m")
    tidy_log(axes[0, 0], [*values, np.array([limit or 0.0])])
    handles, names = axes[0, 0].get_legend_handles_labels()
    fig.legend(
        handles, names, loc="outside upper right", ncols=len(names), title="node at", title_fontsize=8.5
    )
    return fig


def plot_outer(networks: NetworkErrors) -> Figure:
    """Draw the RMSE in the outer part of the range beside the rest, one row per network."""
    errors = networks.named()
    labels = [k for k in TITLES if k in errors]
    fig, axes = figure(1, 1, size=(9.4, 0.9 + 0.42 * len(labels)))
    axis, points = axes[0, 0], []
    for row, label in enumerate(labels):
        error = errors[label]
        rest = (error.rest or 0.0) / error.full_scale
        outer = (error.outer or 0.0) / error.full_scale
        points += [rest, outer]
        axis.plot([rest, outer], [row, row], color=INK, alpha=0.35, linewidth=2, zorder=1)
        axis.plot(rest, row, "o", color=BLUE, markersize=8, label="the rest" if row == 0 else None)
        axis.plot(outer, row, "D", color=ORANGE, markersize=7, label="outer part" if row == 0 else None)
        if error.outer_ratio:
            axis.annotate(
                f"{error.outer_ratio:.2g} ×",
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


def _draw_errors(axis: Any, x: np.ndarray, names: list[str], error: np.ndarray, *, lines: bool) -> None:
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


def with_unit(quantity: Any) -> str:
    """Return the name of a quantity with its unit, for an axis."""
    return f"{quantity.name} / {quantity.unit}" if quantity.unit else str(quantity.name)


def plot_history(history: History, rivals: Mapping[str, History] | None = None) -> Figure:
    """Draw units on the left, held-out error on the right (the error before each update where nothing was held out).

    Rivals are other runs, in other colours and dashes.
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
