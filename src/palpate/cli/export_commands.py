"""`palpate export`: learnt bodies and networks in other people's tools."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from palpate.cli.console import Console
from palpate.cli.table_options import Json
from palpate.errors import UsageError

if TYPE_CHECKING:
    from palpate.network import Network
    from palpate.surrogates import Surrogate

__all__ = ["export_app"]

export_app = typer.Typer(
    help="Take a learnt body or a network into other tools: C99, a shared library, an FMU.",
    no_args_is_help=True,
)

LearntFile = Annotated[
    Path, typer.Argument(help="Model file (.palpate), of [bold]palpate learn[/] or [bold]palpate fit[/].")
]
Name = Annotated[str | None, typer.Option(help="Beginning of all names in C. Default: the body's name.")]
FieldName = Annotated[str | None, typer.Option(help="The field that goes out. Default: the displacement.")]
NoField = Annotated[bool, typer.Option("--no-field", help="Leave the field out.")]
NoDeviation = Annotated[
    bool, typer.Option("--no-deviation", help="Leave out how far the force may be off; files become smaller.")
]
NoCheck = Annotated[bool, typer.Option("--no-check", help="Don't compile and compare with palpate.")]
Compiler = Annotated[
    str | None,
    typer.Option(
        help="C compiler for the comparison. Default: that of the variable CC, or the first one found."
    ),
]


def _read(file: Path) -> Surrogate | Network:
    """Return the body or the network of a file.

    Raises
    ------
    UsageError
        If it holds neither.
    """
    from palpate.learning.loading import load
    from palpate.network import Network
    from palpate.surrogates import Surrogate

    thing = load(file)
    thing = getattr(thing, "network", thing)
    if not isinstance(thing, Surrogate | Network):
        raise UsageError(
            f"{file} holds no learnt body and no network.",
            why="These are what other tools can evaluate.",
            fix="Give a file of `palpate learn` or `palpate fit`.",
        )
    return thing


@export_app.command("c")
def to_c(
    file: LearntFile,
    out: Annotated[Path | None, typer.Option(help="Folder for the files. Default: the body's name.")] = None,
    name: Name = None,
    single: Annotated[bool, typer.Option("--float", help="Numbers of single precision.")] = False,
    field: FieldName = None,
    no_field: NoField = False,
    no_deviation: NoDeviation = False,
    no_check: NoCheck = False,
    compiler: Compiler = None,
    as_json: Json = False,
) -> None:
    """Write C99: a header, a source with the weights as tables, an example and a CMake file.

    The files allocate nothing and need only math.h. If there is a C compiler they are compiled, and compared with
    palpate at 1,000 places; files that differ are refused.
    """
    from palpate.export import export_c

    thing = _read(file)
    console = Console(as_json)
    done = export_c(
        thing,
        Path(name or file.stem) if out is None else out,
        name=name,
        single=single,
        field=field,
        with_field=not no_field,
        deviation=not no_deviation,
        check=not no_check,
        compiler=compiler,
    )
    if done.comparison is None:
        console.say(
            "not compared with palpate: " + ("not asked for" if no_check else "no C compiler was found")
        )
    lines = [f"{f}  {f.stat().st_size / 1e3:.0f} kB" for f in done.files]
    lines += [] if done.comparison is None else [str(done.comparison)]
    console.result("\n".join(lines), done.as_dict())


@export_app.command("lib")
def to_library(
    file: LearntFile,
    out: Annotated[Path | None, typer.Option(help="Folder for the files. Default: the body's name.")] = None,
    name: Name = None,
    field: FieldName = None,
    no_field: NoField = False,
    no_deviation: NoDeviation = False,
    no_check: NoCheck = False,
    compiler: Compiler = None,
    as_json: Json = False,
) -> None:
    """Compile a shared library with a plain C ABI, with wrappers for Python, Unity, Unreal and MATLAB.

    Without a C compiler the sources and their CMake file are written, to be built elsewhere.
    """
    from palpate.export import export_lib

    console = Console(as_json)
    done = export_lib(
        _body(file),
        Path(name or file.stem) if out is None else out,
        name=name,
        field=field,
        with_field=not no_field,
        deviation=not no_deviation,
        check=not no_check,
        compiler=compiler,
    )
    if done.library is None:
        console.say("no C compiler was found: build the library with CMake, -DBUILD_SHARED_LIBS=ON")
    lines = [f"{f}  {f.stat().st_size / 1e3:.0f} kB" for f in done.files]
    lines += [] if done.comparison is None else [str(done.comparison)]
    content = replace(done.sources, comparison=done.comparison).as_dict()
    content["files"] = [{"file": str(f), "bytes": f.stat().st_size} for f in done.files]
    console.result("\n".join(lines), content)


@export_app.command("fmu")
def to_fmu(
    file: LearntFile,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="File. Default: NAME.fmu.")] = None,
    name: Name = None,
    no_deviation: NoDeviation = False,
    no_check: NoCheck = False,
    as_json: Json = False,
) -> None:
    """Write an FMU (FMI 2.0) for Simulink and others; nothing is compiled.

    Where FMPy is installed the FMU is loaded, and compared with palpate at 1,000 places.
    """
    from palpate.export import export_fmu

    thing, console = _body(file), Console(as_json)
    path = out if out is not None else Path(f"{name or file.stem}.fmu")
    done = export_fmu(thing, path, name=name, deviation=not no_deviation)
    comparison = None if no_check else done.compare(thing)
    if comparison is None:
        console.say(
            "not compared with palpate: " + ("not asked for" if no_check else "FMPy is not installed")
        )
    kinds = "co-simulation and model exchange" if done.exchange else "co-simulation"
    lines = [f"{path}  {path.stat().st_size / 1e3:.0f} kB, {kinds}, {', '.join(done.platforms)}"]
    lines += [] if comparison is None else [str(comparison)]
    content = {
        "file": str(path),
        "hash": done.hash,
        "platforms": list(done.platforms),
        "exchange": done.exchange,
    }
    compared = {} if comparison is None else {k: v.relative for k, v in comparison.parts.items()}
    console.result("\n".join(lines), content | {"compared": compared or None})


def _body(file: Path) -> Surrogate:
    from palpate.surrogates import Surrogate

    thing = _read(file)
    if not isinstance(thing, Surrogate):
        raise UsageError(
            f"{file} holds a network alone.",
            why="This way out is for learnt bodies, which answer a hand.",
            fix="Take the network out as C99: palpate export c.",
        )
    return thing
