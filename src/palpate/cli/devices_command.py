"""`palpate devices`: haptic devices, and simulated ones to try the way to them without hardware."""

from __future__ import annotations

import contextlib
import time
from typing import Annotated

import typer

from palpate.cli.console import Console
from palpate.cli.table_options import Json
from palpate.errors import UsageError

__all__ = ["devices_app"]

devices_app = typer.Typer(help="Haptic devices, and simulated ones.", no_args_is_help=True)


@devices_app.callback()
def _devices() -> None:
    """Haptic devices, and simulated ones."""


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
        str, typer.Option(help="Spellings of a force that are understood: both, vector or values.")
    ] = "both",
    force_scale: Annotated[
        float, typer.Option(help="Factor by which the service multiplies every force.")
    ] = 1.0,
    silence: Annotated[
        float, typer.Option(min=0.001, help="Seconds without a command until the force lapses.")
    ] = 0.1,
    seconds: Annotated[float, typer.Option(min=0.1, help="Duration in seconds.")] = 86400.0,
    as_json: Json = False,
) -> None:
    """Run a simulated device with a hand that moves up and down, until Ctrl-C."""
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
