"""The rows of several datasets of one body as one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError

if TYPE_CHECKING:
    import xarray

    from palpate.dataset.dataset import Dataset

__all__ = ["joined"]


def joined(parts: Sequence[Dataset]) -> xarray.Dataset:
    """Rows of several sweeps, one after another; what all have in common is the first one's.

    Raises
    ------
    UsageError
        If there are none, or they are of different bodies or inputs.
    """
    import xarray

    if not parts:
        raise UsageError("There are no datasets to put together.", fix="Give at least one.")
    for other in parts[1:]:
        _check_same(parts[0], other)
    rows: xarray.Dataset = xarray.concat(
        [p.data for p in parts],
        "sample",
        data_vars="minimal",
        coords="minimal",
        compat="override",
        join="override",
        combine_attrs="override",
    )
    # row numbers of different sweeps mean nothing together
    return rows.assign_coords(sample=np.arange(rows.sizes["sample"])) if "sample" in rows.coords else rows


def _check_same(first: Dataset, other: Dataset) -> None:
    if other.provenance["problem"] != first.provenance["problem"] or other.ranges != first.ranges:
        raise UsageError(
            "These datasets are not of the same body and inputs.",
            why="Rows of different problems would be learnt as if they were of one.",
            fix="Keep them apart, or sweep again with one study.",
        )
    # one body meshed by two versions of the mesher has two sets of nodes
    if not np.array_equal(other.rest, first.rest):
        raise UsageError(
            "These datasets are of different meshes.",
            why="Their nodes at rest differ, so that rows of one field would mean different places.",
            fix="Sweep again with one version of the mesher.",
        )
