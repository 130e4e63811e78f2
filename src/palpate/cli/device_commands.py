"""`palpate devices`: what can be touched with on this machine, and what is missing.

The group lists by default; each further command of devices is a command of this group.
"""

from __future__ import annotations

import typer

from palpate.cli.console import Console
from palpate.cli.table_options import Json

__all__ = ["devices_app"]

devices_app = typer.Typer(help="Devices for the hand: what is there, and what to do for the others.")


@devices_app.callback(invoke_without_command=True)
def _default(context: typer.Context, as_json: Json = False) -> None:
    if context.invoked_subcommand is None:
        list_devices(as_json)


@devices_app.command("list")
def list_devices(as_json: Json = False) -> None:
    """List the devices that this version drives, with their traits."""
    from palpate.runtime.devices import device_names, device_traits

    found = {name: device_traits(name) for name in device_names()}
    lines = [f"{name:12} {traits.source}" for name, traits in found.items()]
    Console(as_json).result("\n".join(lines), {"devices": [{"name": n} | vars(t) for n, t in found.items()]})
