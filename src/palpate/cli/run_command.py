"""`palpate run`: the real-time loop without a page."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from palpate.cli.console import Console
from palpate.cli.live_table import live_table
from palpate.cli.terminal_keys import RESUME, STOP, Keys, terminal_keys
from palpate.devices import device_traits, hand_kind
from palpate.format import duration, share
from palpate.runtime import LoopProcess
from palpate.runtime.shared_state import State
from palpate.runtime.touchable import load_touchable
from palpate.runtime.warm_up import WarmUp
from palpate.surrogates.training_record import correction_warning

__all__ = ["run_loop"]

LOOK = 0.02  # s between two looks at the loop
_WHOLE = 0.95  # share of the nominal ticks from which on none is missed by a person who counts
_REFRESH = 10.0  # Hz, of the live table
_HEEDED = 0.2  # change of the spring in front of a stiff body from which on it is said again: a tenth is hardly felt


@dataclass
class _Peak:
    """Course of a run: its times, the largest force (N) and depth (m), and how often the hand was beyond training."""

    force: float = 0.0
    depth: float = -math.inf
    looks: int = 0
    outside: int = 0
    let_go: int = 0
    start: float = 0.0  # s until the first tick
    seconds: float = 0.0  # s from then on

    def see(self, state: State) -> None:
        """Take one look at the loop."""
        self.force = max(self.force, math.hypot(*state.force))
        self.depth = max(self.depth, state.depth)
        self.looks += 1
        self.outside += not state.inside
        self.let_go += state.let_go and not state.waiting

    def timing(self, *, slow: bool) -> str:
        """Return in a line how long the loop ran and started; `slow` says that ticks are missing for its rate."""
        slower = "; it ticks slower while nobody touches" if slow else ""
        return f"  time       {duration(self.seconds)}, after {duration(self.start)} to start{slower}"

    def words(self, *, holds: bool) -> str:
        """Return the figures as lines for a person; `holds` says whether the device held the body."""
        if self.force == 0.0:
            return "  felt       nothing: the device did not reach the body"
        words = f"  felt       up to {self.force:.3g} N"
        if self.depth > 0.0:
            words += f", {1e3 * self.depth:.3g} mm {'from rest' if holds else 'deep'}"
        if self.outside:
            words += (
                f"\n  trust      outside what was trained for {share(self.outside / self.looks)} of the time"
            )
        if self.let_go:
            words += f", so deep that the body let go for {share(self.let_go / self.looks)}"
        return words

    def as_dict(self) -> dict[str, float]:
        """Return the figures as data for a program."""
        looks = max(self.looks, 1)
        return {
            "largest_force": self.force,
            "largest_depth": max(self.depth, 0.0),
            "outside": self.outside / looks,
            "let_go": self.let_go / looks,
            "seconds": self.seconds,
            "start_seconds": self.start,
        }


def run_loop(
    model: Path,
    seconds: float,
    device: str,
    rate: float | None,
    console: Console,
    *,
    unsoftened: bool = False,
    controller: bool = True,
    dead_man: bool = False,
    record: Path | None = None,
    friction: float | None = None,
    max_force: float | None = None,
    max_torque: float | None = None,
) -> None:
    """Run a model's loop for a while, in s, and print its report.

    The device is its name, with its options after a colon; the rate (Hz) is by default the body's own, or 1000.
    `unsoftened` lets a body that is too stiff for the device feel so all the same, `controller` lets the passivity
    controller damp, and with `dead_man` the force acts only while the device's first button is held. `record` is a new
    file that takes every tick; if it stops by itself the loop runs on, and a `ResourceError` follows the report. A
    coefficient of `friction` of the tool, and limits of force (N) and torque (N m), take the place of the file's.
    """
    touch = load_touchable(model, friction)
    device_traits(device)  # a name that is none is refused before anything is compiled
    settings = touch.meta.get("runtime", {})
    rate = rate or settings.get("rate", 1000.0)
    if warning := correction_warning(touch.meta):
        console.say(f"its correction was warned of: {warning}")
    peak = _Peak()
    began = time.monotonic()
    warm_up = WarmUp("loop", body=touch)
    if warm_up.words:
        console.say(f"{warm_up.words} …")
    # whoever stops it early still wants to know
    with (
        warm_up,
        LoopProcess(
            model,
            device=device,
            rate=rate,
            max_force=max_force or settings.get("max_force"),
            max_torque=max_torque or settings.get("max_torque"),
            unsoftened=unsoftened,
            controller=controller,
            dead_man=dead_man,
            record=record,
            aim=True,
            friction=friction,
        ) as loop,
        contextlib.suppress(KeyboardInterrupt),
        terminal_keys() as keys,
        _shown(loop, console, keys, holds=touch.holds) as show,
    ):
        peak.start = time.monotonic() - began
        console.say(f"The loop runs for {duration(seconds)}; it took {duration(peak.start)} to start.")
        _wait(loop, seconds, console, peak, keys, show)
    report = loop.report()  # after the end: only then is it known what the system granted
    words, facts = _recording(loop)
    slow = report.ticks < _WHOLE * rate * peak.seconds
    text = f"{report}\n{peak.timing(slow=slow)}\n{peak.words(holds=touch.holds)}{words}"
    console.result(text, report.as_dict() | peak.as_dict() | facts)
    if loop.recording is not None and loop.recording.error is not None:
        raise loop.recording.error


def _recording(loop: LoopProcess) -> tuple[str, dict[str, object]]:
    """Return in words and as data what was recorded; nothing where nothing was."""
    recording = loop.recording
    if recording is None:
        return "", {}
    lost = f", {recording.lost} lost" if recording.lost else ""
    words = f"\n  recorded   {recording.ticks} ticks{lost}, {recording.size / 1e6:.2f} MB in {recording.path}"
    facts = {
        "file": str(recording.path),
        "ticks": recording.ticks,
        "lost": recording.lost,
        "bytes": recording.size,
    }
    return words, {"recording": facts}


@contextlib.contextmanager
def _shown(
    loop: LoopProcess, console: Console, keys: Keys, *, holds: bool
) -> Iterator[Callable[[State], None]]:
    """Give a function that shows a tick in a terminal, in a table that is renewed in place; elsewhere it is quiet."""
    if console.as_json or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console as Rich
    from rich.live import Live

    options = {"holds": holds, "hand": hand_kind(loop.device), "keys": keys.heard}
    first = live_table(loop.read(), **options)
    with Live(first, console=Rich(stderr=True), refresh_per_second=_REFRESH) as live:
        yield lambda state: live.update(live_table(state, **options))


def _wait(
    loop: LoopProcess,
    seconds: float,
    console: Console,
    peak: _Peak,
    keys: Keys,
    show: Callable[[State], None],
) -> None:
    """Look at the force while the loop runs, show it, and heed the keys."""
    began = time.monotonic()
    end, shown = began + seconds, -math.inf
    coupling = math.nan  # nothing was said yet
    if note := loop.report().device_note:
        console.say(f"{note}.")
    while (left := end - time.monotonic()) > 0:
        time.sleep(min(left, LOOK))
        if wish := keys.wish():
            loop.shared.write_command(stop=wish == STOP, resume=wish == RESUME)
        state = loop.read()
        peak.see(state)
        peak.seconds = time.monotonic() - began
        with_motors = state.felt_stiffness.damping is not None
        if with_motors and not math.isclose(state.coupling, coupling, rel_tol=_HEEDED):
            coupling = state.coupling
            console.say(" ".join([f"{state.felt_stiffness}.", *state.felt_stiffness.cautions]))
        if end - left - shown > 1.0 / _REFRESH:
            shown = end - left
            show(state)
