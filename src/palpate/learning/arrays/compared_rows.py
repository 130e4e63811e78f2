"""Rows that a network is judged by: what was measured there, and what it answered before it had learnt them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.tables import numbers_of
from palpate.units import Quantity

__all__ = ["ComparedRows", "check_outputs"]

_PANELS = 6  # outputs that a figure shows, those of the largest spread


@dataclass(frozen=True, eq=False)
class ComparedRows:
    """Rows with what was measured and what was answered, both (J, m) in SI units."""

    measured: np.ndarray
    answered: np.ndarray
    words: str = "answers at rows before they were learnt"  # what the answers are
    deviation: np.ndarray | None = None  # (J, m), calibrated standard deviation of these answers

    def plot(self, outputs: Sequence[Quantity], title: str, path: str | os.PathLike[str] | None) -> Any:
        """Return a figure of answers over what was measured, a panel for each output, saved where a path is given."""
        from matplotlib.figure import Figure

        shown = np.sort(np.argsort(-self.measured.std(axis=0))[:_PANELS])
        columns = min(3, len(shown))
        lines = -(-len(shown) // columns)
        figure = Figure(figsize=(1.0 + 3.6 * columns, 0.8 + 3.4 * lines), layout="constrained")
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes, i in zip(panels, shown, strict=False):
            x, y = self.measured[:, i], self.answered[:, i]
            ends = [min(x.min(), y.min()), max(x.max(), y.max())]
            axes.plot(ends, ends, "-", color="0.5", linewidth=0.8)
            axes.plot(x, y, "o", markersize=3, alpha=0.6)
            unit = f" ({outputs[i].unit})" if outputs[i].unit else ""
            axes.set_xlabel(f"{outputs[i].name}{unit}, measured")
            axes.set_ylabel("answered")
            axes.grid(alpha=0.3)
        for axes in panels[len(shown) :]:
            axes.set_visible(False)
        figure.suptitle(f"{title}\n{self.words}", fontsize=9)
        if path is not None:
            figure.savefig(path)
        return figure


def check_outputs(Y: Any, rows: int, outputs: int) -> np.ndarray:
    """Return outputs (N, m) to compare with as numbers; (N,) will do for one."""
    Y = numbers_of("Outputs Y", Y)
    Y = Y[:, None] if Y.ndim == 1 else Y
    if Y.shape != (rows, outputs):
        raise UsageError(
            f"Outputs of shape {Y.shape} do not fit {rows} rows of inputs and a network of {outputs} outputs.",
            fix="Pass Y with a row for each row of X, and a column for each output.",
        )
    return np.asarray(Y)
