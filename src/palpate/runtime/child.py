"""The real-time process: ``python -m palpate.runtime OPTIONS``, which are an object of JSON.

Started by `LoopProcess`, which writes the options and holds this process's standard input: its end of file means that
the parent is gone, whatever the operating system and however it went. On it come the surrogates that shall take the
place of the one in the hand (`swap_desk`), a line of JSON each. Standard output carries lines of JSON: one when the
loop is about to run, one for each such wish, and one when the loop has run.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from types import SimpleNamespace

from palpate.devices import Device, device_named
from palpate.devices.trace_file import read_trace
from palpate.errors import PalpateError, UsageError
from palpate.network.kinds import import_when_needed
from palpate.runtime.loop import Loop
from palpate.runtime.realtime import obtain
from palpate.runtime.recording import Ring, TickRecorder
from palpate.runtime.rehearsal import Rehearsal
from palpate.runtime.replay import is_recorded_model, loop_facts, play
from palpate.runtime.safety import Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.swap_desk import SwapDesk
from palpate.runtime.touchable import aim_device, load_touchable

__all__ = ["FOREIGN", "main"]

FOREIGN = ("scipy", "ngsolve", "matplotlib", "xarray", "dask", "distributed", "sklearn", "typer", "rich",
           "pydantic", "pint", "zarr", "starlette", "palpate.devices.doubles")  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the loop; the exit code is that of the error, 0 without one."""
    (told,) = sys.argv[1:] if arguments is None else arguments
    options = SimpleNamespace(**json.loads(told))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole terminal: the parent decides
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))  # unwinds through the loop's own clean-up
    try:
        return _run(options)
    except PalpateError as error:
        sys.stderr.write(f"{error}\n")
        _say({"error": [error.what, error.why, error.fix]})
        return error.exit_code


def _run(options: SimpleNamespace) -> int:
    shared = Shared.attach(options.state)
    shared.unlink()  # both sides have it: from here on no kind of death can leave it behind
    desk = SwapDesk(_say)
    orphaned = _watch_parent(desk.ask)
    import_when_needed(options.modules)
    model = load_touchable(options.model, options.friction)
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
    limits = Limits(
        max_force, options.slew, continuous=traits.continuous_force, max_torque=options.max_torque
    )
    loop = Loop(
        model,
        device,
        shared,
        workspace,
        limits,
        rate=options.rate,
        stiffness=model.stiffness_max if traits.damping is not None else 0.0,
        override=options.unsoftened,
        control=options.control,
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


def _open(options: SimpleNamespace, shared: Shared) -> Device:
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
