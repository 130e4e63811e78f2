"""`palpate devices`: what can be touched with on this machine, what was looked for and where, and what to do.

The group lists by default; each further command of devices is a command of this group. The doubles of devices are in
`simulate_commands`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from palpate.cli.command_names import CommandGroup
from palpate.cli.console import Console
from palpate.cli.simulate_commands import simulate_app
from palpate.cli.table_options import Json

if TYPE_CHECKING:
    from palpate.devices.device_search import Finding

__all__ = ["devices_app", "findings_in_words"]

devices_app = typer.Typer(
    cls=CommandGroup, help="Devices for the hand: what is there, and what to do for the others."
)
devices_app.add_typer(simulate_app, name="simulate")

_MARKS = {"ready": "✓", "present": "○", "absent": "·"}
_STATES = {"ready": "ready", "present": "there, without a driver", "absent": "not there"}


@devices_app.callback(invoke_without_command=True)
def _default(context: typer.Context, as_json: Json = False) -> None:
    if context.invoked_subcommand is None:
        list_devices(as_json)


@devices_app.command("list")
def list_devices(as_json: Json = False) -> None:
    """List the devices that are there, those that were looked for and where, and what to do."""
    from palpate.devices.device_search import search

    findings = search()
    text = findings_in_words(findings, explain=True)
    Console(as_json).result(text, {"devices": [vars(f) for f in findings]})


def findings_in_words(findings: Sequence[Finding], *, explain: bool = False) -> str:
    """Return findings as lines for a person; to explain is to say what each driver knows of its devices."""
    lines = []
    for f in findings:
        use = f"   --device {f.device}" if f.state == "ready" else ""
        lines.append(f"{_MARKS[f.state]} {f.name}: {_STATES[f.state]}{use}")
        lines.append(f"    {f.detail}")
        lines.extend(f"    {fact}" for fact in f.facts if explain)
        if f.looked_for:
            lines.append(f"    looked for {', '.join(f.looked_for)}")
            lines.append(f"    in {', '.join(f.looked_in)}")
        if f.remedy:
            lines.append(f"    → {f.remedy}")
    return "\n".join(lines)
