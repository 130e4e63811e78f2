"""History of a sequential run, one row per observation, and its picture.

The picture has errors on a logarithmic axis, and units with marks where one was added or removed.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import FileFormatError
from palpate.files import writing
from palpate.input_files import DAMAGE, open_input
from palpate.rbf.filter.step import Event
from palpate.sizes import require_npz

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "History",
    "draw_passes",
    "draw_units",
]


@dataclass(frozen=True, eq=False)
class History:
    """Growth and errors over T observations.

    Attributes
    ----------
    units : (T,) int
        Units after each observation.
    error : (T,)
        Error norm before each observation was used, in scaled outputs.
    window_rms : (T,)
        Windowed RMS of it.
    innovation : (T,)
        Running root mean square of the innovation per scaled output.
    grew, pruned : (T,) int
        Units added and removed by each observation.
    heldout : (T,)
        RMSE on held-out data after each observation, relative to full scale; empty where none were given.
    passes : int
        Times that each sample was presented.
    """

    units: np.ndarray
    error: np.ndarray
    window_rms: np.ndarray
    innovation: np.ndarray
    grew: np.ndarray
    pruned: np.ndarray
    heldout: np.ndarray
    passes: int

    @classmethod
    def of(
        cls, events: Sequence[Event], innovation: Sequence[float], heldout: Sequence[float], passes: int
    ) -> History:
        """Collect events (T) into arrays."""
        return cls(
            np.array([e.units for e in events], dtype=np.int64),
            np.array([e.error for e in events]),
            np.array([e.window_rms for e in events]),
            np.sqrt(np.array(innovation)),
            np.array([int(e.grew) for e in events], dtype=np.int64),
            np.array([e.pruned for e in events], dtype=np.int64),
            np.array(heldout),
            passes,
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the history as a NumPy archive.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        with writing(path) as part, part.open("wb") as file:
            np.savez_compressed(file, **vars(self))
        return Path(path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> History:
        """Read a history back.

        Raises
        ------
        FileFormatError
            If the file is missing or no history.
        """
        try:
            # opened here: on a damaged archive NumPy would leave its own handle open
            with open_input(path) as raw:
                require_npz(raw)
                with np.load(raw, allow_pickle=False) as file:
                    parts = {f.name: file[f.name] for f in fields(cls)}
        except (FileFormatError, *DAMAGE) as error:
            raise FileFormatError(f"{path} is not a learning history.", why=str(error)) from error
        return cls(**(parts | {"passes": int(parts["passes"])}))

    def plot(self, ax: Axes | None = None) -> Figure:
        """Draw errors and units against the observations; ▲ marks a unit added, ▼ one removed.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw errors, with units on a second axis at the right. If left out a figure of its own is
            made, of no window and no global state: `savefig` writes it, a notebook shows it.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return _figure_of(self, ax)

    @property
    def regression(self) -> float:
        """Largest ratio of the held-out error to its best so far; 1 is monotone, nan without held-out data."""
        if not self.heldout.size:
            return float("nan")
        return float((self.heldout / np.minimum.accumulate(self.heldout)).max())

    def __str__(self) -> str:
        text = (
            f"History: {self.units.size} observations in {self.passes} passes, {self.grew.sum()} units grown, "
            f"{self.pruned.sum()} pruned, {self.units[-1] if self.units.size else 0} left"
        )
        if self.heldout.size:
            text += f"; held-out error {self.heldout[-1]:.1e} of full scale, "
            text += f"never above {self.regression:.2f} × its best"
        return text


# of Okabe & Ito 2008 ("Color universal design"), darkened for lines on white
_BLUE, _ORANGE, _GREEN = "#2f7fc1", "#d9642b", "#149b76"
_DEEPEST = 1e-9  # of the largest error: round-off below it says nothing


def _figure_of(history: History, ax: Axes | None) -> Figure:
    """The picture that `History.plot` describes."""
    if ax is not None:
        _draw_errors(ax, history)
        units = ax.twinx()
        units.set_ylabel("units")
        draw_units(units, history, {"color": "0.45", "linewidth": 1.0})
        ax.set_zorder(units.get_zorder() + 1)
        ax.patch.set_visible(False)  # else it hides the units, which lie behind
        draw_passes(ax, history)
        ax.set_xlabel("observation")
        return ax.figure  # type: ignore[return-value]
    from matplotlib.figure import Figure

    made = Figure(figsize=(7.2, 5.2), layout="constrained")
    errors, units = made.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
    _draw_errors(errors, history)
    draw_units(units, history, {"color": "0.35", "linewidth": 1.4})
    units.set(xlabel="observation", ylabel="units")
    _legend_of_marks(units, history)
    for axes in (errors, units):
        axes.spines[["top", "right"]].set_visible(False)
        draw_passes(axes, history)
        axes.grid(visible=True, alpha=0.18, linewidth=0.6)
    return made


def draw_units(axes: Axes, history: History, style: Mapping[str, Any], **options: Any) -> None:
    """Units after each observation, ▲ where one was added, ▼ where some were removed."""
    at = np.arange(1, history.units.size + 1)
    axes.step(at, history.units, where="post", **options, **style)
    for mark, events in (("^", history.grew > 0), ("v", history.pruned > 0)):
        rows = np.flatnonzero(events)
        axes.plot(
            at[rows],
            history.units[rows],
            mark,
            color=style["color"],
            markersize=4.5,
            markeredgewidth=0,
            alpha=0.85,
        )
    axes.set_ylim(bottom=0, top=max(axes.get_ylim()[1], 2.0, 1.15 * history.units.max(initial=0)))
    axes.yaxis.get_major_locator().set_params(integer=True)  # type: ignore[call-arg]  # MaxNLocator here


def draw_passes(axes: Axes, history: History, colour: str = "black") -> None:
    """A dotted line where each pass over the data ends."""
    if history.passes < 2 or not history.units.size:
        return
    for i in range(1, history.passes):
        at = i * history.units.size / history.passes
        axes.axvline(at, color=colour, alpha=0.22, linewidth=0.8, linestyle=(0, (1, 3)))


def _draw_errors(axes: Axes, history: History) -> None:
    """Error norms as dots, their running mean as a line, the held-out error as the line that counts."""
    at = np.arange(1, history.error.size + 1)
    axes.plot(
        at,
        _positive(history.error),
        ".",
        color=_BLUE,
        markersize=2.2,
        alpha=0.35,
        label="error before the update",
    )
    axes.plot(
        at, _positive(history.innovation), color=_BLUE, linewidth=1.3, label="its running mean, per output"
    )
    if history.heldout.size:
        axes.plot(
            at, _positive(history.heldout), color=_ORANGE, linewidth=1.8, label="held out, of full scale"
        )
    axes.set_yscale("log")
    axes.set_ylabel("error")
    _limit(axes, history)
    legend = axes.legend(fontsize="small", frameon=False, loc="upper right", ncols=3, markerscale=3)
    legend.set_zorder(5)


def _limit(axes: Axes, history: History) -> None:
    """Limits around what is positive, with room for the legend."""
    shown = np.concatenate([history.error, history.innovation, history.heldout])
    shown = shown[np.isfinite(shown) & (shown > 0)]
    if not shown.size:
        axes.set_ylim(1e-3, 1.0)
        return
    top = float(shown.max())
    bottom = max(float(np.quantile(shown, 0.005)), _DEEPEST * top)
    axes.set_ylim(0.6 * bottom, top * (top / bottom) ** 0.16 * 1.2)


def _positive(values: np.ndarray) -> np.ndarray:
    """Errors of exactly zero have no place on a logarithmic axis."""
    return np.where(values > 0, values, np.nan)


def _legend_of_marks(axes: Axes, history: History) -> None:
    text = f"▲ {int(history.grew.sum())} added   ▼ {int(history.pruned.sum())} removed"
    axes.text(0.995, 0.06, text, transform=axes.transAxes, ha="right", fontsize="small", color="0.3")
