"""`palpate benchmark soft-touch`: how near simulated soft bodies come to the force that a hand would feel."""

from __future__ import annotations

import importlib
import sys
import tempfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Annotated, Any

import typer

from palpate.checks import one_of
from palpate.cli.command_names import CommandGroup
from palpate.cli.console import Console
from palpate.cli.number_options import count_option
from palpate.cli.table_options import Json
from palpate.errors import UsageError

__all__ = ["benchmark_app", "soft_touch"]

benchmark_app = typer.Typer(
    cls=CommandGroup, help="Open benchmarks, and your own method in them.", no_args_is_help=True
)
_PACKAGE = "palpate_soft_touch"  # name under which the folder is imported, in a clone and in a wheel


@benchmark_app.callback()
def _benchmarks() -> None:
    """Keep the name of the benchmark in the command while there is a single one."""


@benchmark_app.command("soft-touch")
def soft_touch(
    case: Annotated[
        list[str] | None,
        typer.Option(
            help="Body: block, layered, dome, organ or lump. Several times for several. Default: all."
        ),
    ] = None,
    judge: Annotated[
        Path | None,
        typer.Option(help="Your method: a Python file with load(case), an FMU, or a CSV table of forces."),
    ] = None,
    seed: Annotated[
        int | None,
        count_option(
            "--seed", least=0, help="Solve other places, of this seed, and judge there. Takes minutes a body."
        ),
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the standings: a .svg or .png file.")] = None,
    as_json: Json = False,
) -> None:
    """Compare soft bodies of simulators and surrogates by the force on a hand, and your own method with them."""
    from palpate.output_files import require_outputs
    from palpate.validation.report.trace_pictures import save_figure

    if plot is not None:
        require_outputs([plot], endings=(".svg", ".png"))
    folder = _folder()
    judging, standing = _module(folder, "judge"), _module(folder, "standings")
    try:
        rows = _rows(judging, standing, _cases(judging, case), judge, seed)
    except judging.JudgeError as error:
        raise UsageError(error.what, why=error.why, fix=error.fix) from error
    if plot is not None:
        save_figure(plot, lambda: standing.draw(rows))
    sweep, sources = (standing.sweep_rows(), standing.sources()) if as_json else ([], {})
    # a figure that is not given is null in JSON
    rows_plain, sweep_plain = ([judging.plain_figures(row) for row in part] for part in (rows, sweep))
    content = {"rows": rows_plain, "sweep": sweep_plain, "sources": sources}
    Console(as_json).result(standing.standings_text(rows), content)


def _folder() -> Path:
    """Return the benchmark's folder: of the installed package, or of the clone that this file stands in."""
    here = Path(__file__)
    places = here.parents[1] / "soft_touch", here.parents[3] / "benchmarks" / "soft_touch"
    for place in places:
        if (place / "judge.py").is_file():
            return place
    raise UsageError(
        "The benchmark's folder is missing.", fix="Install palpate anew, or run it from a clone."
    )


def _module(folder: Path, name: str) -> Any:
    if _PACKAGE not in sys.modules:
        spec = spec_from_file_location(
            _PACKAGE, folder / "__init__.py", submodule_search_locations=[str(folder)]
        )
        assert spec is not None
        assert spec.loader is not None
        package = module_from_spec(spec)
        sys.modules[_PACKAGE] = package
        spec.loader.exec_module(package)
    return importlib.import_module(f"{_PACKAGE}.{name}")


def _cases(judging: Any, wanted: list[str] | None) -> list[str]:
    names = judging.case_names()
    if not names:
        raise UsageError("No case has an oracle yet.", fix="Run python -m benchmarks.soft_touch.make_cases.")
    return [one_of("The case", name, names) for name in wanted or names]


def _rows(
    judging: Any, standing: Any, cases: list[str], file: Path | None, seed: int | None
) -> list[dict[str, Any]]:
    """Return the standings; at places of a seed those of the methods that can be asked anew."""
    if seed is None:
        own = _figures(judging, file, {name: judging.read_case(name) for name in cases}) if file else {}
        return list(standing.standings(cases, own))
    learnt = [name for name in cases if any((_folder() / "learnt").glob(f"{name}-*.palpate"))]
    missing = [name for name in cases if name not in learnt]
    if file is None and missing:
        raise UsageError(
            f"No method can be asked anew on {', '.join(missing)}.",
            why="palpate's surrogate is not learnt there, and --judge names no other method.",
            fix="Take other bodies by --case, name a method by --judge, or learn the body: "
            f"python -m benchmarks.soft_touch.learn_bodies --case {missing[0]}.",
        )
    with tempfile.TemporaryDirectory() as scratch:
        make_places = _module(_folder(), "make_cases").make_places
        for name in cases:
            make_places(name, seed, Path(scratch) / name)
        read = {name: judging.read_case(name, Path(scratch)) for name in cases}
        surrogate = _folder() / "methods" / "palpate_surrogate.py"
        of_learnt = {name: read[name] for name in learnt}
        figures = {"palpate's surrogate": _figures(judging, surrogate, of_learnt)[surrogate.name]}
        figures |= _figures(judging, file, read) if file else {}
    return [
        {"case": name, "method": title, "settings": f"places of seed {seed}", **of_cases[name]}
        for name in cases
        for title, of_cases in figures.items()
        if name in of_cases
    ]


def _figures(judging: Any, file: Path, cases: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the figures of a method's file by its name and the cases."""
    return {
        file.name: {
            name: judging.judge(judging.read_method(file, case), case) for name, case in cases.items()
        }
    }
