"""An exported library, asked through the Python wrapper that went out with it."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from palpate.export.check_points import ANSWERS

__all__ = ["CheckLibrary"]


class CheckLibrary:
    """A library, loaded by its Python wrapper's path, that answers as `palpate.export.check_points.Asker` asks."""

    def __init__(self, wrapper: Path) -> None:
        spec = importlib.util.spec_from_file_location(f"exported_{wrapper.stem}", wrapper)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        self.body: Any = module.Body()

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return `ANSWERS` numbers for each row of X (N, 3 + p)."""
        rows = np.empty((len(X), ANSWERS))
        for row, x in zip(rows, X.tolist(), strict=True):
            row[:19], row[20] = self.body.answer(x[:3], x[3:])
            row[19] = self.body.deviation(x[:3], x[3:])
        return rows

    def walk(self, X: np.ndarray) -> np.ndarray:
        """Return force, stored and lost energy (N, 5) of each step X (N, 1 + 3 + p)."""
        rows = np.empty((len(X), 5))
        self.body.start()
        for row, x in zip(rows, X.tolist(), strict=True):
            row[:3] = self.body.step(x[0], x[1:4], x[4:])[0]
            row[3:] = self.body.ledger[:2]
        return rows

    def shapes(self, X: np.ndarray) -> np.ndarray:
        """Return the field (N, nodes, components) for each row of X (N, 3 + p)."""
        body = self.body
        rows = [np.reshape(body.shape(x[:3], x[3:]), (body.nodes, body.components)) for x in X.tolist()]
        return np.array(rows)
