"""`palpate material fit`: constants of a material from tables of tests."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from palpate.cli.console import Console
from palpate.cli.number_options import number_option
from palpate.cli.table_options import Force, Json, with_table_options
from palpate.errors import UsageError
from palpate.output_files import require_outputs, with_seal

if TYPE_CHECKING:
    from palpate.tables import Table

__all__ = ["SpecimenTables", "fit_material", "material_app"]

material_app = typer.Typer(help="Materials: constants from tests.", no_args_is_help=True)

KINDS = ("uniaxial", "equibiaxial", "planar", "indentation", "relaxation")
_WORDS = {
    "equibiaxial": ("equibiaxial", "biaxial", "bulge", "inflation"),
    "planar": ("planar", "pure shear", "pure_shear", "pure-shear", "pureshear"),
    "indentation": ("indent",),
    "relaxation": ("relax",),
    "uniaxial": ("uniaxial", "tensile", "tension", "compression"),
}
"""Words in a file's name that tell the kind of its test; the first that fits is taken."""

_COLUMNS = {
    "stretch": ("stretch", "lambda", "λ", "stretch ratio", "extension ratio"),
    "strain": ("strain", "engineering strain", "nominal strain", "eps", "ε", "e"),
    "log strain": ("true strain", "log strain", "logarithmic strain", "hencky strain"),
    "nominal": ("nominal stress", "engineering stress", "p", "pk1"),
    "true": ("true stress", "cauchy stress", "sigma", "σ"),
    "stress": ("stress", "s"),
    "depth": ("depth", "indentation", "indentation depth", "displacement"),
    "force": ("force", "f", "load"),
    "time": ("time", "t"),
}
"""Names under which a column is found, by what it holds."""


@material_app.command()
@with_table_options
def fit(
    files: Annotated[list[Path], typer.Argument(help="Tables of tests: text (CSV and its kin) or .xlsx.")],
    test: Annotated[
        list[str] | None,
        typer.Option(
            help="Kind of each file's test, in their order: uniaxial, equibiaxial, planar, indentation, relaxation. "
            "Default: found from the file's name."
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
            "force or time. Can be given several times."
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
    ramp: Annotated[str, typer.Option(help='For relaxation: time of the rise, such as "0.1 s".')] = "0 s",
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
    tables = SpecimenTables(files, test or [], measure, column or [], reading)
    sizes = {"radius": radius, "thickness": thickness, "width": width}
    options = {"law": law, "poisson": poisson, "weight": weight, "margin": margin, "ramp": ramp}
    outputs = [file for file in (plot, out) if file is not None]
    require_outputs(outputs, inputs=files, overwrite=force)
    if out is not None:
        require_outputs([out], endings=(".toml",), overwrite=force)
    fit_material(tables, options, sizes, plot, out, Console(as_json))


@dataclass(frozen=True)
class SpecimenTables:
    """Files of tests, and what was said of them.

    Attributes
    ----------
    files : list of Path
        The tables.
    kinds : list of str
        Kinds of their tests, in their order; empty where the files' names tell them.
    measure : str or None
        Measure of stress, where columns don't tell it.
    columns : list of str
        Words WHAT=NAME.
    options : mapping
        Options of `palpate.tables.read_table`.
    """

    files: list[Path]
    kinds: list[str]
    measure: str | None
    columns: list[str]
    options: Any = field(default_factory=dict)

    def kind(self, i: int) -> str:
        """Return the kind of the test of a file.

        Raises
        ------
        UsageError
            If it is not said and the file's name does not tell it.
        """
        if self.kinds:
            if len(self.kinds) != len(self.files) or not set(self.kinds) <= set(KINDS):
                raise UsageError(
                    f"The kinds of {len(self.files)} tests are given as {', '.join(self.kinds)}.",
                    why=f"Each file has one of {', '.join(KINDS)}.",
                    fix="Give --test once for each file, in their order.",
                )
            return self.kinds[i]
        stem = self.files[i].stem.lower()
        for kind, words in _WORDS.items():
            if any(word in stem for word in words):
                return kind
        raise UsageError(
            f"The kind of the test in {self.files[i]} is not known.",
            why="The file's name does not say it.",
            fix=f"Give --test with one of {', '.join(KINDS)}.",
        )

    def column(self, table: Table, *wanted: str) -> tuple[str, str]:
        """Return what a column holds, and its name: the first of `wanted` that the table has.

        Raises
        ------
        UsageError
            If there is none, or a word is no WHAT=NAME.
        """
        given = {}
        for word in self.columns:
            what, mark, name = word.partition("=")
            if not mark or what.strip() not in _COLUMNS:
                raise UsageError(
                    f"{word!r} is no column of a test.", fix=f"Write WHAT=NAME with {', '.join(_COLUMNS)}."
                )
            given[what.strip()] = name.strip()
        for what in wanted:
            if what in given:
                return what, table.column(given[what]).name
        for what in wanted:
            for name in table.names:
                if re.sub(r"[_\s]+", " ", name.strip().lower()) in _COLUMNS[what]:
                    return what, name
        raise UsageError(
            f"{table.path} has no column of {' or '.join(wanted)} that is known by its name.",
            why=f"Its columns are {', '.join(map(repr, table.names))}.",
            fix=f'Name it: --column "{wanted[0]}={table.names[0]}".',
        )

    def stretch_test(self, i: int, kind: str) -> Any:
        """Return the record of a file with stresses."""
        from palpate.physics.materials import StretchTest

        table = self._read(i)
        what, name = self.column(table, "stretch", "strain", "log strain")
        amount = table.values(name, "")
        held, column = self.column(table, "nominal", "true", "stress")
        measure = self.measure or (held if held != "stress" else None)
        if measure is None:
            raise UsageError(
                f"{table.path}: whether the column {column!r} holds nominal or true stress is not known.",
                why="At a stretch of 2 they differ by a factor of 2.",
                fix="Give --measure nominal (force over undeformed area) or --measure true.",
            )
        stress = table.values(column, "Pa")
        good = _whole(amount, stress)
        amount, stress, label = amount[good], stress[good], f"{kind} ({self.files[i].name})"
        made: Any = StretchTest  # which checks kind and measure
        if what == "stretch":
            return made(kind, amount, stress, measure, label)
        return made.of_strain(kind, amount, stress, measure, logarithmic=what == "log strain", name=label)

    def pair(self, i: int, first: str, unit: str, *second: str) -> Any:
        """Return two columns without gaps: the first in a unit, the second in SI units."""
        table = self._read(i)
        x = table.values(self.column(table, first)[1], unit)
        y = table.values(self.column(table, *second)[1])
        good = _whole(x, y)
        return x[good], y[good]

    def _read(self, i: int) -> Table:
        from palpate.tables import read_table

        return read_table(self.files[i], **(self.options or {}))


def _whole(x: Any, y: Any) -> Any:
    """Return which rows have both values."""
    import numpy as np

    return np.isfinite(x) & np.isfinite(y)


def fit_material(
    tables: SpecimenTables,
    options: dict[str, Any],
    sizes: dict[str, str | None],
    plot: Path | None,
    out: Path | None,
    console: Console,
) -> None:
    """Fit what the tables hold, print it, and write a picture and a study's table.

    Parameters
    ----------
    tables : SpecimenTables
        The files.
    options : mapping
        Law, Poisson's ratio, weight, margin and time of the rise.
    sizes : mapping
        Radius, thickness and width of an indentation, as text with units.
    plot, out : Path, optional
        Files of the picture and of the table.
    console : Console
        Printer of the result.

    Raises
    ------
    UsageError
        If the files, their columns or the options can't be fitted.
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
    time, response = tables.pair(0, "time", "s", "stress", "force", "nominal", "true")
    return fit_relaxation(time, response, ramp=parse_quantity(options["ramp"], "s", "--ramp"))


def _fit_indentation(
    tables: SpecimenTables, kinds: list[str], options: dict[str, Any], sizes: dict[str, str | None]
) -> Any:
    from palpate.physics.materials import IndentationTest, fit
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
            depth, force = tables.pair(i, "depth", "m", "force")
            tests.append(IndentationTest(depth, force, name=tables.files[i].name, **lengths))
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
