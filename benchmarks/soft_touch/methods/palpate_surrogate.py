"""palpate's surrogate of the body, learnt from so many solves (`python -m benchmarks.soft_touch.learn_bodies`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["LEARNT", "load", "settings_of", "shown_of"]

LEARNT = Path(__file__).parents[1] / "learnt"


class _Learnt:
    def __init__(self, path: Path, solves: int) -> None:
        import palpate as pp

        self._surrogate, self.solves = pp.Surrogate.load(path), solves
        self.settings = f"{solves} solves"

    def force(self, places: np.ndarray) -> np.ndarray:
        return np.asarray(self._surrogate.energy.force(places))


def settings_of(case: Any) -> list[dict[str, Any]]:
    """Return the numbers of solves that the body was learnt from, fewest first."""
    counts = sorted(int(path.stem.rpartition("-")[2]) for path in LEARNT.glob(f"{case.name}-*.palpate"))
    return [{"solves": count} for count in counts]


def shown_of(case: Any) -> dict[str, Any]:
    """Return the setting of the most solves: what the benchmark's own project shows is not chosen at test places."""
    return settings_of(case)[-1]


def load(case: Any, solves: int | None = None) -> _Learnt:
    """Return the surrogate learnt from so many solves, by default from the most."""
    counts = [setting["solves"] for setting in settings_of(case)] if solves is None else [solves]
    if not counts:
        raise FileNotFoundError(
            f"{LEARNT} has no surrogate of {case.name}. Learn it: python -m benchmarks.soft_touch.learn_bodies"
        )
    count = counts[-1]
    return _Learnt(LEARNT / f"{case.name}-{count}.palpate", count)
