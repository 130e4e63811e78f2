"""The live table of `palpate run`: what the loop, the device and the hand do now, by the rules of `palpate.format`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from palpate.devices.hand_kind import HandKind
from palpate.format import length, plain
from palpate.runtime.safety import Fault

if TYPE_CHECKING:
    from rich.table import Table

    from palpate.runtime.shared_state import State

__all__ = ["live_rows", "live_table"]


def live_rows(
    state: State, *, holds: bool, hand: HandKind = HandKind.DEVICE, keys: bool = False
) -> tuple[tuple[str, str], ...]:
    """Return the table's rows for the newest tick: a name, and figures in words.

    `holds` tells that the device holds the body, and doesn't press it; `hand` who moves it; `keys` that keys of the
    terminal are heard.
    """
    rows = [
        ("loop", _loop(state)),
        ("device", f"{state.device or 'device'}: {_doing(state, hand)}"),
        ("force", f"{plain(math.hypot(*state.force), 3)} N, at most {plain(state.max_force, 3)} N"),
        ("displaced" if holds else "depth", _depth(state, holds=holds)),
        ("energy", f"{_millijoules(state.energy)}, lowest {_millijoules(state.energy_lowest)}"),
        ("added damping", f"{plain(state.added_damping, 3)} N·s/m"),
        ("flags", ", ".join(_flags(state)) or "none"),
        ("faults", _faults(state)),
    ]
    if keys:
        rows.append(("keys", "Esc or space stops the force, r resumes it, Ctrl-C ends"))
    return tuple(rows)


def live_table(state: State, **options: Any) -> Table:
    """Return the rows as a table for a terminal; the options are those of `live_rows`."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    for name, words in live_rows(state, **options):
        alarm = name == "device" and bool(state.reason())
        table.add_row(name, Text(words, style="bold red" if alarm else ""))
    return table


def _loop(state: State) -> str:
    rate = f"{state.rate:.0f} Hz"
    if state.idle:
        rate += " while nobody touches"
    late = f"{1e6 * state.lateness_p50:.0f} µs late at the median, {1e6 * state.lateness_p99:.0f} µs at p99"
    return f"{rate}, of {state.nominal_rate:.0f} Hz; {late}"


def _doing(state: State, hand: HandKind) -> str:
    if reason := state.reason(hand):
        return reason
    if not state.grabbed:
        return "no hand"
    return "pushing" if state.force.any() else "touching nothing"


def _depth(state: State, *, holds: bool) -> str:
    if holds or state.depth > 0.0:
        return length(state.depth)
    return "in the air" if state.depth < 0.0 else "none"


def _millijoules(energy: float) -> str:
    return f"{plain(1e3 * energy, 3).replace('-', '−')} mJ"


def _flags(state: State) -> list[str]:
    soft = state.felt_stiffness
    words = {
        "outside what was trained": state.grabbed and not state.inside and not state.let_go,
        "so deep that the body has let go": state.let_go,
        "force limit": state.clamped,
        "input too old": state.stalled and state.grabbed,
        f"softened to {soft.felt:.0f} N/m": soft.felt < soft.body,
        "stiffer than the device bears": soft.override and soft.body > soft.bound,
    }
    return [name for name, on in words.items() if on]


def _faults(state: State) -> str:
    counts = [(int(state.fault_counts[f]), f.name.lower().replace("_", " ")) for f in Fault]
    words = ", ".join(f"{count} × {name}" for count, name in counts if count)
    if state.onsets:
        words += f"; the last one {plain(max(0.0, state.time - state.onsets[-1][0]))} s ago"
    return words or "none"
