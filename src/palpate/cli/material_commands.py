"""`palpate material fit`: constants of a material from tables of tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

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
    from palpate.units import parse_quantity

    heights = [parse_quantity(text, "m", "--height") for text in height or []]
    areas = [parse_quantity(text, "m²", "--area") for text in area or []]
    for option, values in (("--height", heights), ("--area", areas)):
        if not all(value > 0 for value in values):
            raise UsageError(f"{option} is not positive.", fix="Give the size of the undeformed specimen.")
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

    if missing := [str(file) for file in tables.files if not file.is_file()]:
        raise UsageError(
            f"{', '.join(missing)}: no such file.",
            fix="Give the path of a table, as text (CSV and its kin) or .xlsx.",
        )
    kinds = [tables.kind(i) for i in range(len(tables.files))]
    if "relaxation" in kinds:
        found = _fit_relaxation(tables, options)
    elif "indentation" in kinds:
        console.say("Solving the slab by finite elements …")
        found = _fit_indentation(tables, kinds, options, sizes)
    else:
        found = _fit_stresses(tables, kinds, options)
    found = replace(found, notes=(*tables.notes, *found.notes))
    if plot is not None:
        found.plot(plot)
    if out is not None:
        write_file(out, with_seal(out, found.toml()))
    content = found.describe() | {"toml": found.toml()}
    console.result(f"{found}\n\n{found.toml()}".rstrip(), content)


def _fit_relaxation(tables: SpecimenTables, options: dict[str, Any]) -> Any:
    from palpate.physics.materials import fit_relaxation
    from palpate.units import parse_quantity

    if len(tables.files) > 1:
        raise UsageError(
            "A relaxation is fitted alone.",
            why="It tells shares and times, other tests tell moduli.",
            fix="Fit the other files by a command of their own.",
        )
    time, response, unit = tables.relaxation(0)
    units = {"begin": "s", "ramp": "s", "preload": unit}
    given: dict[str, Any] = {
        name: parse_quantity(options[name], own, f"--{name}")
        for name, own in units.items()
        if options[name] is not None
    }
    return fit_relaxation(time, response, **given)


def _fit_indentation(
    tables: SpecimenTables, kinds: list[str], options: dict[str, Any], sizes: dict[str, str | None]
) -> Any:
    from palpate.physics.materials import fit
    from palpate.units import parse_quantity

    lengths = {
        name: parse_quantity(text, "m", f"--{name}") for name, text in sizes.items() if text is not None
    }
    if not {"radius", "thickness"} <= lengths.keys():
        raise UsageError(
            "Radius of the ball and thickness of the slab are not known.",
            why="The force depends on both.",
            fix='Give them: --radius "5 mm" --thickness "20 mm".',
        )
    tests: list[Any] = []
    for i, kind in enumerate(kinds):
        if kind == "indentation":
            tests.append(tables.indentation(i, lengths))
        else:
            tests.append(tables.stretch_test(i, kind))
    poisson = 0.45 if options["poisson"] is None else options["poisson"]
    return fit(options["law"], tests, poisson=poisson)


def _fit_stresses(tables: SpecimenTables, kinds: list[str], options: dict[str, Any]) -> Any:
    from palpate.physics.materials import fit

    return fit(
        options["law"],
        [tables.stretch_test(i, kind) for i, kind in enumerate(kinds)],
        poisson=0.5 if options["poisson"] is None else options["poisson"],
        weight=options["weight"],
        margin=options["margin"],
    )
