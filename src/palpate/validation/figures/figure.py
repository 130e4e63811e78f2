"""Base of all figures: measurements of a model on unseen solves.

A figure is a function of a `Subject` that returns a value derived from `Figure`; a sentence where the figure can't be
measured; or None where it does not apply. `palpate.validation.figures` lists all of them.
"""

from __future__ import annotations

from collections.abc import Mapping

from palpate.validation.worst import Worst

__all__ = ["Figure", "Measured"]

Measured = Mapping[str, tuple[float | None, Worst | str | None]]
"""Measured values by their names in `Limits`, each with its worst case; values of None are not judged."""


class Figure:
    """One measurement of a model on unseen solves."""

    def measured(self) -> Measured:
        """Return the values that are compared with limits."""
        return {}

    def lines(self) -> list[str]:
        """Return lines to print below the table of limits."""
        return []

    def notes(self) -> list[str]:
        """Return sentences on what was not judged, and why."""
        return []
