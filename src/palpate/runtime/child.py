"""The real-time process: ``python -m palpate.runtime MODEL --state NAME --device page``.

Started by `LoopProcess`, which holds this process's standard input: its end of file means that the parent is
gone, whatever the operating system and however it went. On it come the surrogates that shall take the place of the one
in the hand (`swap_desk`), a line of JSON each. Standard output carries lines of JSON: one when the loop is about to
run, one for each such wish, and one when the loop has run.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence

from palpate.errors import PalpateError, UsageError
from palpate.network.kinds import import_when_needed
from palpate.runtime.devices import Device, device_named
from palpate.runtime.loop import Loop
from palpate.runtime.realtime import obtain
from palpate.runtime.recording import Ring, TickRecorder
from palpate.runtime.rehearsal import Rehearsal
from palpate.runtime.replay import is_recorded_model, loop_facts, play
from palpate.runtime.safety import Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.swap_desk import SwapDesk
from palpate.runtime.touchable import aim_device, load_touchable
from palpate.runtime.trace_file import read_trace

__all__ = ["FOREIGN", "main"]

FOREIGN = ("scipy", "ngsolve", "matplotlib", "xarray", "dask", "distributed", "sklearn", "typer", "rich",
           "pydantic", "pint", "zarr", "starlette")  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the loop; the exit code is that of the error, 0 without one."""
    options = _parser().parse_args(arguments)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole terminal: the parent decides
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))  # unwinds through the loop's own clean-up
    try:
        return _run(options)
    except PalpateError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m palpate.runtime", description="The 1 kHz loop of palpate.")
    parser.add_argument("model", help="surrogate, a .palpate file")
    parser.add_argument("--state", required=True, help="name of the shared memory")
    parser.add_argument("--ring", default="", help="name of the ring for recordings")
    parser.add_argument("--replay", default="", help="recorded touch to go through, instead of a device")
    parser.add_argument("--device", default="page", help="name, or name:key=value,key=value")
    parser.add_argument("--rate", type=float, default=1000.0, help="Hz")
    parser.add_argument("--radius", type=float, required=True, help="workspace, m")
    parser.add_argument("--max-force", type=float, required=True, help="N")
    parser.add_argument("--slew", type=float, default=0.0, help="N/s; 0: full force in 20 ms")
    parser.add_argument(
        "--unsoftened", action="store_true", help="a body too stiff for the device feels so all the same"
    )
    parser.add_argument("--no-controller", action="store_true", help="the passivity controller only counts")
    parser.add_argument("--aim", action="store_true", help="a stroke presses where the body was trained")
    parser.add_argument(
        "--dead-man", action="store_true", help="force only while the device's first button is held"
    )
    parser.add_argument(
        "--module", action="append", default=[], help="imported for a file of an unknown kind"
    )
    return parser


def _run(options: argparse.Namespace) -> int:
    shared = Shared.attach(options.state)
    shared.unlink()  # both sides have it: from here on no kind of death can leave it behind
    desk = SwapDesk(_say)
    orphaned = _watch_parent(desk.ask)
    import_when_needed(options.module)
    model = load_touchable(options.model)
    if options.replay:
        trace = read_trace(options.replay)
        play(trace, model, shared, orphaned, same=is_recorded_model(trace, options.model))
        return 0
    if options.aim:
        options.device = aim_device(options.device, model)
    recorder = None
    if options.ring:
        ring = Ring.attach(options.ring)
        ring.unlink()
        recorder = TickRecorder(ring)
    device = _open(options, shared)
    traits, radius, max_force = device.traits, options.radius, options.max_force
    if traits.damping is not None:  # motors: what the opened device says of itself may not be exceeded
        radius, max_force = min(radius, traits.radius), min(max_force, traits.max_force)
    workspace = model.workspace(radius)
    limits = Limits(max_force, options.slew, continuous=traits.continuous_force)
    loop = Loop(
        model,
        device,
        shared,
        workspace,
        limits,
        rate=options.rate,
        stiffness=model.stiffness_max if traits.damping is not None else 0.0,
        override=options.unsoftened,
        control=not options.no_controller,
        dead_man=options.dead_man,
        orphaned=orphaned,
        recorder=recorder,
    )
    loop.out.device(traits.name or options.device.partition(":")[0])
    if recorder is not None:
        recorder.ring.describe(loop_facts(model, loop, limits) | {"device": options.device})
        recorder.begin(loop)
    _say({"obtained": obtain(), "device_note": _note(device)})
    rehearsal = Rehearsal(model, workspace, limits, options.rate)
    desk.serve(model, loop, limits, rehearsal)
    loop.run(rehearsal)
    foreign = [name for name in FOREIGN if sys.modules.get(name)]
    _say({"foreign": foreign, "device_error": loop.device_error, "device_note": _note(device)})
    return 0


def _open(options: argparse.Namespace, shared: Shared) -> Device:
    """Open the device, and refuse one that has no button to hold where one is asked for."""
    device = device_named(options.device, shared.command)
    if options.dead_man and not device.traits.buttons:
        device.close()
        raise UsageError(
            f"{device.traits.name or options.device} has no button to hold.",
            why="A dead-man button is the first button of a device, or of its grips, that none of its options takes.",
            fix="Connect and wake the grip that has one, or leave the dead-man button out.",
        )
    return device


def _note(device: Device) -> str:
    """Return what a driver says besides its faults; see `Device`."""
    return str(getattr(device, "note", ""))


def _watch_parent(hear: Callable[[str], None]) -> Callable[[], bool]:
    """Hear each line of the standard input, until it ends; return whether it has."""
    gone = threading.Event()

    def wait() -> None:
        rest = b""
        try:
            while data := os.read(0, 4096):
                *lines, rest = (rest + data).split(b"\n")
                for line in lines:
                    hear(line.decode())
        except OSError:
            pass
        gone.set()

    threading.Thread(target=wait, daemon=True).start()  # sleeps in the system: costs the loop nothing
    return gone.is_set


def _say(message: dict[str, object]) -> None:
    try:
        sys.stdout.write(json.dumps(message) + "\n")
        sys.stdout.flush()
    except OSError:
        pass  # the parent is gone; the watch sees to it
