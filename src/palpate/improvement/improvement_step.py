"""The state of an improvement after a part of the work, of whatever is improved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.surrogates import Surrogate

__all__ = ["ImprovementStep"]


@dataclass(frozen=True, eq=False)
class ImprovementStep:
    """State of an improvement after a part of the work.

    Attributes
    ----------
    phase : {"solved", "learnt", "judged", "ended"}
        A batch was solved; a surrogate was learnt, the first one (or that of an earlier run) before it is judged; the
        first one was judged; or nothing more will come.
    solves, unseen : int
        Converged solves to learn from, and those to judge by.
    error, median : float
        Relative force error of the surrogate on the unseen solves, at the 95th percentile and the median; of numbers,
        fields and curves the error over the range of the one that misses most. Not-a-number while there is no
        surrogate, or nothing to judge it by.
    places : (k, 3) array
        Contact points of the solves on the surface at rest, m, in the order in which they were solved; none without
        touch.
    values : (k,) array
        Relative force error of each of these solves when it is left out of learning; not-a-number where it is not
        known, as of solves that the surrogate has not learnt from.
    seconds : float
        Time since the improvement began.
    surrogate : Surrogate or None
        The best so far on the unseen solves.
    train, test : Dataset or None
        The solves to learn from, and those to judge by.
    history : optional
        Record of the learning of the surrogate.
    is_new : bool
        Whether this step has brought a surrogate that takes the place of the last one.
    before, tried : float
        Where a surrogate was learnt beside an earlier one: the error of the earlier and that of the new one, both on
        the same unseen solves, at the 95th percentile; else not-a-number. The new one was kept where `is_new` says so.
    reached : bool
        Whether the wanted error is kept.
    reason : str
        Why the improvement has ended; empty before.
    model_path : Path or None
        File of the surrogate, where there is one.
    mesh : float
        The mesh's part in the relative force error, beside `error`; not-a-number where no finer mesh was solved.
    """

    phase: str
    solves: int
    unseen: int
    error: float
    median: float
    places: np.ndarray
    values: np.ndarray
    seconds: float
    surrogate: Surrogate | None
    train: Dataset | None
    test: Dataset | None
    history: Any = None
    is_new: bool = False
    reached: bool = False
    reason: str = ""
    model_path: Path | None = None
    mesh: float = math.nan
    before: float = math.nan
    tried: float = math.nan
