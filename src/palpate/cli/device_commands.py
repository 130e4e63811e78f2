"""`palpate devices`: what can be touched with on this machine, what was looked for and where, and what to do.

The group lists by default; each further command of devices is a command of this group.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from palpate.cli.console import Console
from palpate.cli.table_options import Json
from palpate.errors import UsageError

if TYPE_CHECKING:
    from palpate.runtime.device_search import Finding

__all__ = ["devices_app", "findings_in_words"]

devices_app = typer.Typer(help="Devices for the hand: what is there, and what to do for the others.")

_MARKS = {"ready": "✓", "present": "○", "absent": "·"}
_STATES = {"ready": "ready", "present": "there, without a driver", "absent": "not there"}


@devices_app.callback(invoke_without_command=True)
def _default(context: typer.Context, as_json: Json = False) -> None:
    if context.invoked_subcommand is None:
        list_devices(as_json)


@devices_app.command("list")
def list_devices(as_json: Json = False) -> None:
    """List the devices that are there, those that were looked for and where, and what to do."""
    from palpate.runtime.device_search import search

    findings = search()
    Console(as_json).result(findings_in_words(findings), {"devices": [vars(f) for f in findings]})


def findings_in_words(findings: Sequence[Finding]) -> str:
    """Return findings as lines for a person."""
    lines = []
    for f in findings:
        use = f"   --device {f.device}" if f.state == "ready" else ""
        lines.append(f"{_MARKS[f.state]} {f.name}: {_STATES[f.state]}{use}")
        lines.append(f"    {f.detail}")
        if f.looked_for:
            lines.append(f"    looked for {', '.join(f.looked_for)}")
            lines.append(f"    in {', '.join(f.looked_in)}")
        if f.remedy:
            lines.append(f"    → {f.remedy}")
    return "\n".join(lines)


@devices_app.command()
def simulate(
    name: Annotated[str, typer.Argument(help="Device to simulate: haply.")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the simulation channel.")] = 10001,
    events: Annotated[int, typer.Option(min=0, max=65535, help="Port of the event channel.")] = 10020,
    amplitude: Annotated[
        float, typer.Option(min=-0.1, max=0.1, help="Stroke of the simulated hand, m; downwards first.")
    ] = 0.03,
    frequency: Annotated[float, typer.Option(min=0.0, max=5.0, help="Strokes per second, Hz.")] = 0.5,
    spelling: Annotated[
        str, typer.Option(help="Spelling of a force that is understood: both, vector or values.")
    ] = "both",
    force_scale: Annotated[
        float, typer.Option(help="Factor by which the service multiplies every force.")
    ] = 1.0,
    silence: Annotated[
        float, typer.Option(min=0.001, help="Seconds without a command until the force lapses.")
    ] = 0.1,
    seconds: Annotated[float, typer.Option(min=0.1, help="Duration in seconds. Default: a day.")] = 86400.0,
    as_json: Json = False,
) -> None:
    """Run a simulated device, whose hand moves up and down by itself, until Ctrl-C."""
    from palpate.runtime.devices.haply_simulator import HaplySimulator, SimulatorSettings

    if name != "haply":
        raise UsageError(f"There is no simulated device {name!r}.", fix="Choose haply.")
    settings = SimulatorSettings(
        port=port,
        events=events,
        spellings=("vector", "values") if spelling == "both" else (spelling,),
        silence=silence,
        force_scale=force_scale,
        amplitude=amplitude,
        frequency=frequency,
    )
    console = Console(as_json)
    with HaplySimulator(settings) as service:
        device = f"haply:ws://localhost:{service.port},events={service.events_port}"
        console.say(f"A simulated Haply Inverse3 listens. Next: palpate run MODEL --device {device}")
        with contextlib.suppress(KeyboardInterrupt):
            time.sleep(seconds)
    console.result(
        f"{service.received} commands were answered.", {"device": device, "commands": service.received}
    )
