"""How figures look: one Matplotlib style, colours that colour-blind readers can tell apart, light and dark.

Ink is a placeholder colour that `svg` turns into the page's text colour, and nothing is painted behind, so that
a figure follows the page from light to dark. Data colours have a lightness between the two, chosen from Okabe &
Ito 2008 ("Color universal design").
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from palpate.format import power_of_ten

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

__all__ = [
    "BLUE",
    "INK",
    "ORANGE",
    "SERIES",
    "figure",
    "loads_map",
    "logarithmic",
    "series",
    "styled",
    "tidy_log",
]

INK = "#0a0b0c"
"""Stands for the page's text colour."""

BLUE, ORANGE, GREEN, PURPLE, SKY, GOLD = "#2f7fc1", "#d9642b", "#149b76", "#b565a7", "#4fb0e3", "#c99a1a"
SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, GOLD)
DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)), (0, (6, 1.5, 1.5, 1.5)), (0, (3, 1)), (0, (8, 2)))

_STYLE: dict[str, Any] = {
    "figure.constrained_layout.use": True,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
    "svg.fonttype": "none",  # text stays text: it can be read aloud, searched and recoloured
    "text.parse_math": False,  # names come from files; a dollar sign in one is no formula
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.linewidth": 0.6,
    "grid.alpha": 0.14,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.4,
    "lines.solid_capstyle": "round",
    "path.simplify": True,
    "axes.unicode_minus": True,
    **dict.fromkeys(
        ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color", "grid.color"), INK
    ),
}


@contextmanager
def styled(key: str) -> Iterator[None]:
    """Draw and save in this style; `key` makes the names inside the SVG its own, the same in every run."""
    import matplotlib as mpl

    settings: Any = {**_STYLE, "svg.hashsalt": f"palpate {key}"}
    with mpl.rc_context(settings):
        yield


def figure(
    rows: int = 1, columns: int = 1, *, size: tuple[float, float], **options: Any
) -> tuple[Figure, Any]:
    """A figure of its own, of no global state, and its axes as an array of shape (rows, columns)."""
    from matplotlib.figure import Figure

    made = Figure(figsize=size)
    return made, made.subplots(rows, columns, squeeze=False, **options)


def loads_map() -> Colormap:
    """From small loads to large: blue to amber, lightness rising, readable on white and on near-black."""
    from matplotlib.colors import LinearSegmentedColormap

    stops = ["#3f63d6", "#8a5fcf", "#c85aa6", "#e36a6a", "#ec8f3c", "#e2b13a"]
    return LinearSegmentedColormap.from_list("palpate loads", stops)


def series(count: int) -> list[dict[str, Any]]:
    """Colour and dash of each of `count` lines; dashes too, so that colour is never the only difference."""
    return [{"color": SERIES[i % 6], "linestyle": DASHES[(i + i // 6) % 6]} for i in range(count)]


def logarithmic(axes: Axes, which: Literal["x", "y"], low: float, high: float) -> None:
    """A logarithmic axis labelled by powers of ten in plain text, which stays readable where no formula is set."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

    # limits first: data that are all zero leave a logarithmic axis nothing to choose them by
    axes.set(**{f"{which}lim": (low, high)})
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(numticks=8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())


def tidy_log(axes: Axes, values: Sequence[np.ndarray], decades: float = 9.0) -> None:
    """A logarithmic y axis around the values, at most `decades` deep: rounding noise below tells nothing."""
    positive = np.concatenate([np.ravel(v)[np.ravel(v) > 0] for v in values] or [np.empty(0)])
    positive = positive[np.isfinite(positive)]
    top, bottom = 1e-9, 1e-16  # errors of exactly zero lie below any such axis
    if positive.size:
        top = 10 ** np.ceil(np.log10(positive.max()) + 0.05)
        bottom = max(10 ** np.floor(np.log10(np.quantile(positive, 0.01))), top / 10**decades)
    logarithmic(axes, "y", bottom, top)
