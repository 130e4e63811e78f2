"""Which rows of a sweep train and which test, and whether files on disk belong to the study at all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.study.build import body_of, loads_of
from palpate.study.models import Study

__all__ = ["check_data", "check_hash", "refuse_other", "train_and_test"]


def check_data(study: Study, data: Dataset, path: Path) -> Dataset:
    """The dataset, if it is of the study's body and loads.

    Raises
    ------
    UsageError
        If it is not: the file has the study's name, but the study was changed since.
    """
    wanted = body_of(study).problem(loads_of(study)).describe()
    found = data.provenance["problem"]
    # compared as the file has it: tuples are lists there
    if json.loads(json.dumps(wanted)) != found:
        raise refuse_other(path)
    return data


def refuse_other(path: Path) -> UsageError:
    """The error of a file that has the study's name, but whose study was changed since."""
    return UsageError(
        f"{path} is not of this study's body and loads.",
        why="The study was changed after the sweep.",
        fix="Delete it and run `palpate sweep`, or give the changed study another name.",
    )


def check_hash(meta: Mapping[str, Any], train: Dataset, path: Path) -> None:
    """Refuse a model, by what it tells of itself, that was not learnt from just these training rows.

    Raises
    ------
    UsageError
        If it was not: rows that it has seen might be taken for unseen ones.
    """
    if meta.get("dataset", {}).get("hash") != train.hash:
        raise UsageError(
            f"{path} was learnt from other solves than this study trains with.",
            why="The sweep or its split was changed since, and what is unseen here may have been seen there.",
            fix="Run `palpate learn` again.",
        )


def train_and_test(study: Study, data: Dataset, random: Dataset | None) -> tuple[Dataset, Dataset]:
    """Training rows, and the rows that the network never sees, random loads among them."""
    good = data.ok
    parts = [] if random is None else [random.ok]
    if study.test.every:
        held = _held_rows(study, len(good))
        parts.insert(0, good.take(np.flatnonzero(held)))
        good = good.take(np.flatnonzero(~held))
    if not parts:
        raise UsageError(
            f"The study {study.name!r} keeps nothing for testing.",
            why="Both test.every and test.random are 0.",
            fix="Set one of them: a network is judged on solves that it has never seen.",
        )
    return good, Dataset.concat(parts)


def _held_rows(study: Study, count: int) -> np.ndarray:
    """Which of the sweep's rows (count,) are kept for testing: one in `test.every`.

    Of a grid every n-th; of other designs random ones. A Sobol sequence fills space in turns, so that every n-th
    of its points lie in one corner, and the network would never see that corner.
    """
    every = study.test.every
    if study.sweep.design == "grid":
        return np.asarray(np.arange(count) % every == every - 1)
    held = np.zeros(count, dtype=bool)
    rng = np.random.default_rng((study.test.seed, count))
    held[rng.choice(count, count // every, replace=False)] = True
    return held
