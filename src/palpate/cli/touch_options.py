"""Options of the commands that touch a body: the device, and what is asked of it."""

from __future__ import annotations

from typing import Annotated

import typer

from palpate.cli.number_options import number_option

__all__ = ["DeadMan", "Device", "Friction", "MaxForce", "MaxTorque", "NoController", "Unsoftened"]

Device = Annotated[
    str,
    typer.Option(help="Device with its settings, for example stroke:amplitude=0.02,frequency=1 or haply."),
]
Friction = Annotated[
    float | None,
    number_option(
        "--friction",
        least=0.0,
        help="Coefficient of friction of the tool on the body, such as 0.3. Default: that of the model.",
    ),
]
MaxForce = Annotated[
    float | None,
    number_option("--max-force", "N", above=0, help="Largest force (N). Default: that of the study."),
]
MaxTorque = Annotated[
    float | None,
    number_option(
        "--max-torque",
        "N*m",
        above=0,
        help="Largest torque (N m) on a device that renders one. Default: that of the study.",
    ),
]
Unsoftened = Annotated[
    bool,
    typer.Option(
        "--unsoftened", help="Let a body that is too stiff for the device feel so. It may hum or oscillate."
    ),
]
NoController = Annotated[
    bool,
    typer.Option(
        "--no-controller",
        help="Let the passivity controller only count: nothing damps a force that gives the hand energy.",
    ),
]
DeadMan = Annotated[
    bool,
    typer.Option(
        "--dead-man",
        help="Let the force act only while the device's first button is held. Any other button stops it.",
    ),
]
