"""How far one update may move a unit, for every rule that solves for a step."""

from __future__ import annotations

import numpy as np

from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State

__all__ = ["TRIES", "excess"]

TRIES = 5  # with R enlarged from one to the next; a step that is too long in all of them is not taken


def excess(state: State, step: np.ndarray, settings: Settings) -> float:
    """Longest move of a unit in a step (h, p) of the shapes, over the bound; 0 where there is none."""
    if not settings.step_bound or not state.units:
        return 0.0
    return settings.regressors(state.inputs).form.stride(state.theta, step) / settings.step_bound
