"""`palpate run`: the real-time loop without a page."""

from __future__ import annotations

import contextlib
import sys
import time
from pathlib import Path

from palpate.cli.console import Console
from palpate.runtime import LoopProcess, Workspace
from palpate.runtime.devices import device_traits
from palpate.runtime.stability import stiffness_warning
from palpate.surrogates import TouchModel

__all__ = ["run_loop"]


def run_loop(model: Path, seconds: float, device: str, rate: float | None, console: Console) -> None:
    """Run a model's loop for a while and print its report."""
    touch, traits = TouchModel.load(model), device_traits(device)
    settings = touch.meta.get("runtime", {})
    rate = rate or settings.get("rate", 1000.0)
    felt = Workspace.for_reach(traits.radius, touch.reach).felt(touch.stiffness_max)
    if warning := stiffness_warning(felt, traits.damping, rate):
        console.say(warning)
    limit = settings.get("max_force")
    # whoever stops it early still wants to know
    with (
        LoopProcess(model, device=device, rate=rate, max_force=limit) as loop,
        contextlib.suppress(KeyboardInterrupt),
    ):
        _wait(loop, seconds, console)
    report = loop.report()  # after the end: only then is it known what the system granted
    console.result(str(report), report.as_dict())


def _wait(loop: LoopProcess, seconds: float, console: Console) -> None:
    """Show the force while the loop runs, in a terminal."""
    end = time.monotonic() + seconds
    shown = sys.stderr.isatty() and not console.as_json
    while (left := end - time.monotonic()) > 0:
        time.sleep(min(left, 0.2))
        if shown:
            state = loop.read()
            print(f"\r  force {_vector(state.force)} N   tick {state.tick}", end="", file=sys.stderr)  # noqa: T201
    if shown:
        print(file=sys.stderr)  # noqa: T201


def _vector(values: object) -> str:
    return " ".join(f"{v:+7.3f}" for v in values)  # type: ignore[attr-defined]
