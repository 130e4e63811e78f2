"""`palpate correct`: correct a model by measurements from a file, from standard input or from a port."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.cli.console import Console
from palpate.dataset.measured import Measurements, lines_of, listening, measurements, read_measurements
from palpate.errors import AccuracyError, UsageError
from palpate.learning.correction import (
    Correction,
    Corrector,
    Discrepancy,
    Noise,
    correct,
    summarise_correction,
)
from palpate.output_files import require_outputs
from palpate.surrogates import Surrogate
from palpate.units import parse_quantity

__all__ = ["Source", "correct_model"]

_OFTEN = 100  # measurements between two lines of progress


@dataclass(frozen=True)
class Source:
    """Source of measurements: one of a file, standard input, a port."""

    file: Path | None  # table of measurements
    stdin: bool  # whether to read lines from standard input
    port: int | None  # of 127.0.0.1 at which one connection is awaited; 0: any free port
    stall: float  # seconds of silence that end a stream
    wait: float  # seconds that a connection is waited for
    missing: str = "leave-out"  # for a file: "leave-out" or "refuse" rows in which a value is missing
    # for a file: how the table is written, as `palpate.tables.read_table` takes it
    options: Mapping[str, Any] | None = None
    token: bool = True  # whether a connection must begin with the token that is printed

    def __post_init__(self) -> None:
        if (self.file is not None) + self.stdin + (self.port is not None) != 1:
            raise UsageError(
                "Measurements come from one source.", fix="Give one of --file FILE, --stdin and --port N."
            )


def correct_model(
    model: Path,
    source: Source,
    out: Path,
    parameters: Sequence[str],
    discrepancy: Discrepancy,
    noise: Noise,
    console: Console,
) -> None:
    """Correct a model and write it; errors before and after go to stdout.

    An `AccuracyError` says, after everything has been written, that the forces have another sign, or may have another
    unit, than the model's.
    """
    body = Surrogate.load(model)
    if body.hand_energy.baseline.holds:
        raise UsageError(
            f"{model} holds no body that is pressed.",
            why="Measured forces correct what a probe presses.",
            fix="Give the model of a study of touches, such as `palpate demo block` writes.",
        )
    if out.exists() and out.samefile(model):
        raise UsageError(
            f"{out} is the model itself.",
            why="The corrected one would take its place, and could not be corrected anew.",
            fix="Choose another name for --out.",
        )
    values = _parameters(body, parameters)
    notes: list[str] = []
    read = [] if source.file is None else [source.file]
    require_outputs([out], inputs=read)  # before anything is measured
    if source.file is not None:
        measured = read_measurements(source.file, missing=source.missing, **(source.options or {}))
        notes = list(measured.notes)
        for note in notes:
            console.say(f"{source.file}: {note}")
        done = correct(body, measured, parameters=values, discrepancy=discrepancy, noise=noise)
    else:
        corrector = Corrector(body, parameters=values, discrepancy=discrepancy, noise=noise)
        done = _streamed(corrector, source, console)
    path = done.surrogate.save(out)
    if done.warning and not done.doubtful:
        console.say(done.warning)
    content = {**done.as_dict(), "warning": done.warning or None, "notes": notes, "model": str(path)}
    console.result(f"{done}\n{path}", content)
    if done.doubtful:
        raise AccuracyError(
            done.warning,
            why="A model that believes them pushes the hand as wrongly.",
            fix=f"Mend the measurements and correct again; if they are right, {path} is the corrected model.",
        )


def _streamed(corrector: Corrector, source: Source, console: Console) -> Correction:
    def say(port: int, token: str) -> None:
        # whoever feeds it must know the port and the token, with --json too
        asks = f"first line: {token}" if token else "Warning: no token; every user of this machine can send"
        print(f"listening on 127.0.0.1:{port}; {asks}", file=sys.stderr, flush=True)  # noqa: T201

    def answer(text: str) -> None:
        print(text, file=sys.stderr, flush=True)  # noqa: T201

    def ended(why: str) -> None:
        print(f"the stream ended: {why}; what had come is learnt from", file=sys.stderr, flush=True)  # noqa: T201

    if source.port is not None:
        with listening(source.port, source.wait, say, token=source.token) as other:
            lines = measurements(other.lines(source.stall, ended), other.answer)
            return _learnt(corrector, lines, console)
    # a descriptor of its own: at exit Python waits for a thread that still reads sys.stdin
    stream = open(os.dup(sys.stdin.fileno()), "rb")  # noqa: SIM115 - the thread goes on reading it
    return _learnt(corrector, measurements(lines_of(stream, source.stall, ended), answer), console)


def _learnt(corrector: Corrector, lines: Iterable[Measurements], console: Console) -> Correction:
    rows = []
    for i, one in enumerate(lines, 1):
        corrector.observe(one.position[0], one.force[0], along=one.along[0])
        rows.append(one)
        if i % _OFTEN == 0:
            console.say(str(corrector))
    if not rows:
        raise UsageError(
            "No measurement came.",
            why="The stream ended, or was silent for too long, before the first good line.",
            fix="Greet with units first, such as: palpate 1 length=mm force=N time=s",
        )
    position, force, along, depth, time = (
        np.concatenate([getattr(r, name) for r in rows])
        for name in ("position", "force", "along", "depth", "time")
    )
    record = Measurements(position, force, along, depth, time)
    return summarise_correction(corrector, record)


def _parameters(surrogate: Surrogate, words: Sequence[str]) -> list[float]:
    """Return the values of the further inputs, in their order, from NAME=VALUE in SI units or with a unit."""
    said = dict(word.partition("=")[::2] for word in words)
    names = [r.name for r in surrogate.parameters]
    if set(said) != set(names) or len(said) != len(words):
        unknown, missing = [n for n in said if n not in names], [n for n in names if n not in said]
        wrong = [f"{n!r} is none of them" for n in unknown] + [f"{n!r} is missing" for n in missing]
        raise UsageError(
            f"The model's further inputs are: {', '.join(names) or 'none'}"
            f"; {', '.join(wrong) or 'one is given twice'}.",
            why="A specimen is one member of the family that the model is of.",
            fix="Give each of them once: --parameter NAME=VALUE." if names else "Leave --parameter out.",
        )
    values = [
        parse_quantity(said[r.name], r.unit, f"--parameter {r.name}", bare=True) for r in surrogate.parameters
    ]
    for r, value in zip(surrogate.parameters, values, strict=True):
        if not r.low <= value <= r.high:
            raise UsageError(
                f"{r.name} = {value:g} {r.unit} is outside of {r.low:g} … {r.high:g} {r.unit}.".replace(
                    " .", "."
                ),
                why="The model was trained for members of the family within these ranges, and knows no others.",
                fix="Give a value within them, in SI units or with a unit: fat.young=4kPa.",
            )
    return values
