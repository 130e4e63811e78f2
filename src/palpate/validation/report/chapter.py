"""Content of a report on one body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.learning import History
from palpate.learning.learn_dataset import LearningHistory, filter_record
from palpate.surrogates import Surrogate
from palpate.validation.figures.history_following import Followed, follow_unseen
from palpate.validation.subject import Subject
from palpate.validation.touch_comparison import TouchComparison
from palpate.validation.unseen_solves import TouchFunction, TouchSolves
from palpate.validation.validate import Validation

__all__ = ["Chapter"]


@dataclass(frozen=True, eq=False)
class Chapter:
    """One body: what was solved, what was learnt from it, and how good that is.

    Attributes
    ----------
    name : str
        Its heading.
    model : Surrogate
        What was learnt.
    test : Dataset or TouchSolves
        Solves that were not learnt from.
    validation : Validation
        Of `model` on `test`.
    train : Dataset, optional
        Solves that were learnt from.
    history : LearningHistory or History, optional
        What `palpate.learn` returned beside the model, or the record of a sequential filter alone.
    rivals : mapping of str to History, optional
        Other runs to draw beside it, for example the founding form with tightened thresholds.
    settings : mapping, optional
        What the study declared; nested mappings are shown with dotted names.
    timings : mapping of str to float, optional
        Seconds of each stage.
    provenance : mapping, optional
        By default the training set's own, else that of the model.
    comparisons : sequence of TouchComparison
        Recorded touches beside the full model.
    advice : str
        How many solves would keep the limits, as a sentence; empty where more solves help nothing.
    """

    name: str
    model: Surrogate | TouchFunction
    test: Dataset | TouchSolves
    validation: Validation
    train: Dataset | None = None
    history: LearningHistory | History | None = None
    rivals: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    comparisons: Sequence[TouchComparison] = ()
    advice: str = ""

    @property
    def surrogate(self) -> Surrogate | None:
        """The model, where it is a surrogate and no function of a place alone."""
        return self.model if isinstance(self.model, Surrogate) else None

    @property
    def filter(self) -> History | None:
        """Record of the sequential filter, where one ran."""
        return filter_record(self.history)

    @cached_property
    def subject(self) -> Subject:
        """The model with the solves of the test that it has not seen."""
        return Subject.of(self.model, self.test)

    @cached_property
    def followed(self) -> list[Followed]:
        """The unseen histories, followed by a body with memory; empty for others."""
        if self.subject.body is None or self.subject.histories is None:
            return []
        return follow_unseen(self.subject.body, self.subject.histories)

    @property
    def meta(self) -> Mapping[str, Any]:
        """Description that the model has of its making."""
        meta: Mapping[str, Any] = getattr(self.model, "meta", {})
        return meta

    @cached_property
    def learnt_from(self) -> np.ndarray:
        """Inputs (N, n) of the solves that were learnt from, as far as they are known: their number is the one told."""
        X = getattr(getattr(self.train, "ok", self.train), "X", None)
        if X is None or np.ndim(X) != 2 or not len(X) or self.subject.histories is not None:
            return np.zeros((0, 0))
        if self.subject.solves is None or np.shape(X)[1] != self.subject.solves.X.shape[1]:
            return np.asarray(X)
        assert self.surrogate is not None
        touching = np.asarray(X)[self.surrogate.hand_energy.baseline.coordinate(np.asarray(X)) > 0]
        # later ones may have made no better surrogate
        return np.asarray(touching[: int(self.meta.get("solves", len(touching)))])

    @property
    def origin(self) -> Mapping[str, Any]:
        """Provenance of the solves: given, or that of the training set."""
        origin: Mapping[str, Any] = self.provenance or getattr(self.train, "provenance", None) or {}
        return origin
