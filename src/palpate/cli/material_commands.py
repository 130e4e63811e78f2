"""`palpate material fit`: constants of a material from tables of tests."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from palpate import checks
from palpate.cli.command_names import CommandGroup
from palpate.cli.console import Console
from palpate.cli.number_options import number_option
from palpate.cli.table_options import Force, Json, with_table_options
from palpate.errors import UsageError
from palpate.output_files import require_outputs, with_seal

if TYPE_CHECKING:
    from palpate.cli.specimen_tables import SpecimenTables

__all__ = ["fit_material", "material_app"]

material_app = typer.Typer(cls=CommandGroup, help="Materials: constants from tests.", no_args_is_help=True)


@material_app.command()
@with_table_options
def fit(
    files: Annotated[list[Path], typer.Argument(help="Tables of tests: text (CSV and its kin) or .xlsx.")],
    test: Annotated[
        list[str] | None,
        typer.Option(
            help="Kind of each file's test, in their order: uniaxial, tension, compression, equibiaxial, planar, "
            "indentation, relaxation. Default: found from the file's name."
        ),
    ] = None,
    law: Annotated[
        str | None,
        typer.Option(
            help="neo-hookean, mooney-rivlin, yeoh, ogden, ogden-2 or ogden-3. Default: the best that stays stable."
        ),
    ] = None,
    measure: Annotated[
        str | None,
        typer.Option(help="Measure of stress: nominal or true. Default: found from the column's name."),
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            help="Column that holds something: WHAT=NAME, where WHAT is stretch, strain, log strain, stress, depth, "
            "force, extension or time. Can be given several times."
        ),
    ] = None,
    poisson: Annotated[
        float | None, number_option("--poisson", help="Poisson's ratio. Default: 0.5, of indentation 0.45.")
    ] = None,
    weight: Annotated[
        str,
        typer.Option(
            help="Scale of the errors: peak (of each test), stress (of all) or relative (of each row)."
        ),
    ] = "peak",
    margin: Annotated[
        float,
        number_option("--margin", least=0, help="How much farther than the data the law must be stable."),
    ] = 0.1,
    radius: Annotated[
        str | None, typer.Option(help='For indentation: radius of the ball, such as "5 mm".')
    ] = None,
    thickness: Annotated[str | None, typer.Option(help="For indentation: thickness of the slab.")] = None,
    width: Annotated[
        str | None, typer.Option(help="For indentation: width of the slab. Default: wide.")
    ] = None,
    height: Annotated[
        list[str] | None,
        typer.Option(
            help='For raw extension: undeformed length between the grips, or height, such as "25 mm". Once for all '
            "files, or once for each."
        ),
    ] = None,
    area: Annotated[
        list[str] | None,
        typer.Option(
            help='For raw load: undeformed section, such as "12 mm^2". Once for all files, or for each.'
        ),
    ] = None,
    cycle: Annotated[
        str | None,
        typer.Option(
            help="Loading that is fitted: first, last, a number, or all; '2 unloading'. Default: first."
        ),
    ] = None,
    begin: Annotated[
        str | None,
        typer.Option(help="For relaxation: time of the record at which the hold begins. Default: found."),
    ] = None,
    ramp: Annotated[
        str | None,
        typer.Option(help='For relaxation: time of the rise, such as "0.1 s". Default: found, or 0.'),
    ] = None,
    preload: Annotated[
        str | None,
        typer.Option(help="For relaxation: force or stress before the rise. Default: found, or 0."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="File for a picture of curves and errors, such as fit.png.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File for the material as a table of a study file.")
    ] = None,
    force: Force = False,
    reading: Any = None,
    as_json: Json = False,
) -> None:
    """Fit a material's constants to tests on specimens, and print them with intervals and what is not told."""
    from palpate.cli.specimen_tables import SpecimenTables

    heights, areas = checks.gather(
        [partial(_specimen_sizes, "--height", "m", height), partial(_specimen_sizes, "--area", "m²", area)]
    )
    tables = SpecimenTables(files, test or [], measure, column or [], reading, heights, areas, cycle)
    sizes = {"radius": radius, "thickness": thickness, "width": width}
    options = {"law": law, "poisson": poisson, "weight": weight, "margin": margin}
    options |= {"begin": begin, "ramp": ramp, "preload": preload}
    outputs = [file for file in (plot, out) if file is not None]
    require_outputs(outputs, inputs=files, overwrite=force)
    if out is not None:
        require_outputs([out], endings=(".toml",), overwrite=force)
    fit_material(tables, options, sizes, plot, out, Console(as_json))


def fit_material(
    tables: SpecimenTables,
    options: dict[str, Any],
    sizes: dict[str, str | None],
    plot: Path | None,
    out: Path | None,
    console: Console,
) -> None:
    """Fit what the tables hold, print it, and write a picture and a study's table.

    The options are law, Poisson's ratio, weight and margin, and of a relaxation begin of the hold, time of the rise and
    preload; the sizes are radius, thickness and width of an indentation, as text with units.
    """
    from palpate.files import write_file

    lengths = _lengths(sizes)
    calls = [partial(_read_test, tables, i, lengths) for i in range(len(tables.files))]
    kinds, tests = map(list, zip(*checks.gather(calls), strict=True))
    if "relaxation" in kinds:
        found = _fit_relaxation(tests, options)
    else:
        from palpate.physics.materials import fit as fit_law

        is_pressed = "indentation" in kinds
        if is_pressed:
            console.say("Solving the slab by finite elements …")
        usual, more = (0.45, {}) if is_pressed else (0.5, {k: options[k] for k in ("weight", "margin")})
        poisson = usual if options["poisson"] is None else options["poisson"]
        found = fit_law(options["law"], tests, poisson=poisson, **more)
    found = replace(found, notes=(*tables.notes, *found.notes))
    if plot is not None:
        found.plot(plot)
    if out is not None:
        write_file(out, with_seal(out, found.toml()))
    content = found.describe() | {"toml": found.toml()}
    console.result(f"{found}\n\n{found.toml()}".rstrip(), content)


def _specimen_sizes(option: str, unit: str, texts: list[str] | None) -> list[float]:
    """Return the sizes of undeformed specimens that an option gives, in an SI unit."""
    from palpate.units import parse_quantity

    sizes = [parse_quantity(text, unit, option) for text in texts or []]
    if not all(size > 0 for size in sizes):
        raise UsageError(f"{option} is not positive.", fix="Give the size of the undeformed specimen.")
    return sizes


def _lengths(sizes: dict[str, str | None]) -> dict[str, float]:
    """Return the sizes of an indentation that are given, m."""
    from palpate.units import parse_quantity

    return {name: parse_quantity(text, "m", f"--{name}") for name, text in sizes.items() if text is not None}


def _read_test(tables: SpecimenTables, i: int, lengths: dict[str, float]) -> tuple[str, Any]:
    """Return the kind of the test in a file, and its record; of a relaxation times, responses and their unit."""
    file = tables.files[i]
    if not file.is_file():
        raise UsageError(
            f"{file}: no such file.", fix="Give the path of a table, as text (CSV and its kin) or .xlsx."
        )
    kind = tables.kind(i)
    if kind == "relaxation":
        return kind, tables.relaxation(i)
    if kind != "indentation":
        return kind, tables.stretch_test(i, kind)
    if not {"radius", "thickness"} <= lengths.keys():
        raise UsageError(
            f"{file}: the radius of the ball and the thickness of the slab are not known.",
            why="The force depends on both.",
            fix='Give them: --radius "5 mm" --thickness "20 mm".',
        )
    return kind, tables.indentation(i, lengths)


def _fit_relaxation(tests: list[Any], options: dict[str, Any]) -> Any:
    from palpate.physics.materials import fit_relaxation
    from palpate.units import parse_quantity

    if len(tests) > 1:
        raise UsageError(
            "A relaxation is fitted alone.",
            why="It tells shares and times, other tests tell moduli.",
            fix="Fit the other files by a command of their own.",
        )
    time, response, unit = tests[0]
    units = {"begin": "s", "ramp": "s", "preload": unit}
    given: dict[str, Any] = {
        name: parse_quantity(options[name], own, f"--{name}")
        for name, own in units.items()
        if options[name] is not None
    }
    return fit_relaxation(time, response, **given)
