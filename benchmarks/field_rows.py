"""Rows of fields learnt from few solves, by palpate and by others in the same run, for the tables of benchmarks."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from benchmarks.field_rivals import MISSING, RIVALS, best_of
from benchmarks.table import Column
from palpate.learning.fields import learn_modes
from palpate.surrogates import MeshPlaces
from palpate.units import Range

__all__ = ["COLUMNS", "field_rows", "missing_note"]

COLUMNS = (
    Column("field", "field"),
    Column("solves", "solves", "d"),
    Column("by", "by"),
    Column("p95", "error over the range, p95", ".2e"),
    Column("largest", "largest", ".2e"),
    Column("coverage", "within the 90 % interval", ".3f"),
    Column("seconds", "s of the processor", ".1f"),
    Column("settings", "chosen"),
)


def field_rows(
    name: str,
    unit: str,
    inputs: Sequence[Range],
    places: MeshPlaces,
    solved: tuple[np.ndarray, np.ndarray],
    unseen: tuple[np.ndarray, np.ndarray],
    *,
    rivals: bool = True,
) -> Iterator[dict[str, Any]]:
    """Yield the row of palpate, then those of the rivals.

    `solved` and `unseen` are inputs (N, n) and fields (N, nodes, components); the error at a node is the length of that
    of its components, over the range of the component that varies most.
    """
    (X, Y), (asked, truth) = solved, unseen
    span = float(np.ptp(truth, axis=(0, 1)).max())
    parts = tuple("xyz"[: Y.shape[2]]) if Y.shape[2] > 1 else ()

    def row(by: str, answer: np.ndarray, seconds: float, settings: str) -> dict[str, Any]:
        error = np.linalg.norm(answer - truth, axis=2) / span
        figures = {"p95": float(np.quantile(error, 0.95)), "largest": float(error.max()), "seconds": seconds}
        return {"field": name, "solves": len(X), "by": by, "settings": settings} | figures

    began = time.process_time()
    learnt = learn_modes(X, Y, inputs=inputs, places=places, name=name, unit=unit, components=parts)
    seconds, field = time.process_time() - began, learnt.field
    held = np.abs(field.values(asked) - truth) <= 1.645 * field.deviation(asked)
    bent = [r.name for r, b in zip(inputs, field.network.scaling.input_bend, strict=True) if b]
    chosen = f"{len(field.modes)} modes, {learnt.fitted.form}, ratios of {', '.join(bent) or 'no input'}"
    yield row("palpate", field.values(asked), seconds, chosen) | {"coverage": float(held.mean())}
    for by, choices in RIVALS.items() if rivals else ():
        began = time.process_time()
        model = best_of(choices, X, Y.reshape(len(Y), -1), inputs)
        seconds = time.process_time() - began
        yield row(by, model.predict(asked).reshape(truth.shape), seconds, model.settings)


def missing_note() -> tuple[str, ...]:
    """Return a note of the rivals whose packages are not installed."""
    return tuple(f"{name} is not installed, and not in this table." for name in MISSING)
