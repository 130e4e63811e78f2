"""A Matplotlib figure as part of a page: SVG without a file's preamble, in the page's colours and fonts."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

from palpate.validation.report.style import INK

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Picture", "inline_svg"]


@dataclass(frozen=True)
class Picture:
    """A figure of the page: a key unique in it, a heading, what it shows for who cannot see it, and a caption."""

    key: str
    title: str
    alt: str
    caption: str
    svg: str


def inline_svg(figure: Figure, key: str, alt: str) -> str:
    """The figure as an ``<svg>`` element for a page that holds many.

    Parameters
    ----------
    figure : Figure
    key : str
        Prefix of every id; letters, digits and hyphens.
    alt : str
        Text in its place for who cannot see it.
    """
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
