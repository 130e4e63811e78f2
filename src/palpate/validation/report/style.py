"""Look of the pictures: one Matplotlib style, colours that colour-blind readers can tell apart, light and dark.

Ink is a placeholder colour that `inline_svg` turns into the page's text colour, and nothing is painted behind, so that
a figure follows the page from light to dark. Data colours have a lightness between the two, chosen from Okabe &
Ito 2008 ("Color universal design").
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
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
    "Picture",
    "figure",
    "inline_svg",
    "loads_map",
    "logarithmic",
    "picture",
    "series",
    "styled",
    "tidy_log",
]

INK = "#0a0b0c"
"""Stands for the page's text colour."""

BLUE, ORANGE, GREEN, PURPLE, SKY, GOLD = "#2f7fc1", "#d9642b", "#149b76", "#b565a7", "#4fb0e3", "#c99a1a"
SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, GOLD)
_HALF = 600  # px: the widest picture that one of two columns holds in readable size
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
    """Return a figure of no global state, and its axes as an array of shape (rows, columns)."""
    from matplotlib.figure import Figure

    made = Figure(figsize=size)
    return made, made.subplots(rows, columns, squeeze=False, **options)


def loads_map() -> Colormap:
    """Return the colours from small loads to large: blue to amber, readable on white and on near-black."""
    from matplotlib.colors import LinearSegmentedColormap

    stops = ["#3f63d6", "#8a5fcf", "#c85aa6", "#e36a6a", "#ec8f3c", "#e2b13a"]
    return LinearSegmentedColormap.from_list("palpate loads", stops)


def series(count: int) -> list[dict[str, Any]]:
    """Return colour and dash of each of `count` lines; dashes too, so that colour is never the only difference."""
    return [{"color": SERIES[i % 6], "linestyle": DASHES[(i + i // 6) % 6]} for i in range(count)]


def logarithmic(axes: Axes, which: Literal["x", "y"], low: float, high: float) -> None:
    """Make an axis logarithmic, labelled by powers of ten in plain text: no formula is set in an SVG."""
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
    """Make the y axis logarithmic around the values, at most `decades` deep: rounding noise below tells nothing."""
    positive = np.concatenate([np.ravel(v)[np.ravel(v) > 0] for v in values] or [np.empty(0)])
    positive = positive[np.isfinite(positive)]
    top, bottom = 1e-9, 1e-16  # errors of exactly zero lie below any such axis
    if positive.size:
        top = 10 ** np.ceil(np.log10(positive.max()) + 0.05)
        bottom = max(10 ** np.floor(np.log10(np.quantile(positive, 0.01))), top / 10**decades)
    logarithmic(axes, "y", bottom, top)


@dataclass(frozen=True)
class Picture:
    """A picture of the page: a key unique in it, a heading, what it shows for who cannot see it, and a caption."""

    key: str
    title: str
    alt: str
    caption: str
    svg: str

    @property
    def wide(self) -> bool:
        """It takes both columns of the page: in one it would have to be scrolled."""
        natural = re.search(r"--natural: (\d+)px", self.svg)
        return natural is not None and int(natural.group(1)) > _HALF


def inline_svg(figure: Figure, key: str, alt: str) -> str:
    """Return the figure as an ``<svg>`` element; `key`, of letters, digits and hyphens, is the prefix of every id."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", dpi=140, metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r' id="', f' id="{key}-', text)
    text = re.sub(r"url\(#", f"url(#{key}-", text)
    text = re.sub(r'(?:xlink:)?href="#', f'href="#{key}-', text)
    text = text.replace("xlink:href=", "href=").replace(INK, "currentColor")
    text = re.sub(r"'DejaVu Sans'(?:, sans-serif)?", "var(--sans)", text)
    return re.sub(r"<svg [^>]*>", lambda found: _opening(found.group(), alt), text, count=1)


def _opening(tag: str, alt: str) -> str:
    box = re.search(r'viewBox="([^"]*)"', tag)
    width = re.search(r'width="([\d.]+)', tag)
    assert box is not None, "Matplotlib always writes a view box"
    assert width is not None, "Matplotlib always writes a width"
    natural = f"--natural: {float(width.group(1)) / 0.75:.0f}px"
    return (
        f'<svg viewBox="{box.group(1)}" style="{natural}" role="img" aria-label="{escape(alt, quote=True)}">'
    )


def picture(key: str, title: str, alt: str, caption: str, draw: Callable[[], Figure]) -> Picture:
    """Draw one picture in the page's style; `alt` is what it shows for who cannot see it."""
    with styled(key):
        return Picture(key, title, alt, caption, inline_svg(draw(), key, alt))
