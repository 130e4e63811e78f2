"""An exported library, asked through the Python wrapper that went out with it."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from palpate.export.check_answers import MOST_SLOPES, Replies
from palpate.export.check_points import ANSWERS

__all__ = ["CheckLibrary", "CheckModel"]


def _module(wrapper: Path) -> Any:
    spec = importlib.util.spec_from_file_location(f"exported_{wrapper.stem}", wrapper)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class CheckModel:
    """A library of what no hand feels, loaded by its Python wrapper's path."""

    def __init__(self, wrapper: Path) -> None:
        self._model: Any = _module(wrapper).Model()

    def replies(self, X: np.ndarray) -> Replies:
        """Return the answers (N, m), which are in the trained region (N,), and derivatives (N, m, n) at X (N, n)."""
        rows = [self._model.evaluate(x) for x in X.tolist()]
        inside = np.array([there for _, there in rows])
        if self._model.outputs > MOST_SLOPES:
            return np.array([y for y, _ in rows]), inside, None
        slopes = [np.reshape(self._model.jacobian(x)[1], (-1, X.shape[1])) for x in X.tolist()]
        return np.array([y for y, _ in rows]), inside, np.array(slopes)


class CheckLibrary:
    """A library, loaded by its Python wrapper's path, that answers as `palpate.export.check_points.Asker` asks."""

    def __init__(self, wrapper: Path) -> None:
        self.body: Any = _module(wrapper).Body()

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return `ANSWERS` numbers for each row of X (N, 3 + p)."""
        rows = np.empty((len(X), ANSWERS))
        for row, x in zip(rows, X.tolist(), strict=True):
            row[:19], row[20] = self.body.answer(x[:3], x[3:])
            row[19] = self.body.deviation(x[:3], x[3:])
        return rows

    def torques(self, X: np.ndarray) -> np.ndarray:
        """Return the torque (N, 3) for each row of X (N, 3 + p)."""
        return np.array([self.body.torque(x[:3], x[3:])[0] for x in X.tolist()])

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
