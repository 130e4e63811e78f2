"""`palpate card`, `palpate dataset export` and `palpate export gltf|vtu`: what others read of data and models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from palpate.cli.console import Console
from palpate.cli.export_commands import export_app
from palpate.cli.number_options import count_option, number_option
from palpate.cli.table_options import Force, Json
from palpate.errors import UsageError
from palpate.number_text import number_list, whole_number
from palpate.output_files import require_outputs

if TYPE_CHECKING:
    from palpate.export.gltf import ShapeSeries
    from palpate.surrogates import Surrogate

__all__ = ["card", "export_dataset"]

ShownFile = Annotated[
    Path, typer.Argument(help="Model file (.palpate) of a body that was learnt with its shape.")
]
Steps = Annotated[
    int, count_option("--steps", least=1, help="States of the stroke, from first contact to the deepest.")
]
Place = Annotated[
    str | None,
    typer.Option(
        help="Place of contact on the body's surface, x,y,z in m ([bold]palpate ask --at[/] takes the ball's centre); "
        "the probe goes in against the surface there. Of a held body its displacement, "
        "of a model without touch its inputs. Default: the middle."
    ),
]
Depth = Annotated[
    float | None,
    number_option(
        "--depth",
        "m",
        least=0,
        help="Largest depth of the probe in the surface, m. Default: the deepest trained one.",
    ),
]

Over = Annotated[
    str | None,
    typer.Option(help="Of a model without touch: the input that runs through its range, state by state."),
]
ColourField = Annotated[
    str | None, typer.Option("--field", help="Of a model without touch: the field that colours it.")
]


def card(
    file: Annotated[Path, typer.Argument(help="Model file (.palpate).")],
    author: Annotated[str, typer.Option(help="Who made it; with --save.")] = "",
    licence: Annotated[str, typer.Option(help="Licence, such as CC-BY-4.0; with --save.")] = "",
    save: Annotated[bool, typer.Option("--save", help="Write author and licence into the file.")] = False,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File for the card: .md or .json. Default: stdout.")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Print the record of a model for other people: origin, author, errors, limits, hashes and licence, as a page."""
    from palpate.files import write_file
    from palpate.learning.loading import load, surrogate_of
    from palpate.output_files import with_seal
    from palpate.surrogates.model_card import card_of

    if out is not None:
        require_outputs([out], endings=(".md", ".json"), overwrite=force)
    model: Any = load(file)
    if author or licence:
        if not save:
            raise UsageError(
                "Author and licence stand in the file.",
                why="A card says what the file says.",
                fix="Add --save, which writes them into the file.",
            )
        if not hasattr(model, "signed"):
            raise UsageError(
                f"{file} is no learnt body; its card can't be signed.",
                why="Author and licence stand in the files of learnt bodies alone.",
                fix="Leave out --author, --licence and --save, or name the file that `palpate learn` wrote of a body.",
            )
        model = model.signed(author, licence)
        model.save(file)
    found = card_of(surrogate_of(model, file.stem), file)
    if out is not None:
        text = found.to_json() + "\n" if out.suffix.lower() == ".json" else found.to_markdown()
        write_file(out, with_seal(out, text))
        Console(as_json).result(str(out), {"card": str(out)})
        return
    Console(as_json).result(str(found).rstrip(), found.as_dict())


def export_dataset(
    dataset: Annotated[Path, typer.Argument(help="Dataset of solves, NAME.zarr.")],
    out: Annotated[
        Path,
        typer.Option(
            "-o",
            "--out",
            help="File to write: .csv, .parquet, .nc (tables), .pvd (VTU files for ParaView) or .glb.",
        ),
    ],
    rows: Annotated[
        str | None,
        typer.Option(help="Rows for shapes, from 0, such as 0,4,8 or 0:10. Default: all that converged."),
    ] = None,
    fields: Annotated[
        bool, typer.Option("--fields", help="For .csv: also the fields at the nodes, to NAME-fields.csv.")
    ] = False,
    targets: Annotated[
        int, count_option("--targets", least=1, help="For .glb: most states of the body.")
    ] = 8,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a dataset for other tools: a table of its solves, or the shapes of the body."""
    from palpate.dataset import Dataset
    from palpate.dataset.dataset_tables import TABLES, write_fields_csv, write_table
    from palpate.export.shape_files import SHAPES, series_of_dataset, write_shapes

    data = Dataset.open(dataset)
    ending = out.suffix.lower()
    if ending not in (*TABLES, *SHAPES):
        raise UsageError(
            f"{out} names no format that can be written.",
            why=f"The ending {ending or 'none'!r} is none of {', '.join((*TABLES, *SHAPES))}.",
            fix="End the name in one of them.",
        )
    if fields and ending != ".csv":
        raise UsageError("--fields is for .csv.", why="Other files hold the fields or none.", fix="Omit it.")
    written = []
    if ending in SHAPES:
        written.append(
            write_shapes(
                series_of_dataset(data, _rows(rows, len(data)), dataset.stem),
                out,
                targets=targets,
                overwrite=force,
            )
        )
    else:
        if rows is not None:
            raise UsageError("--rows chooses shapes; a table has all solves.", fix="Omit it.")
        beside = [out.with_name(f"{out.stem}-fields.csv")] if fields else []
        require_outputs([out, *beside], overwrite=force)
        written.append(write_table(data, out, overwrite=force))
        written += [write_fields_csv(data, path, overwrite=force) for path in beside]
    Console(as_json).result("\n".join(map(str, written)), {"files": [str(path) for path in written]})


def _rows(text: str | None, count: int) -> list[int] | None:
    """Return rows that are written as 0,4,8 or 0:10 or 0:100:5."""
    if text is None:
        return None
    found: list[int] = []
    try:
        for part in text.split(","):
            ends = [whole_number(end) if end.strip() else None for end in part.split(":")]
            found += [ends[0] or 0] if len(ends) == 1 else list(range(*slice(*ends).indices(count)))
    except (UsageError, ValueError, TypeError) as error:
        raise UsageError(f"{text!r} are no rows.", fix="Write 0,4,8 or 0:10 or 0:100:5.") from error
    return found


@export_app.command("gltf")
def to_gltf(
    file: ShownFile,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File. Default: NAME.glb, beside the file.")
    ] = None,
    at: Place = None,
    depth: Depth = None,
    steps: Steps = 8,
    over: Over = None,
    field: ColourField = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the body under a stroke as glTF (GLB), with the deformation as morph targets, for viewers and web pages."""
    _write(
        file,
        out,
        (".glb",),
        stroke=(at, depth, steps),
        answers=(over, field),
        force=force,
        console=Console(as_json),
    )


@export_app.command("vtu")
def to_vtu(
    file: ShownFile,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="File (.pvd or .vtu). Default: NAME.pvd, beside the file."),
    ] = None,
    at: Place = None,
    depth: Depth = None,
    steps: Steps = 20,
    over: Over = None,
    field: ColourField = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the body under a stroke as VTU files and a PVD file, which ParaView plays."""
    _write(
        file,
        out,
        (".pvd", ".vtu"),
        stroke=(at, depth, steps),
        answers=(over, field),
        force=force,
        console=Console(as_json),
    )


def _write(
    file: Path,
    out: Path | None,
    endings: tuple[str, ...],
    *,
    stroke: tuple[str | None, float | None, int],
    answers: tuple[str | None, str | None],
    force: bool,
    console: Console,
) -> None:
    """Write the shapes of a stroke, or of inputs of a model without touch; by default beside the model."""
    from palpate.cli.drawn_stroke import reservations_about, stroke_of
    from palpate.export.shape_files import series_of_surrogate, write_shapes
    from palpate.surrogates import Surrogate

    out = out or file.with_suffix(endings[0])
    require_outputs([out], endings=endings, overwrite=force)
    at, depth, steps = stroke
    body = Surrogate.load(file)
    if body.can_be_touched:
        if any(answers):
            raise UsageError(
                f"{file} is touched, and takes no --over and no --field.",
                fix="Choose its stroke by --at and --depth.",
            )
        X = stroke_of(body, steps, at, depth)
        for warning in reservations_about(body, X):
            console.say(f"warning: {warning}")
        series = series_of_surrogate(body, X)
    else:
        series = _series_of_inputs(body, at, depth, steps, answers)
        series = series.from_first() if out.suffix.lower() == ".glb" else series
        steps = len(series.values)
    path = write_shapes(series, out, targets=steps, card=body.card(file).as_dict(), overwrite=force)
    size = path.stat().st_size
    console.result(
        f"{path}  {size / 1e3:.0f} kB, {steps} states", {"file": str(path), "states": steps, "bytes": size}
    )


def _series_of_inputs(
    model: Surrogate, at: str | None, depth: float | None, steps: int, answers: tuple[str | None, str | None]
) -> ShapeSeries:
    """Return a model without touch at one place of its inputs, or over one of them."""
    import numpy as np

    from palpate.export.answer_shapes import series_of_answers
    from palpate.format import count
    from palpate.units import bounds, parse_quantity

    over, field = answers
    names, (low, high) = [r.name for r in model.inputs], bounds(model.inputs)
    if depth is not None or (over is not None and over not in names):
        raise UsageError(
            f"{model.name!r} has no {'depth' if depth is not None else f'input {over!r}'}.",
            why=f"Its inputs are {', '.join(names)}.",
            fix="Choose their values by --at, in this order, and one that runs through its range by --over.",
        )
    words = [] if at is None else number_list(at)
    if words and len(words) != len(names):
        raise UsageError(
            f"--at {at} has {count(len(words), 'number')}.",
            fix=f"Give one for each of {', '.join(names)}, in SI units.",
        )
    place = (low + high) / 2.0
    if words:
        inputs = zip(words, model.inputs, strict=True)
        place = np.array([parse_quantity(word, r.unit, r.name, bare=True) for word, r in inputs])
    X = np.tile(place, (1 if over is None else max(steps, 2), 1))
    if over is not None:
        column = names.index(over)
        X[:, column] = np.linspace(low[column], high[column], len(X))
    return series_of_answers(model, X, field)
