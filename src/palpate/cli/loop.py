"""`palpate run`: the real-time loop without a page."""

from __future__ import annotations

import contextlib
import sys
import time
from pathlib import Path

from palpate.cli.console import Console
from palpate.runtime import LoopProcess
from palpate.runtime.devices import device_traits
from palpate.runtime.pressed import PressedBody
from palpate.runtime.stability import stiffness_warning
from palpate.runtime.touchable import Touchable, load_touchable, workspace_for

__all__ = ["run_loop"]


def run_loop(model: Path, seconds: float, device: str, rate: float | None, console: Console) -> None:
    """Run a model's loop for a while and print its report."""
    touch, traits = load_touchable(model), device_traits(device)
    settings = touch.meta.get("runtime", {})
    rate = rate or settings.get("rate", 1000.0)
    workspace = workspace_for(touch, traits.radius)
    felt = workspace.felt(touch.stiffness_max)
    device = _aimed(device, touch, workspace.scale)
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


def _aimed(device: str, touch: Touchable, scale: float) -> str:
    """The scripted stroke, unless it is told where to go, presses where a body was trained to be pressed."""
    name, _, text = device.partition(":")
    if name != "stroke" or not isinstance(touch, PressedBody):
        return device
    given = {part.partition("=")[0].strip() for part in text.split(",") if part}
    axes = {"x", "y", "z"}
    known = {
        k: v for k, v in touch.stroke(scale).items() if k not in given and not (k in axes and given & axes)
    }
    return f"{name}:" + ",".join(
        [part for part in (text, *(f"{k}={v:.9g}" for k, v in known.items())) if part]
    )


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
