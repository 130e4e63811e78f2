"""`palpate dataset import`: results of another solver made into a dataset."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.cli.console import Console
from palpate.errors import UsageError
from palpate.input_files import read_toml

if TYPE_CHECKING:
    from palpate.dataset import Dataset
    from palpate.dataset.readers import Results

__all__ = ["Options", "import_files"]

Options = tuple[Sequence[str], Sequence[str], Sequence[str], Sequence[str]]
"""Words NAME=COLUMN of inputs and of outputs, COLUMN=UNIT, and names of coordinates."""


def import_files(
    files: Sequence[Path],
    mapping: Path | None,
    options: Options,
    out: Path | None,
    test: float,
    dry_run: bool,
    overwrite: bool,
    console: Console,
) -> None:
    """Read results of another solver, all of one model, print what they hold, and write a dataset.

    The options go before the TOML file of the mapping. The dataset is by default the first file's name with ``.zarr``;
    the share `test` of the cases goes to a test set of their own, ``NAME-test.zarr``. `dry_run` only prints.
    """
    from palpate.dataset.readers import import_results, read_mapping
    from palpate.dataset.readers.import_results import read_files

    wishes = _mapping(mapping, options)
    if dry_run and not (wishes.get("inputs") and wishes.get("outputs")):
        results = read_files(list(files), read_mapping(wishes))
        console.result(f"{results}\n{_NEXT}", {"results": _columns(results)})
        return
    imported = import_results(files, wishes)
    notes = list(imported.notes)
    if dry_run:
        text = "\n".join([str(imported.results), "", str(imported), "Nothing was written (--dry-run)."])
        content = {"results": _columns(imported.results), "rows": len(imported.dataset), "notes": notes}
        console.result(text, content)
        return
    path = out or files[0].with_suffix(".zarr")
    written = {"data": imported.dataset}
    if test:
        written = dict(zip(("data", "test"), _split(imported.dataset, test), strict=True))
    paths = {"data": path, "test": path.with_name(f"{path.stem}-test.zarr")}
    for name, data in written.items():
        data.save(paths[name], overwrite=overwrite)
    lines = [str(imported), *(f"{paths[name]}: {len(data)} solves" for name, data in written.items())]
    console.result(
        "\n".join(lines),
        {name: str(paths[name]) for name in written} | {"rows": len(imported.dataset), "notes": notes},
    )
    console.say(f"Next: palpate learn {path}")


_NEXT = "Say what they mean by --input NAME=COLUMN and --output NAME=COLUMN, or in a TOML file by --mapping."


def _mapping(path: Path | None, options: Options) -> dict[str, Any]:
    """Return the mapping of a file with the words of the options in it."""
    content: dict[str, Any] = {} if path is None else read_toml(path)
    inputs, outputs, units, coordinates = options
    for key, words in (("inputs", inputs), ("outputs", outputs)):
        entries = [{"name": name, "from": _parts(column)} for name, column in map(_pair, words)]
        if entries:
            content[key] = [*content.get(key, []), *entries]
    if units:
        content["units"] = {**content.get("units", {}), **dict(map(_pair, units))}
    if coordinates:
        content["coordinates"] = list(coordinates)
    return content


def _pair(word: str) -> tuple[str, str]:
    name, mark, value = word.partition("=")
    if not name.strip() or not mark:
        raise UsageError(f"{word!r} is no NAME=VALUE.", fix='Write it like --input "load=F" or --unit "F=N".')
    return name.strip(), value.strip() or name.strip()


def _parts(text: str) -> str | list[str]:
    """Return a column's name, or several that commas stand between."""
    parts = [part.strip() for part in text.split(",")]
    return parts if len(parts) > 1 else text


def _columns(results: Results) -> dict[str, Any]:
    """Return what results hold as plain data."""
    columns = {
        column.name: {"unit": column.unit, "places": column.places, "shape": list(column.values.shape)}
        for column in results.columns.values()
    }
    places = {
        name: {"count": len(p), "coordinates": list(p.coordinates)} for name, p in results.places.items()
    }
    return {
        "format": results.format,
        "cases": results.cases,
        "columns": columns,
        "places": places,
        "notes": list(results.notes),
    }


def _split(data: Dataset, share: float) -> tuple[Dataset, Dataset]:
    """Split at random; rows with the least or largest value of an input stay in training, which has to reach there."""
    rows = np.flatnonzero(data.converged)
    inputs = data.X[rows]
    low, high = inputs.min(axis=0), inputs.max(axis=0)
    extreme = ((inputs <= low) | (inputs >= high)).any(axis=1)
    inner = rows[~extreme]
    count = max(1, round(share * len(rows)))
    if count >= len(inner):
        raise UsageError(
            f"{count} of {len(rows)} solves can't be set aside for testing.",
            why=f"{len(inner)} lie between the least and the largest inputs.",
            fix="Choose a smaller --test, or import more cases.",
        )
    chosen = np.random.default_rng(1).permutation(inner)[:count]
    return data.take(np.setdiff1d(np.arange(len(data)), chosen)), data.take(np.sort(chosen))
