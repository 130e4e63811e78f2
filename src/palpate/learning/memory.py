"""The remembered window as a judge: a change must not undo what the last observations taught.

The window of the growth rule remembers the observations themselves here, not their errors alone. Both the
update and pruning ask it. Without it the filter relapses: a step that fits one sample can spoil the others where
the linearisation is bad, and a unit that contributes little beside much larger ones that nearly cancel may be
all that is left of their sum.
"""

from __future__ import annotations

from palpate.learning.gaussian import value
from palpate.learning.settings import Settings
from palpate.learning.state import State

__all__ = ["forgets", "window_error"]


def window_error(state: State, settings: Settings) -> float:
    """Sum of squared errors of a state over its window."""
    X, Y = state.seen[:, : state.inputs], state.seen[:, state.inputs :]
    return float(((value(state, X, settings) - Y) ** 2).sum())


def forgets(before: State, after: State, settings: Settings) -> bool:
    """Whether a change raises the error over the window by more than the settings allow."""
    if not settings.forgetting or len(before.seen) < 2:
        return False
    return window_error(after, settings) > settings.forgetting * window_error(before, settings)
