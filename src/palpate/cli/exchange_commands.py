"""`palpate card`, `palpate dataset export` and `palpate export gltf|vtu`: what others read of data and models."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from palpate.cli.console import Console
from palpate.cli.export_commands import export_app
from palpate.cli.number_options import count_option, number_option
from palpate.cli.table_options import Force, Json
from palpate.errors import UsageError
from palpate.number_text import whole_number
from palpate.output_files import require_outputs

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
        "the probe goes in against the surface there. Of a held body its displacement. Default: the middle."
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
    from palpate.learning.loading import load
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
    found = card_of(model, file)
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
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the body under a stroke as glTF (GLB), with the deformation as morph targets, for viewers and web pages."""
    _write(file, out, (".glb",), stroke=(at, depth, steps), force=force, console=Console(as_json))


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
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the body under a stroke as VTU files and a PVD file, which ParaView plays."""
    _write(file, out, (".pvd", ".vtu"), stroke=(at, depth, steps), force=force, console=Console(as_json))


def _write(
    file: Path,
    out: Path | None,
    endings: tuple[str, ...],
    *,
    stroke: tuple[str | None, float | None, int],
    force: bool,
    console: Console,
) -> None:
    """Write the shapes of a stroke; by default to a file of the first ending beside the model."""
    from palpate.cli.drawn_stroke import reservations_about, stroke_of
    from palpate.export.shape_files import series_of_surrogate, write_shapes
    from palpate.surrogates import Surrogate

    out = out or file.with_suffix(endings[0])
    require_outputs([out], endings=endings, overwrite=force)
    at, depth, steps = stroke
    body = Surrogate.load(file)
    X = stroke_of(body, steps, at, depth)
    for warning in reservations_about(body, X):
        console.say(f"warning: {warning}")
    series = series_of_surrogate(body, X)
    path = write_shapes(series, out, targets=steps, card=body.card(file).as_dict(), overwrite=force)
    size = path.stat().st_size
    console.result(
        f"{path}  {size / 1e3:.0f} kB, {steps} states", {"file": str(path), "states": steps, "bytes": size}
    )
