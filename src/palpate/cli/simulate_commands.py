"""`palpate devices simulate`: a double of each device, to try it without hardware; one command each.

Doubles of services listen until Ctrl-C. Doubles of the vendors' libraries are compiled into a folder, and the command
says how to use them.
"""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import Annotated

import typer

from palpate.cli.command_names import CommandGroup
from palpate.cli.console import Console
from palpate.cli.number_options import count_option, number_option
from palpate.cli.table_options import Json

__all__ = ["simulate_app"]

simulate_app = typer.Typer(
    cls=CommandGroup,
    help="Doubles of devices, whose hand moves up and down by itself, to try them without hardware.",
    no_args_is_help=True,
)

Amplitude = Annotated[
    float | None,
    number_option(
        "--amplitude",
        "m",
        least=-0.1,
        most=0.1,
        help="Stroke of the simulated hand, m; downwards first. Default: what presses the body of --body to three "
        "quarters of its trained depth, else 8 % of the device's radius.",
    ),
]
Body = Annotated[
    Path | None,
    typer.Option("--body", help="File of the learnt body that is to be pressed.", show_default=False),
]
# of a workspace's radius: on a body that is held; a tenth of the reach of one that is pressed
_HELD, _SHORT = 0.3, 0.08
_TOUCH_BOX = 0.035  # m, half of the shortest side of the workspace that the double of OpenHaptics states
Frequency = Annotated[
    float, number_option("--frequency", "Hz", least=0.0, most=5.0, help="Strokes per second, Hz.")
]
Seconds = Annotated[
    float, number_option("--seconds", "s", least=0.1, help="Duration in seconds. Default: a day.")
]
Folder = Annotated[Path, typer.Option(help="Folder that the library is put into.")]


@simulate_app.command()
def haply(
    port: Annotated[
        int, count_option("--port", least=0, most=65535, help="Port of the simulation channel.")
    ] = 10001,
    events: Annotated[
        int, count_option("--events", least=0, most=65535, help="Port of the event channel.")
    ] = 10020,
    body: Body = None,
    amplitude: Amplitude = None,
    frequency: Frequency = 0.5,
    spelling: Annotated[
        str, typer.Option(help="Spelling of a force that is understood: both, vector or values.")
    ] = "both",
    force_scale: Annotated[
        float, number_option("--force-scale", help="Factor by which the service multiplies every force.")
    ] = 1.0,
    kind: Annotated[
        str, typer.Option("--type", help="Type of the device: inverse3, inverse3x, minverse, or any other.")
    ] = "inverse3",
    grip: Annotated[
        str, typer.Option(help="Grips that are connected: wireless, wired, both or none.")
    ] = "wireless",
    silence: Annotated[
        float,
        number_option(
            "--silence", "s", least=0.001, help="Seconds without a command until the force lapses."
        ),
    ] = 0.1,
    seconds: Seconds = 86400.0,
    as_json: Json = False,
) -> None:
    """Run a double of the Haply Inverse Service, until Ctrl-C."""
    from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
    from palpate.devices.profiles import PROFILES, weakest_profile

    settings = SimulatorSettings(
        port=port,
        events=events,
        spellings=("vector", "values") if spelling == "both" else (spelling,),
        silence=silence,
        force_scale=force_scale,
        kind=kind,
        grip=grip,
        amplitude=_stroke(amplitude, body, PROFILES.get(kind, weakest_profile("haply")).radius),
        frequency=frequency,
    )
    with HaplySimulator(settings) as service:
        device = f"haply:ws://localhost:{service.port},events={service.events_port}"
        console = _listen(f"A simulated Haply {kind} listens.", device, seconds, as_json)
    console.result(
        f"{service.received} commands were answered.",
        {"device": device, "commands": service.received, "amplitude": settings.amplitude},
    )


@simulate_app.command()
def crtk(
    port: Annotated[int, count_option("--port", least=0, most=65535, help="Port of the ROS bridge.")] = 9090,
    arm: Annotated[str, typer.Option(help="Namespace of the arm.")] = "arm",
    rate: Annotated[
        float, number_option("--rate", "Hz", least=1.0, most=10000.0, help="Positions per second, Hz.")
    ] = 1000.0,
    ros: Annotated[
        int, count_option("--ros", least=1, most=2, help="Version of ROS, whose types are understood.")
    ] = 2,
    body: Body = None,
    amplitude: Amplitude = None,
    frequency: Frequency = 0.5,
    seconds: Seconds = 86400.0,
    as_json: Json = False,
) -> None:
    """Run a double of a CRTK arm behind a ROS bridge, until Ctrl-C."""
    from palpate.devices.crtk_settings import CrtkSettings
    from palpate.devices.doubles.crtk_simulator import CrtkSimulator, CrtkSimulatorSettings

    settings = CrtkSimulatorSettings(
        port=port,
        arm=arm,
        rate=rate,
        ros=ros,
        amplitude=_stroke(amplitude, body, CrtkSettings().radius),
        frequency=frequency,
    )
    with CrtkSimulator(settings) as service:
        device = f"crtk:ws://localhost:{service.port},arm={arm}"
        console = _listen("A simulated CRTK arm moves.", device, seconds, as_json)
    console.result(
        f"{service.wrenches} wrenches were taken.",
        {"device": device, "wrenches": service.wrenches, "amplitude": settings.amplitude},
    )


@simulate_app.command()
def forcedimension(
    folder: Folder = Path("palpate-doubles"),
    kind: Annotated[
        str, typer.Option("--type", help="Type of the device, such as omega.3, delta.6, sigma.7 or falcon.")
    ] = "omega.3",
    body: Body = None,
    amplitude: Amplitude = None,
    frequency: Frequency = 0.5,
    homed: Annotated[bool, typer.Option(help="Whether the device has been homed.")] = True,
    lost_after: Annotated[
        int,
        count_option(
            "--lost-after", least=0, help="Force commands after which the cable is pulled; 0 for never."
        ),
    ] = 0,
    as_json: Json = False,
) -> None:
    """Compile a double of Force Dimension's library, with a device behind it."""
    from palpate.devices.force_dimension import TYPES
    from palpate.devices.profiles import device_profile
    from palpate.errors import UsageError

    numbers = {name: number for number, name in reversed(TYPES.items())}
    if kind not in numbers:
        raise UsageError(
            f"There is no simulated {kind!r}.", fix=f"Choose one of {', '.join(sorted(numbers))}."
        )
    stroke = _stroke(amplitude, body, device_profile(kind).radius)
    definitions = {"TYPE": numbers[kind], "AMPLITUDE": stroke, "FREQUENCY": frequency}
    _compile("forcedimension", folder, definitions | {"HOMED": homed, "LOST_AFTER": lost_after}, as_json)


@simulate_app.command()
def openhaptics(
    folder: Folder = Path("palpate-doubles"),
    kind: Annotated[
        str, typer.Option("--type", help="Type of the device: touch, touchx, desktop or omni.")
    ] = "touch",
    body: Body = None,
    amplitude: Amplitude = None,
    frequency: Frequency = 0.5,
    lost_after: Annotated[
        int,
        count_option(
            "--lost-after", least=0, help="Frames, of 1 ms, after which the cable is pulled; 0 for never."
        ),
    ] = 0,
    warm_every: Annotated[
        int,
        count_option(
            "--warm-every", least=0, help="Frames from one complaint of warm motors to the next; 0 for none."
        ),
    ] = 0,
    as_json: Json = False,
) -> None:
    """Compile a double of 3D Systems' OpenHaptics library, with a device behind it."""
    from palpate.errors import UsageError

    kinds = ("touch", "touchx", "desktop", "omni")  # in the order of the double's models
    if kind not in kinds:
        raise UsageError(f"There is no simulated {kind!r}.", fix=f"Choose one of {', '.join(kinds)}.")
    stroke = _stroke(amplitude, body, _TOUCH_BOX)
    definitions = {"MODEL": kinds.index(kind), "AMPLITUDE": stroke, "FREQUENCY": frequency}
    _compile(
        "openhaptics", folder, definitions | {"LOST_AFTER": lost_after, "WARM_EVERY": warm_every}, as_json
    )


def _stroke(amplitude: float | None, body: Path | None, radius: float) -> float:
    """Return the stroke of a double's hand, m, in the workspace of its device, whose radius is given, m."""
    from palpate.runtime.touchable import load_touchable

    if amplitude is not None:
        return amplitude
    if body is None:
        return _SHORT * radius
    touch = load_touchable(body)
    return touch.stroke(touch.workspace(radius).scale).get("amplitude", _HELD * radius)


def _listen(words: str, device: str, seconds: float, as_json: bool) -> Console:
    """Say how a service's double is used, and wait for Ctrl-C or `seconds`, s; return where its result is told."""
    console = Console(as_json)
    console.say(f"{words} Next: palpate run MODEL --device {device}")
    with contextlib.suppress(KeyboardInterrupt):
        time.sleep(seconds)
    return console


def _compile(device: str, folder: Path, definitions: dict[str, float], as_json: bool) -> None:
    """Compile the double of a library and say how it is used."""
    from palpate.devices.doubles.library_doubles import compile_double

    library = compile_double(device, folder, {name: float(value) for name, value in definitions.items()})
    use = f"{device}:library={library}"
    text = f"The library of a simulated device is {library}. Next: palpate run MODEL --device {use}"
    Console(as_json).result(
        text, {"device": use, "library": str(library), "amplitude": definitions["AMPLITUDE"]}
    )
