"""`palpate fit`: learn a network from the columns of a table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from palpate.cli.console import Console
from palpate.cli.table_options import column_list
from palpate.errors import UsageError
from palpate.format import count, plain, share
from palpate.learning import fit
from palpate.learning.learn import ranges_of
from palpate.options import FitOptions
from palpate.output_files import require_outputs
from palpate.tables import Table, read_table
from palpate.units import Quantity, Range

__all__ = ["Columns", "few_rows", "fit_table"]

_USUAL = 10  # rows for each input that a smooth function takes at least (Loeppky, Sacks & Welch 2009)
_MANY = 100  # rows from which on the held-out error is known to 14 %


@dataclass(frozen=True)
class Columns:
    """Columns of a table to learn from; each text is a name, or several with commas between them."""

    inputs: Sequence[str]
    outputs: Sequence[str]
    missing: str = "leave-out"  # "leave-out" or "refuse" rows in which a value is missing


def fit_table(
    path: Path,
    columns: Columns,
    out: Path | None,
    console: Console,
    *,
    reading: Mapping[str, Any],
    force: bool = False,
    options: FitOptions,
) -> None:
    """Learn a network from a table and write it; a summary goes to stdout.

    A file for the model that is left out has the table's name with the ending .palpate; `reading` is how the table is
    written, as `palpate.tables.read_table` takes it.
    """
    out = path.with_suffix(".palpate") if out is None else out
    if out.exists() and not force:
        raise UsageError(
            f"{out} exists already.", fix="Choose another name with -o, or replace a model with --force."
        )
    # before anything is learnt
    require_outputs([out], endings=(".palpate",), inputs=[path], overwrite=force)
    table = read_table(path, **reading)
    inputs = _names(table, columns.inputs, "inputs")
    outputs = _names(table, columns.outputs, "outputs")
    if both := [name for name in inputs if name in outputs]:
        raise UsageError(f"Column {both[0]!r} is an input and an output.", fix="Choose one of them.")
    values = table.array([*inputs, *outputs])
    rows, notes = table.rows_without_gaps(values, [*inputs, *outputs], columns.missing)
    notes = [*table.notes, *notes]
    for note in notes:
        console.say(f"{path}: {note}")
    X, Y = values[rows, : len(inputs)], values[rows, len(inputs) :]
    if not rows.any():
        raise UsageError(f"{path}: no row has all values.", fix="Choose other columns.")
    ranges = [Range(r.name, r.low, r.high, table.si_unit(r.name)) for r in ranges_of(X, inputs)]
    quantities = [Quantity(name, table.si_unit(name)) for name in outputs]
    model = fit(
        X,
        Y[:, 0] if len(outputs) == 1 else Y,
        ranges,
        quantities,
        lines=table.lines[rows].tolist(),
        options=options,
    )
    saved = model.surrogate(out.stem).save(out)
    content = {
        "model": str(saved),
        "table": str(path),
        "rows": len(X),
        "rows_left_out": int((~rows).sum()),
        "inputs": [asdict(r) for r in ranges],
        "outputs": [asdict(q) for q in quantities],
        "heldout": model.heldout,
        "notes": [*notes, *model.notes, *map(str.strip, few_rows(*X.shape))],
    }
    lines = [str(model), *(f"  {r}" for r in ranges)]
    lines += [f"  → {q.name} {q.unit}".rstrip() for q in quantities]
    lines += few_rows(*X.shape)
    lines.append(f"{count(len(X), 'row')} of {path}\n{saved}")
    console.result("\n".join(lines), content)


def few_rows(rows: int, inputs: int) -> list[str]:
    """Return a sentence on how few rows are, and how well the held-out error is known; nothing of many rows.

    A root mean square of n errors scatters by one part in the root of 2n; 95 % of them lie within twice that.
    """
    if rows > max(_MANY, _USUAL * inputs):
        return []
    scatter, each = share(2.0 / math.sqrt(2.0 * rows)), plain(rows / inputs)
    return [
        f"  few rows: {each} for each input, where {_USUAL} are the usual least; the held-out error is itself known to "
        f"±{scatter}, and more rows help more than a longer search"
    ]


def _names(table: Table, texts: Sequence[str], word: str) -> list[str]:
    """Return the names of columns as they stand in the table."""
    names = [table.column(name).name for name in column_list(texts, table.names)]
    if not names or len(set(names)) < len(names):
        raise UsageError(
            f"The {word} are {', '.join(map(repr, names)) or 'not named'}.",
            why=f"Columns of {table.path}: {', '.join(map(repr, table.names))}.",
            fix=f"Name each of them once, with commas between: --{word} NAME,NAME.",
        )
    return names
