"""What a report tells of one body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.dataset import Dataset
from palpate.learning import History
from palpate.surrogates import TouchModel
from palpate.validation.result import Validation

__all__ = ["Chapter"]


@dataclass(frozen=True, eq=False)
class Chapter:
    """One body: what was solved, what was learnt from it, and how good that is.

    Attributes
    ----------
    name : str
        Its heading.
    touch : TouchModel
    train, test : Dataset
        Solves that were learnt from, and solves that were not.
    validation : Validation
        Of `touch` on `test`.
    history : History
        Of the sequential filter.
    rivals : mapping of str to History, optional
        Other runs to draw beside it, for example the founding form with tightened thresholds.
    settings : mapping, optional
        What the study declared; nested mappings are shown with dotted names.
    timings : mapping of str to float, optional
        Seconds of each stage.
    provenance : mapping, optional
        By default the training set's own.
    """

    name: str
    touch: TouchModel
    train: Dataset
    test: Dataset
    validation: Validation
    history: History
    rivals: Mapping[str, History] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
