"""`palpate ask --table`: the answers of a model at all rows of a table, as a table."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from palpate.cli.answer_at_place import Prediction, surrogate_answers
from palpate.cli.ask_command import answers_at
from palpate.cli.console import Console
from palpate.errors import UsageError
from palpate.files import write_file
from palpate.format import by_number, count
from palpate.learning.loading import load_surrogate
from palpate.output_files import require_outputs
from palpate.tables import Table, read_table
from palpate.units import Range

__all__ = ["ask_table"]


def ask_table(
    model: Path,
    path: Path,
    out: Path | None,
    console: Console,
    reading: Mapping[str, Any],
    *,
    force: bool = False,
) -> None:
    """Answer for all rows of a table, in its order; the answers go to a file, or to stdout.

    Columns are matched by name, others are left out, units are converted. `reading` is how the table is written, as
    `palpate.tables.read_table` takes it; `force` replaces a table that exists.
    """
    surrogate = load_surrogate(model)
    if out is not None:
        require_outputs([out], endings=(".csv",), inputs=(path, model), overwrite=force)
    inputs, felt = surrogate.inputs, surrogate.can_be_touched
    table = read_table(path, **reading)
    X = _inputs(table, inputs, model)
    whole = np.isfinite(X).all(axis=1)
    notes = [*table.notes, *_notes(table, inputs, whole, model)]
    for note in notes:
        console.say(f"{path}: {note}")
    asked = X[whole]
    answers: Sequence[Any] = []
    if len(asked):
        answers = answers_at(surrogate, asked) if felt else surrogate_answers(surrogate, asked)
    head, rows = (_of_bodies if felt else _of_networks)(answers)
    named = ["line", *(f"{r.name} [{r.unit}]" if r.unit else r.name for r in inputs), *head]
    text = _as_csv(named, table.lines, X, whole, rows, len(head))
    lines = table.lines[whole].tolist()
    records = [{"line": i, **one.as_dict(inputs)} for i, one in zip(lines, answers, strict=True)]
    content = {"model": str(model), "table": str(path), "answers": records, "notes": notes}
    if out is None:
        console.result(text.rstrip("\n"), content)
        return
    write_file(out, text)
    console.result(f"{count(len(answers), 'answer')} of {model}\n{out}", {**content, "out": str(out)})


def _inputs(table: Table, inputs: Sequence[Range], model: Path) -> np.ndarray:
    """Return the inputs (N, n), by name and in the model's units."""
    missing = [r.name for r in inputs if r.name not in table.names and not _has(table, r.name)]
    if missing:
        raise UsageError(
            f"{table.path} lacks {count(len(missing), 'column')} that {model} asks for: {', '.join(missing)}.",
            why=f"Its columns are {', '.join(table.names)}; they are matched by name.",
            fix="Name the columns as the model's inputs, which `palpate ask MODEL` shows.",
        )
    return np.column_stack([table.values(r.name, r.unit) for r in inputs])


def _notes(table: Table, inputs: Sequence[Range], whole: np.ndarray, model: Path) -> list[str]:
    """Return notes on columns and rows that are left out."""
    asked, notes = {table.column(r.name) for r in inputs}, []
    others = ", ".join(column.name for column in table.columns if column not in asked)
    if others:
        notes.append(f"Columns left out that {model.name} does not ask for: {others}.")
    if not whole.all():
        lines = table.lines[~whole].tolist()
        verb = "has" if len(lines) == 1 else "have"
        notes.append(
            f"{len(lines)} of {len(whole)} rows {verb} no answer, a value is missing: {by_number('line', lines)}."
        )
    return notes


def _has(table: Table, name: str) -> bool:
    try:
        table.column(name)
    except UsageError:
        return False
    return True


def _of_networks(answers: Sequence[Prediction]) -> tuple[list[str], list[list[Any]]]:
    """Return head and rows: each output with its deviation, and whether it is trusted."""
    if not answers:
        return [], []
    first, head = answers[0], list[str]()
    for output in first.outputs:
        unit = f" [{output.unit}]" if output.unit else ""
        head += [f"{output.name}{unit}"] + [f"{output.name} deviation{unit}"] * (first.deviations is not None)
    rows = []
    for one in answers:
        row: list[Any] = []
        for j, value in enumerate(one.values):
            row += [float(value)] + ([float(one.deviations[j])] if one.deviations is not None else [])
        rows.append(row + ([] if one.inside is None else [_word(one.inside)]))
    return head + ([] if first.inside is None else ["trusted"]), rows


def _of_bodies(answers: Sequence[Any]) -> tuple[list[str], list[list[Any]]]:
    """Return head and rows: force, energy, relative deviation of the force, and whether it is trusted."""
    head = ["Fx [N]", "Fy [N]", "Fz [N]", "energy [J]", "deviation", "trusted"]
    return head, [
        [*map(float, a.force), float(a.energy), float(a.deviation), _word(a.inside)] for a in answers
    ]


def _word(value: bool) -> str:
    return "yes" if value else "no"


def _as_csv(
    named: Sequence[str],
    lines: np.ndarray,
    X: np.ndarray,
    whole: np.ndarray,
    rows: Sequence[list[Any]],
    width: int,
) -> str:
    """Return the answers as CSV with decimal points; cells without a value are empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(named)
    answered = iter(rows)
    for line, x, known in zip(lines.tolist(), X.tolist(), whole, strict=True):
        cells = [line, *x, *(next(answered) if known else [""] * width)]
        writer.writerow(["" if isinstance(c, float) and not np.isfinite(c) else c for c in cells])
    return text.getvalue()
