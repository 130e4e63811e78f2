"""Advice after a study's validation: the learning curve of its surrogates, and how many more solves would help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.dataset import Dataset
from palpate.errors import PalpateError
from palpate.study.run import Paths
from palpate.study.study import Study
from palpate.surrogates import Surrogate
from palpate.validation import Validation
from palpate.validation.more_solves import advice_on_solves

__all__ = ["advice_after", "earlier_curve"]


def earlier_curve(paths: Paths, name: str) -> Sequence[Mapping[str, Any]]:
    """Return the learning curve of the surrogate of this study that a file holds; empty where there is none."""
    if not paths.model.exists():
        return ()
    try:
        meta = Surrogate.load(paths.model).meta
    except PalpateError:  # it is about to be replaced
        return ()
    return tuple(meta.get("learning_curve", ())) if meta.get("name") == name else ()


def advice_after(study: Study, model: Surrogate, train: Dataset, validation: Validation, file: Path) -> str:
    """Return a sentence on how many solves would keep the limits; empty where more solves can't be added or help."""
    if study.sweep is None or not study.sweep.grows:
        return ""
    curve = model.meta.get("learning_curve", ())
    return advice_on_solves(validation, len(train), curve, f"palpate sweep {file} --samples")
