"""The score of an examination as one page: a line, a map of the body, tables, the force over time, the order."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable

import numpy as np

from palpate.experiments.append_record import jump_in_words
from palpate.experiments.exam_score import ExamScore, share_interval
from palpate.experiments.exam_touch import LEVELS, search_path, typical_force
from palpate.format import count, duration, millimetres

__all__ = ["map_of", "profile_of", "score_page"]

_WIDE, _MARGIN = 560.0, 16.0  # of the pictures, in their own units
_SHADES = ("#e6eaec", "#bcdcef", "#6fb0d8", "#1f6f9b")  # not pressed, and each of the levels
_UNIT = re.compile(r"(\d|⌀) (?=\d|(mm|cm|N|%|min|ms|s)\b|%)")  # a number and its unit stay on one line
_NEAR = 50.0  # of the map's units: marks whose numbers could meet
_MOST_BARS = 400  # of the force profile: more would not be seen

_STYLE = """
:root { color-scheme: light dark; --ink: #1d2730; --soft: #5d6b76; --line: #dfe4e6; --ground: #f5f6f4; --paper: #fff; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e8edf0; --soft: #9aaab5; --line: #2b363f; --ground: #12181d; --paper: #1a2229; }
}
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--ground); margin: 0 auto;
  max-width: 640px; padding: 20px 16px 48px; }
h1 { font-size: 24px; margin: 0 0 4px; } h2 { font-size: 17px; margin: 28px 0 8px; }
.soft { color: var(--soft); } .line { font-size: 19px; margin: 12px 0; }
svg { width: 100%; height: auto; background: #fff; border: 1px solid var(--line); }
table { border-collapse: collapse; width: 100%; } td, th { text-align: left; padding: 5px 10px 5px 0;
  border-bottom: 1px solid var(--line); font-variant-numeric: tabular-nums; }
th { font-weight: 600; color: var(--soft); }
.good { color: #2c7a4b; } .bad { color: #c8452a; }
.key span { display: inline-block; margin-right: 12px; }
.key i { display: inline-block; width: 14px; height: 14px; margin: 0 5px -2px 0; border: 1px solid #0002; }
svg .mark { paint-order: stroke; stroke: #fff; stroke-width: 4px; }
"""


def score_page(score: ExamScore) -> str:
    """Return the score as HTML without scripts."""
    title, order = html.escape(str(score.past.facts["title"])), score.order.words.capitalize()
    parts = [
        f"<h1>{title}</h1>",
        f'<p class="soft">{html.escape(_origin(score))}</p>',
        f'<p class="line"><strong>{html.escape(score.words)}</strong></p>',
        *(f'<p class="soft">{html.escape(note)}</p>' for note in _notes(score)),
        "<h2>Map of the body</h2>",
        map_of(score),
        _key(),
        "<h2>Lumps</h2>",
        _lump_table(score),
        *_groups(score),
        "<h2>False alarms</h2>",
        _alarms(score),
        "<h2>How it was pressed</h2>",
        _pressing(score),
        "<h2>Force over time</h2>",
        profile_of(score),
        "<h2>Order of search</h2>",
        f"<p>{html.escape(order)}. The line on the map is the way of the search, from the ring on.</p>",
    ]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}: score</title><style>{_STYLE}</style></head><body>{''.join(parts)}</body></html>"
    )


def _origin(score: ExamScore) -> str:
    facts = score.past.facts
    begun = str(facts["at"])[:16].replace("T", " ")
    return f"{score.past.name}, begun {begun} UTC, device: {facts.get('device', 'page')}"


def _notes(score: ExamScore) -> list[str]:
    notes = list(score.touch.notes)
    if score.past.facts.get("schematic"):
        notes.append(
            "The lumps of this body are schematic: their strength comes from a formula, not from solves."
        )
    notes += [
        f"{jump_in_words(jump)} meanwhile; times here are of one that doesn't." for jump in score.past.jumps
    ]
    breaks = sum(event["kind"] == "resumed" for event in score.past.events)
    if breaks:
        notes.append(f"It was interrupted {count(breaks, 'time')}; the time of the breaks is not counted.")
    return notes


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    top = "".join(f"<th>{cell}</th>" for cell in head)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return _UNIT.sub("\\1&nbsp;", f"<table><tr>{top}</tr>{body}</table>")


def _lump_table(score: ExamScore) -> str:
    if not score.results:
        return "<p>No lump was hidden.</p>"
    rows = []
    for result in score.results:
        if result.mark is None:
            outcome = '<span class="bad">missed</span>'
        else:
            off = millimetres(round(result.off, 3))
            outcome = f'<span class="good">found by mark {result.mark.number}</span>, {off} off'
        said = [
            f"{value} ({'right' if value == getattr(result, name) else 'wrong'})"
            for name in ("hardness", "depth")
            if result.mark is not None and (value := getattr(result.mark, name))
        ]
        sort = f"{result.hardness}, {result.depth}, {millimetres(round(result.at.cover, 4))} under the skin"
        rows.append((result.size, sort, outcome, ", ".join(said) or "–"))
    return _table(("lump", "which", "outcome", "said"), rows)


def _groups(score: ExamScore) -> list[str]:
    """Return sensitivity in all and by size, depth and hardness, with its interval."""
    hidden = len(score.results)
    if not hidden:
        return []
    rows = [("all", score.hits, hidden)]
    for name in ("size", "depth", "hardness"):
        rows += [(group, *hits) for group, hits in score.by(name).items()]
    cells = []
    for group, hits, whole in rows:
        low, high = share_interval(hits, whole)
        cells.append((group, f"{hits} of {whole}", f"{100 * low:.0f} to {100 * high:.0f} %"))
    return [
        "<h2>Sensitivity</h2>",
        _table(("lumps", "found", "95 % interval of the chance to find such"), cells),
    ]


def _alarms(score: ExamScore) -> str:
    alarms = [f"mark {mark.number}" for mark in score.false_alarms]
    return f"<p>{', '.join(alarms).capitalize()}.</p>" if alarms else "<p>None.</p>"


def _pressing(score: ExamScore) -> str:
    low, middle, high = typical_force(score.touch)
    deepest = score.surface.deepest
    rows = [
        (f"area pressed {name} (from {millimetres(round(LEVELS[name] * deepest, 4))})", f"{100 * part:.0f} %")
        for name, part in score.area_shares.items()
    ]
    presses = len(score.touch.presses)
    rows += [
        ("presses", str(presses)),
        ("largest force of a press, half of them", f"{middle:.2f} N" if presses else "–"),
        ("from the tenth to nine tenths of them", f"{low:.2f} to {high:.2f} N" if presses else "–"),
        ("time", duration(score.seconds)),
        ("of it in touch", duration(score.touch.seconds_in_contact) if presses else "–"),
    ]
    return _table(("", ""), rows)


def _key() -> str:
    names = ["not pressed", *LEVELS]
    shades = "".join(
        f'<span><i style="background:{shade}"></i>{name}</span>'
        for shade, name in zip(_SHADES, names, strict=True)
    )
    return (
        f'<p class="soft key">{shades}<br>Circles: lumps, green where found, red where missed. Crosses with numbers: '
        "marks. Only the area that can be pressed is coloured.</p>"
    )


def map_of(score: ExamScore) -> str:
    """Return the map of the body as SVG: how deep each place was pressed, lumps, marks, and the way of the search."""
    surface = score.surface
    flat = surface.points @ surface.axes.T
    part = surface.reachable[surface.triangles].all(axis=1)
    seen = flat[surface.triangles[part]].reshape(-1, 2) if part.any() else flat
    low, high = seen.min(axis=0), seen.max(axis=0)
    scale = (_WIDE - 2 * _MARGIN) / max(float((high - low).max()), 1e-9)
    tall = float((high - low)[1]) * scale + 2 * _MARGIN

    def place(points: np.ndarray) -> np.ndarray:
        moved: np.ndarray = (np.atleast_2d(points) - low) * scale + _MARGIN
        moved[:, 1] = tall - moved[:, 1]
        return moved

    drawn = [
        f'<svg viewBox="0 0 {_WIDE:.0f} {tall:.0f}" role="img" aria-label="Map of the body">',
        *_shade(place(flat), surface.triangles[part], score.depths / surface.deepest),
        *_way(place(search_path(score.touch, surface.radius)[0] @ surface.axes.T)),
    ]
    for result in score.results:
        (x, y), r = place(result.at.above @ surface.axes.T)[0], result.lump.radius * scale
        colour = "#2c7a4b" if result.mark is not None else "#c8452a"
        drawn.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}" fill="{colour}33" stroke="{colour}" stroke-width="2.5"/>'
        )
    drawn += _crosses(
        [(mark.number, *place(np.array(mark.place) @ surface.axes.T)[0]) for mark in score.marks]
    )
    return "".join([*drawn, "</svg>"])


def _crosses(marks: list[tuple[int, float, float]]) -> list[str]:
    """Return marks as crosses, each with its number on the side that is away from the nearest other mark."""
    drawn = []
    for number, x, y in marks:
        others = [(np.hypot(a - x, b - y), a) for other, a, b in marks if other != number]
        side = -1 if others and min(others) < (_NEAR, 0.0) and min(others)[1] > x else 1
        cross = f"M{x - 6:.1f} {y - 6:.1f}l12 12m-12 0l12 -12"
        drawn += [
            f'<path d="{cross}" stroke="{ink}" stroke-width="{wide}"/>'
            for ink, wide in (("#fff", 6), ("#1d2730", 2.5))
        ]
        drawn.append(
            f'<text class="mark" x="{x + 10 * side:.1f}" y="{y + 7:.1f}" font-size="19" font-weight="700" '
            f'text-anchor="{"start" if side > 0 else "end"}">{number}</text>'
        )
    return drawn


def _shade(at: np.ndarray, triangles: np.ndarray, shares: np.ndarray) -> list[str]:
    """Return the triangles of each shade as one path."""
    levels = np.digitize(shares[triangles].mean(axis=1), list(LEVELS.values()))
    paths = []
    for level, shade in enumerate(_SHADES):
        ways = [
            f"M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}L{c[0]:.1f} {c[1]:.1f}Z"
            for a, b, c in at[triangles[levels == level]]
        ]
        if ways:
            paths.append(f'<path d="{"".join(ways)}" fill="{shade}" stroke="{shade}" stroke-width="0.6"/>')
    return paths


def _way(at: np.ndarray) -> list[str]:
    if not len(at):
        return []
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in at)
    return [
        f'<polyline points="{points}" fill="none" stroke="#9a6200" stroke-width="1.4" opacity="0.75"/>',
        f'<circle cx="{at[0, 0]:.1f}" cy="{at[0, 1]:.1f}" r="5" fill="none" stroke="#9a6200" stroke-width="2"/>',
    ]


def profile_of(score: ExamScore) -> str:
    """Return the largest force of each moment over the time as SVG."""
    touch, tall = score.touch, 150.0
    if not len(touch.time) or not touch.force.max() > 0:
        return "<p>Nothing was pressed.</p>"
    end, most = float(touch.time[-1]) or 1.0, float(touch.force.max())
    slots = np.minimum((touch.time / end * _MOST_BARS).astype(int), _MOST_BARS - 1)
    largest = np.zeros(_MOST_BARS)
    np.maximum.at(largest, slots, touch.force)
    wide, high = _WIDE - 2 * _MARGIN, tall - 2 * _MARGIN
    points = " ".join(
        f"{_MARGIN + wide * (k + 0.5) / _MOST_BARS:.1f},{tall - _MARGIN - high * f / most:.1f}"
        for k, f in enumerate(largest)
    )
    return (
        f'<svg viewBox="0 0 {_WIDE:.0f} {tall:.0f}" role="img" aria-label="Force over time">'
        f'<polyline points="{points}" fill="none" stroke="#1f6f9b" stroke-width="1.3"/>'
        f'<text x="{_MARGIN}" y="14" font-size="16" fill="#5d6b76">{most:.2f} N</text>'
        f'<text x="{_WIDE - _MARGIN}" y="{tall - 2}" font-size="16" fill="#5d6b76" text-anchor="end">'
        f"{duration(end)}</text></svg>"
    )
