"""`palpate export`: learnt bodies and networks in other people's tools."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from palpate.cli.command_names import CommandGroup
from palpate.cli.console import Console
from palpate.cli.number_options import number_option
from palpate.cli.table_options import Force, Json
from palpate.errors import UsageError
from palpate.number_text import whole_number

if TYPE_CHECKING:
    from palpate.export import ExportedC, ExportedFmu, ExportedPackage
    from palpate.export.check_points import ExportedFile
    from palpate.surrogates import Surrogate

__all__ = ["export_app"]

export_app = typer.Typer(
    cls=CommandGroup,
    help="Take a learnt body or a network into other tools: C99, library, FMU, ONNX, Unity, Unreal, one HTML file.",
    no_args_is_help=True,
)

LearntFile = Annotated[
    Path, typer.Argument(help="Model file (.palpate), of [bold]palpate learn[/] or [bold]palpate fit[/].")
]
BodyFile = Annotated[
    Path,
    typer.Argument(
        help="Model file (.palpate) of a body, of [bold]palpate learn[/] or [bold]palpate touch[/]."
    ),
]
Folder = Annotated[
    Path | None, typer.Option(help="Folder for the files. Default: the file's name, beside it.")
]
OutFile = Annotated[
    Path | None,
    typer.Option("-o", "--out", help="File. Default: the model file's name with another ending, beside it."),
]
Name = Annotated[str | None, typer.Option(help="Beginning of all names in C. Default: the file's name.")]
FieldName = Annotated[str | None, typer.Option(help="The field that goes out. Default: the displacement.")]
NoField = Annotated[bool, typer.Option("--no-field", help="Leave the field out.")]
NoDeviation = Annotated[
    bool, typer.Option("--no-deviation", help="Leave out how far the force may be off; files become smaller.")
]
NoCheck = Annotated[bool, typer.Option("--no-check", help="Don't run it and compare with palpate.")]
Compiler = Annotated[
    str | None,
    typer.Option(
        help="C compiler for the comparison. Default: that of the variable CC, or the first one found."
    ),
]

_NO_COMPILER = "no C compiler was found"
_NOT_INSTALLED = "{} is not installed (pip install 'palpate[{}]')"


def _name_of(file: Path) -> str:
    """Return the beginning of names in C after a file."""
    from palpate.export.weights_block import identifier

    name = identifier(file.stem)
    return f"model{name}" if name.startswith("_") else name


def _surrogate(file: Path) -> Surrogate:
    """Return the surrogate of a file; a network alone is one that answers its outputs."""
    from palpate.learning.loading import load_surrogate

    return load_surrogate(file)


def _body(file: Path) -> Surrogate:
    """Return the surrogate of a file that a hand feels."""
    thing = _surrogate(file)
    _ = thing.hand_energy  # which refuses one without touch
    return thing


def _say_left_out(console: Console, thing: Surrogate, *, no_field: bool) -> None:
    """Say that the shape of a beam did not go out, and why."""
    if thing.line is not None and not no_field:
        console.say(
            f"left out: the field {thing.line.name}, since it is at the nodes of a beam, and the evaluator core knows "
            "fields on surfaces; force and energy are the same"
        )


def _print(
    console: Console,
    done: ExportedC | ExportedFmu | ExportedFile | ExportedPackage,
    files: Sequence[Path],
    missing: str,
    *,
    no_check: bool,
    words: str = "",
) -> None:
    """Print what was written with its size, and how far it is from palpate or what is `missing` for that."""
    if done.comparison is None:
        console.say(f"not compared with palpate: {'not asked for' if no_check else missing}")
    lines = [f"{file}  {file.stat().st_size / 1e3:.0f} kB{words}" for file in files]
    lines += [] if done.comparison is None else [str(done.comparison)]
    console.result("\n".join(lines), done.as_dict())


def _names(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(",") if word.strip())


def _places(text: str) -> tuple[int, ...]:
    """Return the numbers of places that an option lists."""
    try:
        return tuple(whole_number(word) for word in _names(text))
    except UsageError as error:
        raise UsageError(
            f"--at-nodes: {error.what}", why=error.why, fix="List numbers of places: --at-nodes 12,40"
        ) from error


@export_app.command("c")
def to_c(
    file: LearntFile,
    out: Folder = None,
    name: Name = None,
    single: Annotated[bool, typer.Option("--float", help="Numbers of single precision.")] = False,
    field: FieldName = None,
    no_field: NoField = False,
    no_deviation: NoDeviation = False,
    no_check: NoCheck = False,
    compiler: Compiler = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write C99: a header, a source with the weights as tables, an example and a CMake file.

    The files allocate nothing and need only math.h. If there is a C compiler they are compiled, and compared with
    palpate at 1,000 places; files that differ are refused.
    """
    from palpate.export import export_c

    thing, console = _surrogate(file), Console(as_json)
    done = export_c(
        thing,
        file.with_name(name or file.stem) if out is None else out,
        name=name or _name_of(file),
        single=single,
        field=field,
        with_field=not no_field,
        deviation=not no_deviation,
        check=not no_check,
        compiler=compiler,
        overwrite=force,
    )
    _say_left_out(console, thing, no_field=no_field)
    _print(console, done, done.files, _NO_COMPILER, no_check=no_check)
    words = shlex.join(map(str, (done.example, *done.sources)))
    console.say(f"Next: cc -O2 {words} -lm && ./a.out")


@export_app.command("lib")
def to_library(
    file: BodyFile,
    out: Folder = None,
    name: Name = None,
    field: FieldName = None,
    no_field: NoField = False,
    no_deviation: NoDeviation = False,
    no_check: NoCheck = False,
    compiler: Compiler = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compile a shared library with a plain C ABI, with wrappers for Python and MATLAB.

    Without a C compiler the sources and their CMake file are written, to be built elsewhere.
    """
    from palpate.export import export_lib

    thing, console = _surrogate(file), Console(as_json)
    done = export_lib(
        thing,
        file.with_name(name or file.stem) if out is None else out,
        name=name or _name_of(file),
        field=field,
        with_field=not no_field,
        deviation=not no_deviation,
        check=not no_check,
        compiler=compiler,
        overwrite=force,
    )
    _say_left_out(console, thing, no_field=no_field)
    whole = replace(done.sources, files=done.files, comparison=done.comparison)
    missing = f"{_NO_COMPILER}: build the library with CMake, -DBUILD_SHARED_LIBS=ON"
    _print(console, whole, done.files, missing, no_check=no_check)


@export_app.command("unity")
def to_unity(
    file: BodyFile,
    out: Folder = None,
    name: Annotated[str | None, typer.Option(help="Name of the package. Default: the file's name.")] = None,
    no_check: NoCheck = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a package of Unity: a component, a sample, the mesh at rest, and a library for three systems.

    Nothing is compiled. The library is compared with palpate at 1,000 places; one that differs is refused.
    """
    from palpate.export import export_unity

    console = Console(as_json)
    done = export_unity(
        _body(file),
        file.with_name(f"{name or file.stem}-unity") if out is None else out,
        name=name or _name_of(file),
        check=not no_check,
        overwrite=force,
    )
    _print(console, done, done.files, "there is no library for this machine", no_check=no_check)
    console.say(
        f"Next: in Unity, Package Manager > + > Install package from disk: {done.folder / 'package.json'}"
    )


@export_app.command("unreal")
def to_unreal(
    file: BodyFile,
    out: Folder = None,
    name: Name = None,
    no_check: NoCheck = False,
    compiler: Compiler = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a plugin of Unreal: a component, the mesh at rest, and sources in C for any platform.

    If there is a C compiler the sources are compared with palpate at 1,000 places; those that differ are refused.
    """
    from palpate.export import export_unreal

    console = Console(as_json)
    done = export_unreal(
        _body(file),
        file.with_name(f"{name or file.stem}-unreal") if out is None else out,
        name=name or _name_of(file),
        check=not no_check,
        compiler=compiler,
        overwrite=force,
    )
    _print(console, done, done.files, _NO_COMPILER, no_check=no_check)
    console.say(f"Next: copy {done.folder} into the folder Plugins of a project of Unreal in C++")


@export_app.command("fmu")
def to_fmu(
    file: BodyFile,
    out: OutFile = None,
    name: Name = None,
    fmi: Annotated[
        str, typer.Option("--fmi", help="Version of FMI: 2.0, which most tools import, or 3.0.")
    ] = "2.0",
    at_nodes: Annotated[
        str, typer.Option(help="Places of fields whose values go out, by numbers from 0: 12,40.")
    ] = "",
    means: Annotated[str, typer.Option(help="Fields whose mean goes out: temperature.")] = "",
    extremes: Annotated[
        str, typer.Option(help="Fields whose largest and least value go out: temperature,stress.")
    ] = "",
    mass: Annotated[
        float | None,
        number_option(
            "--mass", "kg", help="Mass at the tip of a body, which the FMU moves: 0.1kg.", above=0.0
        ),
    ] = None,
    damping: Annotated[
        float | None,
        number_option("--damping", help="Damping of that mass, N·s/m. Default: 0.", least=0.0),
    ] = None,
    no_deviation: NoDeviation = False,
    no_check: NoCheck = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write an FMU (FMI 2.0 or 3.0) for Simulink and others, and run_fmu.py beside it; nothing is compiled.

    A touched body answers a place by a force; with --mass it answers a force by the place of that mass. All else
    answers its inputs by its numbers, its curves, and of each field mean, largest and least value or what is chosen.
    Where FMPy is installed the FMU is loaded, and compared with palpate at 1,000 places; one that differs is refused.
    """
    from palpate.export import CarriedMass, Choice, export_fmu

    thing, console = _surrogate(file), Console(as_json)
    if damping is not None and mass is None:
        raise UsageError(
            "There is a damping, but no mass.",
            why="The FMU moves a mass at the tip of the body, and that is what the damping brakes.",
            fix="Give both: --mass 0.1kg --damping 0.5",
        )
    done = export_fmu(
        thing,
        file.with_name(f"{name or file.stem}.fmu") if out is None else out,
        name=name or _name_of(file),
        fmi=fmi,
        choice=Choice(_places(at_nodes), _names(means), _names(extremes)),
        carried=None if mass is None else CarriedMass(mass, damping or 0.0),
        deviation=not no_deviation,
        check=not no_check,
        overwrite=force,
    )
    kinds = "co-simulation and model exchange"
    if not done.exchange and thing.memory is not None:
        kinds = f"co-simulation alone because of the memory {thing.memory.name!r}"
    words = f", FMI {done.fmi}, {kinds}, {', '.join(done.platforms)}"
    missing = _NOT_INSTALLED.format("FMPy", "check")
    _print(console, done, [done.path], missing, no_check=no_check, words=words)


@export_app.command("onnx")
def to_onnx(
    file: LearntFile,
    out: OutFile = None,
    single: Annotated[
        bool, typer.Option("--float", help="Numbers of 32 bits, which browsers' runtimes take.")
    ] = False,
    elastic: Annotated[bool, typer.Option("--elastic", help="Leave a memory out.")] = False,
    no_check: NoCheck = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write an ONNX model: energy, force, stiffness and trust from one graph, for many places at a time.

    It is run in ONNX Runtime and compared with palpate at 1,000 places; one that differs is refused.
    """
    from palpate.export.onnx_export import export_onnx

    console = Console(as_json)
    path = file.with_suffix(".onnx") if out is None else out
    done = export_onnx(
        _surrogate(file), path, single=single, elastic=elastic, check=not no_check, overwrite=force
    )
    missing = _NOT_INSTALLED.format("ONNX Runtime", "onnx")
    _print(console, done, [done.file], missing, no_check=no_check)


@export_app.command("html")
def to_html(
    file: BodyFile,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File. Default: NAME-page.html beside the file NAME.palpate."),
    ] = None,
    no_check: NoCheck = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write one HTML file with the model in it, touched or asked in any browser: from disk, without a network."""
    from palpate.viewer.file_page import export_html

    thing, console = _surrogate(file), Console(as_json)
    # NAME.html is the report of `palpate validate`
    path = file.with_name(f"{file.stem}-page.html") if out is None else out
    done = export_html(thing, path, check=not no_check, overwrite=force)
    if done.left_out:
        why = "5 MB are full, it is on other nodes, or under a tool that turns"
        console.say(f"not in the file: {', '.join(done.left_out)} ({why})")
    _print(console, done, [done.file], _NOT_INSTALLED.format("wasmtime", "check"), no_check=no_check)
