"""A dataset in words, for whoever prints one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.dataset.fields import BOOKKEEPING
from palpate.format import share

if TYPE_CHECKING:
    from palpate.dataset.dataset import Dataset

__all__ = ["in_words"]

_UNSPOKEN = {"inputs", "displacement", "largest_strain"} | {field.name for field in BOOKKEEPING}


def in_words(dataset: Dataset) -> str:
    """What a dataset is of, its inputs, its answers and its hash, line by line."""
    failed = len(dataset) - int(dataset.converged.sum())
    tail = f"{failed} did not converge" if failed else "all converged"
    named = dataset.provenance.get("problem", {}).get("body", {}).get("type", "a body")
    body = dataset.provenance.get("words") or named
    return "\n".join(
        [
            f"Dataset of {len(dataset)} solves of {body}, {tail}",
            *(f"  input   {r}" for r in dataset.ranges),
            f"  answers {', '.join(_answers(dataset))}",
            *_strain_line(dataset),
            f"  hash    {dataset.hash[:12]}",
        ]
    )


def _answers(dataset: Dataset) -> list[str]:
    nodes = f"{len(dataset.rest)} nodes ({dataset.nodes_of_interest.size} of interest)"
    field = [f"displacement of {nodes}"] if "displacement" in dataset else [nodes]
    others = (str(name) for name in dataset.data.data_vars)
    return field + [name.replace("_", " ") for name in others if name not in _UNSPOKEN]


def _strain_line(dataset: Dataset) -> list[str]:
    known = dataset.largest_strain[np.isfinite(dataset.largest_strain)]
    kind = "strain" if "triangles" in dataset else "fibre strain"
    return [f"  largest {kind} {share(float(known.max()))}"] if known.size else []
