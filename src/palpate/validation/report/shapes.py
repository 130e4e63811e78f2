"""Deflected shapes of all loads, from finite elements and from the network, side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.dataset import Dataset
from palpate.surrogates import TouchModel
from palpate.units import bounds
from palpate.validation.field import predicted_field
from palpate.validation.report.networks import units_of
from palpate.validation.report.style import INK, figure, loads_map

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["colour_of_load", "plot_shapes"]

FLAT = 0.2
"""Shapes flatter than this are drawn with exaggerated heights."""


def plot_shapes(touch: TouchModel, data: Dataset) -> Figure:
    """Shapes of every solve in `data`, finite elements on the left and the field network on the right.

    Parameters
    ----------
    touch : TouchModel
    data : Dataset
        Converged solves.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    shade, label = colour_of_load(data)
    order = np.argsort(shade)[::-1]
    colour = ScalarMappable(Normalize(0.0 if shade.min() >= 0 else shade.min(), shade.max()), loads_map())
    shapes = (data.displacement[:, :, :2], predicted_field(touch, data.X))
    fig, axes = figure(1, 2, size=_size(data), sharex=True, sharey=True)
    names = (
        f"Finite elements, {len(data)} solves",
        units_of(touch, "field").capitalize(),
    )
    for axis, shape, name in zip(axes[0], shapes, names, strict=True):
        _draw(axis, data, shape, order, colour.to_rgba(shade), name)
    fig.colorbar(colour, ax=axes, label=label, shrink=0.9, aspect=30, pad=0.02)
    return fig


def colour_of_load(data: Dataset) -> tuple[np.ndarray, str]:
    """What the colour of a solve means (N,) and its label: the load, or the length of several loads' vector."""
    if len(data.ranges) == 1:
        only = data.ranges[0]
        return data.X[:, 0], f"{only.name} / {only.unit}" if only.unit else only.name
    if len({r.unit for r in data.ranges}) == 1:
        return np.linalg.norm(data.X, axis=1), f"‖load‖ / {data.ranges[0].unit}"
    low, high = bounds(data.ranges)
    return np.linalg.norm(data.X / np.maximum(np.abs(low), np.abs(high)), axis=1), "‖load‖ over its limits"


def _size(data: Dataset) -> tuple[float, float]:
    """Panels as wide as fits, as high as equal axes need."""
    return 9.4, float(np.clip(4.1 * _slenderness(data) + 0.95, 2.6, 5.4))


def _slenderness(data: Dataset) -> float:
    """Height over width of all deflected shapes together."""
    placed = data.rest + data.displacement[:, :, :2]
    return float(np.ptp(placed[:, :, 1]) / np.ptp(placed[:, :, 0]))


def _draw(axis, data, shape, order, colours, name) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    from matplotlib.collections import LineCollection

    # a stiff beam drawn to scale is a line: its heights are then in mm, on their own scale
    to_scale = _slenderness(data) > FLAT
    unit = np.array([1.0, 1.0 if to_scale else 1e3])
    placed, rest = (data.rest + shape) * unit, data.rest * unit
    # hundreds of lines would weigh more than their picture; axes and text stay vectors
    lines = LineCollection(
        list(placed[order]),
        colors=colours[order],
        linewidths=0.9,
        alpha=0.9,
        rasterized=True,
        capstyle="round",
    )
    axis.add_collection(lines)
    axis.plot(*rest.T, color=INK, linewidth=1.0, alpha=0.5, linestyle=(0, (4, 2)))
    axis.plot(*rest[data.nodes_of_interest].T, "o", color=INK, markersize=3.2, alpha=0.7)
    if to_scale:
        axis.set_aspect("equal", adjustable="box")
    axis.autoscale_view()
    axis.set_title(name)
    axis.set_xlabel("x / m")
    axis.set_ylabel("y / m" if to_scale else "y / mm, exaggerated")
    axis.label_outer()
