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
    from palpate.export.check_points import Comparison
    from palpate.network import Network
    from palpate.surrogates import Surrogate

__all__ = ["export_app"]

export_app = typer.Typer(
    help="Take a learnt body or a network into other tools: C99, a library, an FMU, ONNX, one HTML file.",
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
    fmi: Annotated[
        str, typer.Option("--fmi", help="Version of FMI: 2.0, which most tools import, or 3.0.")
    ] = "2.0",
    no_deviation: NoDeviation = False,
    no_check: NoCheck = False,
    as_json: Json = False,
) -> None:
    """Write an FMU (FMI 2.0 or 3.0) for Simulink and others; nothing is compiled.

    Where FMPy is installed the FMU is loaded, and compared with palpate at 1,000 places; one that differs is refused.
    """
    from palpate.export import export_fmu

    thing, console = _body(file), Console(as_json)
    path = out if out is not None else Path(f"{name or file.stem}.fmu")
    done = export_fmu(thing, path, name=name, fmi=fmi, deviation=not no_deviation, check=not no_check)
    comparison = done.comparison
    if comparison is None:
        console.say(
            "not compared with palpate: " + ("not asked for" if no_check else "FMPy is not installed")
        )
    kinds = "co-simulation and model exchange"
    if not done.exchange and thing.memory is not None:
        kinds = f"co-simulation alone because of the memory {thing.memory.name!r}"
    lines = [
        f"{path}  {path.stat().st_size / 1e3:.0f} kB, FMI {done.fmi}, {kinds}, {', '.join(done.platforms)}"
    ]
    lines += [] if comparison is None else [str(comparison)]
    content = {
        "file": str(path),
        "hash": done.hash,
        "fmi": done.fmi,
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


@export_app.command("onnx")
def to_onnx(
    file: LearntFile,
    out: Annotated[
        Path | None, typer.Option(help="File. Default: the model's name, ending in .onnx.")
    ] = None,
    single: Annotated[
        bool, typer.Option("--float", help="Numbers of 32 bits, which browsers' runtimes take.")
    ] = False,
    elastic: Annotated[bool, typer.Option("--elastic", help="Leave a memory out.")] = False,
    no_check: Annotated[bool, typer.Option("--no-check", help="Don't compare with palpate.")] = False,
    as_json: Json = False,
) -> None:
    """Write an ONNX model: energy, force, stiffness and trust from one graph, for many places at a time.

    It is run in ONNX Runtime and compared with palpate at 1,000 places; one that differs is refused.
    """
    from palpate.export.onnx_export import export_onnx

    console = Console(as_json)
    path = file.with_suffix(".onnx") if out is None else out
    done = export_onnx(_read(file), path, single=single, elastic=elastic, check=not no_check)
    _tell(console, done.file, done.hash, done.comparison, "ONNX Runtime", no_check=no_check)


@export_app.command("html")
def to_html(
    file: LearntFile,
    out: Annotated[
        Path | None, typer.Option(help="File. Default: the model's name, ending in .html.")
    ] = None,
    no_check: Annotated[bool, typer.Option("--no-check", help="Don't compare with palpate.")] = False,
    as_json: Json = False,
) -> None:
    """Write one HTML file with the body in it, which is touched in any browser: from disk, without a network."""
    from palpate.surrogates import Surrogate
    from palpate.viewer.file_page import export_html

    thing = _read(file)
    if not isinstance(thing, Surrogate):
        raise UsageError(
            f"{file} holds a network, and a page shows a body.",
            fix="Export it with `palpate export onnx` or `palpate export c`.",
        )
    console = Console(as_json)
    done = export_html(thing, file.with_suffix(".html") if out is None else out, check=not no_check)
    if done.left_out:
        console.say(f"not in the file: {', '.join(done.left_out)} (5 MB are full, or it is on other nodes)")
    _tell(console, done.file, done.hash, done.comparison, "wasmtime", no_check=no_check)


def _tell(
    console: Console, file: Path, sha256: str, comparison: Comparison | None, runtime: str, *, no_check: bool
) -> None:
    """Print what was written, and how far it is from palpate."""
    if comparison is None:
        console.say(
            "not compared with palpate: " + ("not asked for" if no_check else f"{runtime} is not installed")
        )
    lines = [f"{file}  {file.stat().st_size / 1e6:.2f} MB"]
    lines += [] if comparison is None else [str(comparison)]
    parts = {} if comparison is None else comparison.parts
    compared = {k: {"relative": v.relative, "allowed": v.allowed} for k, v in parts.items()}
    console.result(
        "\n".join(lines),
        {"file": str(file), "bytes": file.stat().st_size, "sha256": sha256, "compared": compared},
    )
