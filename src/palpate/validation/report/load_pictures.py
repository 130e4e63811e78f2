"""Pictures of a body that loads bend: shapes, errors at the nodes, growth, and the force on the hand."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Dataset
from palpate.format import count, length, plain
from palpate.surrogates import Surrogate
from palpate.units import bounds
from palpate.validation.figures.by_load import predicted_field
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.network_pictures import (
    error_picture,
    growth_picture,
    outer_picture,
    units_of,
    with_unit,
)
from palpate.validation.report.style import BLUE, INK, ORANGE, SERIES, Picture, figure, loads_map, picture
from palpate.validation.unseen_solves import ForceSamples

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["colour_of_load", "heading", "load_pictures", "plot_force", "plot_shapes"]

HEADINGS = {
    "down": (0.0, -1.0, 0.0),
    "up": (0.0, 1.0, 0.0),
    "away from the clamp": (1.0, 0.0, 0.0),
    "towards the clamp": (-1.0, 0.0, 0.0),
}
FLAT = 0.2  # shapes flatter than this are drawn with exaggerated heights


def load_pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw the pictures of a body that loads bend; none of other bodies."""
    v, model, data = chapter.validation, chapter.subject.loads, chapter.subject.data
    if model is None or data is None or v.networks is None:
        return []
    made = [_shapes(chapter, model, data, key), error_picture(chapter, model, data, key)]
    if (filtered := chapter.filter) is not None:
        made.append(growth_picture(chapter, filtered, key))
    return [*made, _force(chapter, model, data, key), outer_picture(chapter, key)]


def _shapes(chapter: Chapter, model: Surrogate, data: Dataset, key: str) -> Picture:
    field = chapter.validation.shape
    _, colour = colour_of_load(data)
    alike = f"Left and right differ by {length(field.mean)} on average and {length(field.max)} at most."
    return picture(
        f"{key}-shapes",
        "Deflected shapes",
        f"Two panels with the deflected shapes of {chapter.name} under {count(len(data), 'load')}: finite elements on "
        f"the left, the network on the right. {alike}",
        f"All {len(data)} unseen loads, coloured by {colour.split(' / ')[0]}; on the right the "
        f"{units_of(model, 'displacement')}. Dots mark the nodes of interest, the "
        f"dashed line the body at rest. {alike}",
        lambda: plot_shapes(model, data),
    )


def _force(chapter: Chapter, model: Surrogate, data: Dataset, key: str) -> Picture:
    samples, force = chapter.subject.samples, chapter.validation.force
    assert samples is not None  # a model whose networks answer by load answers a force
    what = "against the hand's displacement"
    if len(data.ranges) > 1:
        what = "of the network against that of finite elements"
    return picture(
        f"{key}-force",
        "Force on the hand",
        f"Force on the hand {what}, for {chapter.name}, up to {plain(force.largest, 3)} N.",
        f"The force {what}: {units_of(model, 'energy')}, as it is felt at 1 kHz.{_signs(chapter)}",
        lambda: plot_force(model, data, samples),
    )


def _signs(chapter: Chapter) -> str:
    """Return what a sign means on the axes of the force against the displacement."""
    if len(chapter.subject.ranges) > 1:
        return ""
    text = " Displacement counts along the load, force against it: a body that resists has both of one sign."
    weight = chapter.origin.get("problem", {}).get("body", {}).get("self_weight")
    return f"{text} At no force the body hangs under its own weight." if weight else text


def plot_shapes(model: Surrogate, data: Dataset) -> Figure:
    """Draw the shapes of every converged solve, finite elements on the left and the field network on the right."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    shade, label = colour_of_load(data)
    order = np.argsort(shade)[::-1]
    colour = ScalarMappable(Normalize(0.0 if shade.min() >= 0 else shade.min(), shade.max()), loads_map())
    shapes = (data.displacement[:, :, :2], predicted_field(model, data.X))
    fig, axes = figure(1, 2, size=_size(data), sharex=True, sharey=True)
    names = (
        f"Finite elements, {len(data)} solves",
        units_of(model, "displacement").capitalize(),
    )
    for axis, shape, name in zip(axes[0], shapes, names, strict=True):
        _draw_shapes(axis, data, shape, order, colour.to_rgba(shade), name)
    fig.colorbar(colour, ax=axes, label=label, shrink=0.9, aspect=30, pad=0.02)
    return fig


def colour_of_load(data: Dataset) -> tuple[np.ndarray, str]:
    """Return what the colour of a solve means (N,) and its label: the load, or the length of several loads' vector."""
    if len(data.ranges) == 1:
        return data.X[:, 0], with_unit(data.ranges[0])
    if len({r.unit for r in data.ranges}) == 1:
        return np.linalg.norm(data.X, axis=1), f"‖load‖ / {data.ranges[0].unit}"
    low, high = bounds(data.ranges)
    return np.linalg.norm(data.X / np.maximum(np.abs(low), np.abs(high)), axis=1), "‖load‖ over its limits"


def _size(data: Dataset) -> tuple[float, float]:
    """Return the size of panels as wide as fits, as high as equal axes need."""
    return 9.4, float(np.clip(4.1 * _slenderness(data) + 0.95, 2.6, 5.4))


def _slenderness(data: Dataset) -> float:
    """Return the height over width of all deflected shapes together."""
    placed = data.rest + data.displacement[:, :, :2]
    return float(np.ptp(placed[:, :, 1]) / np.ptp(placed[:, :, 0]))


def _draw_shapes(axis, data, shape, order, colours, name) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
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


def plot_force(model: Surrogate, data: Dataset, samples: ForceSamples) -> Figure:
    """Draw the force against the hand's displacement, both with their sign, for one load; a parity plot for several."""
    fig, axes = figure(1, 1, size=(4.6, 3.4))
    if len(data.ranges) == 1:
        _draw_curve(axes[0, 0], model, samples)
    else:
        _draw_parity(axes[0, 0], model, samples)
    return fig


def _draw_curve(axis: Any, model: Surrogate, samples: ForceSamples) -> None:
    reach, direction = model.hand_energy.inputs[0], model.hand_energy.baseline.directions[0]
    # the other side is a mirror image where none was solved
    low = max(reach.low, min(0.0, float(samples.hand.min())))
    along = np.linspace(low, reach.high, 200)
    force = -model.hand_energy.force(along[:, None]) @ direction
    order = np.argsort(samples.hand[:, 0])
    some = order[np.unique(np.linspace(0, order.size - 1, 28).astype(int))]
    axis.plot(1e3 * along, force, color=BLUE, label="network", zorder=1)
    axis.plot(
        1e3 * samples.hand[some, 0],
        -samples.truth[some] @ direction,
        "o",
        color=ORANGE,
        markersize=4,
        label="finite elements, unseen",
        zorder=2,
    )
    name = model.fields["displacement"].inputs[0].name
    axis.set_xlabel(f"displacement along {name} ({heading(direction)}) / mm")
    axis.set_ylabel(f"force on the hand against {name} ({heading(-direction)}) / N")
    axis.legend(loc="best")


def heading(direction: np.ndarray) -> str:
    """Return a unit vector (3,) as a person says it: down, up, outwards, inwards, or its components."""
    for word, axis in HEADINGS.items():
        if np.allclose(direction, axis, atol=1e-9):
            return word
    return f"direction {direction[0]:.2g}, {direction[1]:.2g}".replace("-", "−")


def _draw_parity(axis: Any, model: Surrogate, samples: ForceSamples) -> None:
    directions, field = model.hand_energy.baseline.directions, model.line
    assert field is not None  # the subject's own check
    truth, answer = -samples.truth @ directions.T, -samples.answer @ directions.T
    ends = np.array([min(truth.min(), answer.min()), max(truth.max(), answer.max())])
    axis.plot(ends, ends, color=INK, alpha=0.5, linewidth=1.0, label="the same")
    for i, load in enumerate(field.touched):
        axis.plot(
            truth[:, i],
            answer[:, i],
            "oD^s"[i % 4],
            color=SERIES[(0, 1, 2, 3)[i % 4]],
            markersize=3.6,
            markeredgewidth=0,
            alpha=0.85,
            label=field.inputs[load].name,
        )
    axis.set_xlabel("finite elements, unseen / N")
    axis.set_ylabel("network / N")
    axis.legend(loc="best")
