"""The record of a body's making as a page shows it, without empty fields and without internal names."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from palpate.format import summary_figure
from palpate.surrogates.model_card import NOT_STATED

__all__ = ["about_record"]

INTERNAL = frozenset({
    "training", "samples", "form", "radial", "networks", "loo", "learning_curve", "runtime", "settings", "filter",
    "refinement", "config_hash", "hash", "no_better", "problem", "machine", "versions", "seed", "symmetry", "design",
    "stem", "counts",
})  # fmt: skip
"""Names of a record that serve programs, or who wrote them; `palpate info` prints them."""

WORDS = {
    "words": "learnt from",
    "created": "solved",
    "solves": "solves to learn from",
    "left_out": "errors of solves left out of learning in turn",
    "median": "force error, median",
    "p95": "force error, 95th percentile",
}
"""What a person reads for a name."""

_HOISTED = ("dataset", "provenance")  # groups whose own names say nothing
_FIGURES = ("validation", "left_out")


def about_record(meta: Mapping[str, Any]) -> dict[str, Any]:
    """Return a body's record for people; a group of which nothing is left is no group.

    A body that a filter has learnt tells the solves that the filter saw: fewer of them carry its energy.
    """
    record: dict[str, Any] = {}
    observed = meta.get("filter")
    if isinstance(observed, Mapping) and "solves" in meta and "samples" in observed:
        meta = {**meta, "solves": observed["samples"]}
    for name, value in meta.items():
        if name in INTERNAL:
            continue
        if isinstance(value, Mapping):
            group = {key: summary_figure(key, v) for key, v in value.items()} if name in _FIGURES else value
            value = about_record(group)
        if name in _HOISTED and isinstance(value, Mapping):
            record |= value
        elif not _is_empty(value):
            record[WORDS.get(name, name)] = value
    return record


def _is_empty(value: Any) -> bool:
    """Return whether there is nothing to read in a value."""
    if isinstance(value, float):
        return math.isnan(value)
    return value is None or value == NOT_STATED or (hasattr(value, "__len__") and not len(value))
