"""`palpate card`, `palpate dataset export` and `palpate export gltf|vtu`: what others read of data and models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from palpate.cli.console import Console
from palpate.cli.export_commands import export_app
from palpate.cli.table_options import Json
from palpate.errors import UsageError

if TYPE_CHECKING:
    import numpy as np

    from palpate.surrogates import Surrogate

__all__ = ["card", "export_dataset", "stroke_of"]

Steps = Annotated[int, typer.Option(min=1, help="States of the stroke, from first contact to the deepest.")]
Place = Annotated[
    str | None,
    typer.Option(
        help="Place of the probe's contact, x,y,z in m; of a held body the displacement. Default: the middle, "
        "straight in."
    ),
]
Depth = Annotated[
    float | None, typer.Option(min=0, help="Largest depth in m. Default: the deepest trained one.")
]


def card(
    file: Annotated[Path, typer.Argument(help="Model file (.palpate).")],
    author: Annotated[str, typer.Option(help="Who made it; with --save.")] = "",
    licence: Annotated[str, typer.Option(help="Licence, such as CC-BY-4.0; with --save.")] = "",
    save: Annotated[bool, typer.Option("--save", help="Write author and licence into the file.")] = False,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File for the card: .md or .json. Default: stdout.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the card of a model: what it was trained on, by whom, its errors, limits, hashes and licence."""
    from palpate.files import write_file
    from palpate.learning.loading import load
    from palpate.surrogates.model_card import card_of

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
        write_file(out, text)
        Console(as_json).result(str(out), {"card": str(out)})
        return
    Console(as_json).result(found.to_markdown().rstrip(), found.as_dict())


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
    targets: Annotated[int, typer.Option(min=1, help="For .glb: most states of the body.")] = 8,
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
            write_shapes(series_of_dataset(data, _rows(rows, len(data)), dataset.stem), out, targets=targets)
        )
    else:
        if rows is not None:
            raise UsageError("--rows chooses shapes; a table has all solves.", fix="Omit it.")
        written.append(write_table(data, out))
        if fields:
            written.append(write_fields_csv(data, out.with_name(f"{out.stem}-fields.csv")))
    Console(as_json).result("\n".join(map(str, written)), {"files": [str(path) for path in written]})


def _rows(text: str | None, count: int) -> list[int] | None:
    """Return rows that are written as 0,4,8 or 0:10 or 0:100:5."""
    if text is None:
        return None
    found: list[int] = []
    try:
        for part in text.split(","):
            ends = [int(end) if end.strip() else None for end in part.split(":")]
            found += [ends[0] or 0] if len(ends) == 1 else list(range(*slice(*ends).indices(count)))
    except (ValueError, TypeError) as error:
        raise UsageError(f"{text!r} are no rows.", fix="Write 0,4,8 or 0:10 or 0:100:5.") from error
    return found


@export_app.command("gltf")
def to_gltf(
    file: Annotated[
        Path, typer.Argument(help="Model file (.palpate) of a body that was learnt with its shape.")
    ],
    out: Annotated[Path | None, typer.Option("-o", "--out", help="File. Default: NAME.glb.")] = None,
    at: Place = None,
    depth: Depth = None,
    steps: Steps = 8,
    as_json: Json = False,
) -> None:
    """Write the body under a stroke as glTF (GLB), with the deformation as morph targets, for viewers and web pages."""
    _write(file, out or file.with_suffix(".glb"), at, depth, steps, Console(as_json))


@export_app.command("vtu")
def to_vtu(
    file: Annotated[
        Path, typer.Argument(help="Model file (.palpate) of a body that was learnt with its shape.")
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File (.pvd or .vtu). Default: NAME.pvd.")
    ] = None,
    at: Place = None,
    depth: Depth = None,
    steps: Steps = 20,
    as_json: Json = False,
) -> None:
    """Write the body under a stroke as VTU files and a PVD file, which ParaView plays."""
    _write(file, out or file.with_suffix(".pvd"), at, depth, steps, Console(as_json))


def _write(file: Path, out: Path, at: str | None, depth: float | None, steps: int, console: Console) -> None:
    from palpate.export.shape_files import series_of_surrogate, write_shapes
    from palpate.surrogates import Surrogate

    body = Surrogate.load(file)
    series = series_of_surrogate(body, stroke_of(body, steps, at, depth))
    path = write_shapes(series, out, targets=steps, card=body.card(file).as_dict())
    size = path.stat().st_size
    console.result(
        f"{path}  {size / 1e3:.0f} kB, {steps} states", {"file": str(path), "states": steps, "bytes": size}
    )


def stroke_of(body: Surrogate, steps: int, at: str | None = None, depth: float | None = None) -> np.ndarray:
    """Return the inputs (steps, n) of a stroke from just after rest to the deepest place.

    Parameters
    ----------
    body : Surrogate
        The learnt body.
    steps : int
        Number of states.
    at : str, optional
        x,y,z in m: the place of contact of a pressed body, the displacement in the end of a held one. By default the
        middle of what was trained, straight into the body.
    depth : float, optional
        Largest depth in m; by default the deepest trained one.

    Raises
    ------
    UsageError
        If the place is no three numbers.
    """
    import numpy as np

    from palpate.runtime.touchable import touchable
    from palpate.units import bounds

    shares = np.arange(1, steps + 1) / steps
    given = None if at is None else _numbers(at)
    shown = body.fields.get("displacement")
    asked: Any = getattr(shown, "asked_by", None)
    if asked not in {None, "load"}:
        raise UsageError(
            f"The shape of {body.name!r} depends on what came before.",
            why="It remembers, so that a place alone does not tell its shape.",
            fix="Record a touch and export that: palpate run --record, palpate trace export.",
        )
    if asked == "load":
        low, high = bounds(shown.inputs)  # type: ignore[union-attr]  # it has a field of nodes; from no load to all
        return np.asarray(shares[:, None] * np.where(np.abs(high) >= np.abs(low), high, low))
    hand = touchable(body)
    low, high = bounds(body.inputs)
    far = hand.deepest if depth is None else depth
    if hand.surface is not None:
        centre, normal = np.asarray(hand.home), np.asarray(hand.normal)
        if given is not None:  # first contact is a radius above the place on the surface
            centre = given + hand.radius * normal
        places = centre - far * shares[:, None] * normal
    else:
        whole = given if given is not None else np.array([0.0, 0.0, far])[: len(low)]
        places = shares[:, None] * whole
    rest = np.tile((low + high)[None, places.shape[1] :] / 2, (steps, 1))
    return np.hstack([places, rest])


def _numbers(text: str) -> np.ndarray:
    import numpy as np

    try:
        values = np.array([float(part) for part in text.split(",")])
    except ValueError as error:
        raise UsageError(f"{text!r} is no place.", fix="Write x,y,z in m, such as 0.05,0.05,0.05.") from error
    if len(values) != 3:
        raise UsageError(f"{text!r} has {len(values)} numbers; a place has three.", fix="Write x,y,z in m.")
    return values
