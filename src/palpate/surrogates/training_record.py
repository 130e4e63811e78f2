"""The record of a learnt body: its training, and measurements that have corrected it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.format import share

__all__ = ["correction_count", "correction_warning", "training_in_words"]


def training_in_words(meta: Mapping[str, Any]) -> str:
    """Return in words what the record tells of training and correction."""
    words = ""
    if "solves" in meta:
        words += f"; trained with {meta['solves']} solves"
        if meta.get("samples", meta["solves"]) != meta["solves"]:
            words += f" ({meta['samples']} samples by symmetry)"
    error = meta.get("force_error")
    if isinstance(error, Mapping) and {"median", "p95"} <= error.keys():
        words += f"; force error {share(error['median'])} median, {share(error['p95'])} p95"
    if (touches := correction_count(meta)) is not None:
        words += f"; corrected by {touches} measured touches"
        words += ", with a warning" if correction_warning(meta) else ""
    return words


def correction_count(meta: Mapping[str, Any]) -> int | None:
    """Return how many measured touches have corrected a body; None for one as it was learnt."""
    record = meta.get("correction")
    counts = record.get("counts") if isinstance(record, Mapping) else None
    return int(counts.get("learnt", 0)) if isinstance(counts, Mapping) else None


def correction_warning(meta: Mapping[str, Any]) -> str:
    """Return what was suspicious of the measurements that have corrected a body; "" if nothing was."""
    record = meta.get("correction")
    return str(record.get("warning", "")) if isinstance(record, Mapping) else ""
