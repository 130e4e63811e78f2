"""The live view of `palpate learn --watch`: units in input space, the error and the number of units in a terminal.

At the end the page that plays the growth is written.
"""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.cli.console import Console
from palpate.format import count, scientific

if TYPE_CHECKING:
    from rich.console import Group

    from palpate.learning.growth_frames import GrowthRecorder

__all__ = ["growth_lines", "watch_growth"]

WIDTH, HEIGHT = 60, 12  # characters of the map
EVERY = 0.1  # s between pictures
BLOCKS = "▁▂▃▄▅▆▇█"
GREW, VANISHED, UNIT, SAMPLE = "◉", "×", "●", "·"
NAMES = 18  # characters of the column of names


@contextlib.contextmanager
def watch_growth(page: Path | None, name: str, console: Console) -> Iterator[GrowthRecorder | None]:
    """Yield a recorder whose growth is shown in a terminal, and written as a page in the end; None without a page.

    The name is that of the body, for headings; a console whose output is JSON shows nothing.
    """
    if page is None:
        yield None
        return
    from palpate.learning.growth_frames import GrowthRecorder
    from palpate.validation.report.growth_page import write_growth_page

    recorder = GrowthRecorder()
    if sys.stderr.isatty() and not console.as_json:
        with _live(recorder, name):
            yield recorder
    else:
        yield recorder
    if recorder.frames:
        write_growth_page(page, recorder, name)


@contextlib.contextmanager
def _live(recorder: GrowthRecorder, name: str) -> Iterator[None]:
    from rich.console import Console as Rich
    from rich.live import Live

    last = 0.0
    with Live(console=Rich(stderr=True), auto_refresh=False, transient=False) as live:

        def show(growth: GrowthRecorder) -> None:
            nonlocal last
            ended = len(growth.errors) == growth.total
            if not ended and time.monotonic() - last < EVERY:
                return
            last = time.monotonic()
            live.update(_picture(growth, name), refresh=True)

        recorder.show = show
        try:
            yield
        finally:
            recorder.show = None


def _picture(growth: GrowthRecorder, name: str) -> Group:
    from rich.console import Group
    from rich.text import Text

    colours = {GREW: "bold green", VANISHED: "bold red", UNIT: "bold cyan", SAMPLE: "dim"}
    lines = []
    for line in growth_lines(growth, name):
        text = Text(line)
        if line.startswith("│"):
            for mark, style in colours.items():
                text.highlight_words([mark], style)
        lines.append(text)
    return Group(*lines)


def growth_lines(growth: GrowthRecorder, name: str) -> list[str]:
    """Return the picture of the growth so far as lines of text."""
    done, units = len(growth.errors), growth.counts[-1] if growth.counts else 0
    grown = sum(frame.grew is not None for frame in growth.frames)
    pruned = sum(len(frame.vanished) for frame in growth.frames)
    error = growth.errors[-1] if growth.errors else math.nan
    what = "on unseen solves" if growth.heldout else "of the next sample"
    share = done / growth.total if growth.total else 0.0
    return [
        f"{name}: observation {done} of {growth.total} ({share:.0%}), {count(units, 'unit')}; "
        f"{grown} appeared, {pruned} vanished",
        *_map(growth),
        f"{'error, log':<{NAMES}}{_spark(np.log10(np.maximum(growth.errors, 1e-12)))} {scientific(error)} {what}",
        f"{'units':<{NAMES}}{_spark(growth.counts)} {units}",
        f"{UNIT} unit  {GREW} appeared  {VANISHED} vanished  {SAMPLE} sample",
    ]


def _map(growth: GrowthRecorder) -> list[str]:
    """Return the input space in a frame: of one input a strip, of several the first two."""
    frame, inputs = growth.latest, growth.inputs
    rows = 1 if len(inputs) < 2 else HEIGHT
    marks = np.full((rows, WIDTH), " ")

    def put(places: np.ndarray, mark: str) -> None:
        for place in np.atleast_2d(places) if len(places) else ():
            cells = [
                (place[k] - r.low) / (r.high - r.low) * (size - 1) if np.isfinite(place[k]) else -1.0
                for k, (r, size) in enumerate(zip(inputs[:2], (WIDTH, rows), strict=False))
            ]
            column, row = round(cells[0]), round(cells[1]) if rows > 1 else 0
            if 0 <= column < WIDTH and 0 <= row < rows:
                marks[rows - 1 - row, column] = mark

    put(growth.samples[0][:400], SAMPLE)
    if frame is not None:
        put(frame.centres, UNIT)
        put(frame.vanished, VANISHED)
        if frame.grew is not None:
            put(frame.grew, GREW)
    edges = [f"{r.name} {r.low:g} … {r.high:g} {r.unit}".rstrip() for r in inputs[:2]]
    title = f" {edges[0]} →" + (f"   {edges[1]} ↑" if len(edges) > 1 else "")
    return [title, f"┌{'─' * WIDTH}┐", *(f"│{''.join(row)}│" for row in marks), f"└{'─' * WIDTH}┘"]


def _spark(values: Sequence[float] | np.ndarray) -> str:
    """Return a curve of blocks, as wide as the map less its name."""
    width = WIDTH - NAMES + 2
    values = np.asarray(values, dtype=float)
    if not len(values):
        return " " * width
    picked = values[np.linspace(0, len(values) - 1, width).astype(int)]
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    steps = (picked - low) / (high - low) * (len(BLOCKS) - 1) if high > low else np.zeros(width)
    return "".join(BLOCKS[int(s)] if np.isfinite(s) else " " for s in steps)
