"""The force on the hand: against its displacement, and how its error compares with what a person notices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Dataset
from palpate.format import share
from palpate.surrogates import TouchModel
from palpate.validation.force import ForceSamples, hand_positions
from palpate.validation.limits import FAINT, FAINT_JND, FORCE_JND
from palpate.validation.report.style import BLUE, INK, ORANGE, SERIES, figure, logarithmic

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["heading", "plot_force", "plot_force_errors"]

HEADINGS = {
    "down": (0.0, -1.0, 0.0),
    "up": (0.0, 1.0, 0.0),
    "away from the clamp": (1.0, 0.0, 0.0),
    "towards the clamp": (-1.0, 0.0, 0.0),
}


def plot_force(touch: TouchModel, data: Dataset, samples: ForceSamples) -> Figure:
    """Force against the hand's displacement, both with their sign, for one load; a parity plot for several."""
    fig, axes = figure(1, 1, size=(4.6, 3.4))
    if len(data.ranges) == 1:
        _draw_curve(axes[0, 0], touch, samples)
    else:
        _draw_parity(axes[0, 0], touch, samples)
    return fig


def plot_force_errors(samples: ForceSamples) -> Figure:
    """Share of the unseen solves whose force error is at most so many just noticeable differences."""
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


def _draw_curve(axis: Any, touch: TouchModel, samples: ForceSamples) -> None:
    reach = touch.networks["force"].inputs[0]
    along = np.linspace(reach.low, reach.high, 200)
    evaluate, force = touch.evaluator(), []
    for place in hand_positions(touch, along[:, None]):
        evaluate(place, np.empty(0))
        force.append(-float(touch.directions[0] @ evaluate.force))
    order = np.argsort(samples.hand[:, 0])
    some = order[np.unique(np.linspace(0, order.size - 1, 28).astype(int))]
    axis.plot(1e3 * along, force, color=BLUE, label="network", zorder=1)
    axis.plot(
        1e3 * samples.hand[some, 0],
        -samples.truth[some] @ touch.directions[0],
        "o",
        color=ORANGE,
        markersize=4,
        label="finite elements, unseen",
        zorder=2,
    )
    name, along_load = touch.inputs[touch.touched[0]].name, touch.directions[0]
    axis.set_xlabel(f"displacement along {name} ({heading(along_load)}) / mm")
    axis.set_ylabel(f"force on the hand against {name} ({heading(-along_load)}) / N")
    axis.legend(loc="best")


def heading(direction: np.ndarray) -> str:
    """A unit vector (3,) as a person says it: down, up, outwards, inwards, or its components."""
    for word, axis in HEADINGS.items():
        if np.allclose(direction, axis, atol=1e-9):
            return word
    return f"direction {direction[0]:.2g}, {direction[1]:.2g}".replace("-", "−")


def _draw_parity(axis: Any, touch: TouchModel, samples: ForceSamples) -> None:
    truth, answer = -samples.truth @ touch.directions.T, -samples.answer @ touch.directions.T
    ends = np.array([min(truth.min(), answer.min()), max(truth.max(), answer.max())])
    axis.plot(ends, ends, color=INK, alpha=0.5, linewidth=1.0, label="the same")
    for i, load in enumerate(touch.touched):
        axis.plot(
            truth[:, i],
            answer[:, i],
            "oD^s"[i % 4],
            color=SERIES[(0, 1, 2, 3)[i % 4]],
            markersize=3.6,
            markeredgewidth=0,
            alpha=0.85,
            label=touch.inputs[load].name,
        )
    axis.set_xlabel("finite elements, unseen / N")
    axis.set_ylabel("network / N")
    axis.legend(loc="best")
