"""`palpate.load`: one way to read a file that palpate has written, whatever it holds."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from palpate.dataset import Dataset, Layout, LoadHistory
from palpate.dataset.histories import history_dataset
from palpate.errors import FileFormatError, UsageError
from palpate.learning.arrays.fitted import Fitted
from palpate.network import Archive, Network, load_archive
from palpate.surrogates import Surrogate
from palpate.units import Range

__all__ = ["Loaded", "load", "load_histories", "load_surrogate", "surrogate_of"]

Loaded: TypeAlias = Surrogate | Fitted | Network | Dataset

_HISTORIES = "held-paths"  # files of load histories, which are datasets since 0.3


def load(path: str | os.PathLike[str]) -> Loaded:
    """Read a learnt body, a network, or load histories of before from a file.

    Parameters
    ----------
    path : path
        A ``.palpate`` file.

    Returns
    -------
    Surrogate, Fitted, Network or Dataset
        A learnt body; what `palpate.fit` has made, or a network alone; or the histories that a body with memory was
        learnt from, where an earlier version wrote them.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign, from a later version, or a body of 0.1.0.
    """
    kind = load_archive(path).kind
    if kind == _HISTORIES:
        return load_histories(path)
    if kind != Archive.kind:
        return Surrogate.load(path)
    try:
        return Fitted.load(path)
    except FileFormatError:
        return Network.load(path)


def load_surrogate(path: str | os.PathLike[str]) -> Surrogate:
    """Return what a file holds as a surrogate; histories are refused."""
    return surrogate_of(load(path), Path(path).stem)


def surrogate_of(learnt: Loaded, name: str) -> Surrogate:
    """Return what was learnt as a surrogate: of a network, which gets the name, its quantities ``outputs``."""
    if isinstance(learnt, Fitted):
        made = learnt.surrogate(name)
        (part,) = made.quantities.values()
        return replace(made, quantities={"outputs": part})
    if isinstance(learnt, Dataset):
        raise UsageError(
            f"{name} is a dataset, and no learnt body and no network.",
            why="It holds solves, which answer nowhere else.",
            fix="Give a file of `palpate learn` or `palpate fit`.",
        )
    return Surrogate.of(learnt, name)


def load_histories(path: str | os.PathLike[str]) -> Dataset:
    """Return the load histories of an earlier version's file as a dataset; FileFormatError if it holds none."""
    archive = load_archive(path, kind=_HISTORIES)
    try:
        arrays, meta = archive.arrays, archive.meta
        ends = np.cumsum(arrays["lengths"])[:-1]
        names = ("times", "place", "force", "stored", "lost", "displacement")
        columns = [np.split(arrays[name], ends) for name in names]
        paths = [LoadHistory(*parts) for parts in zip(*columns, strict=True)]
        of_interest = np.isin(np.arange(len(arrays["rest"])), [int(i) for i in meta["of_interest"]])
        layout = Layout(arrays["rest"], of_interest, [int(meta["node"])], [arrays["direction"].tolist()])
        body = {"type": "Cantilever", "half_height": float(meta["radius"])}
        # a body that yields knows no time: its samples were numbered
        relaxes = not all(np.array_equal(one.times, np.arange(1.0, 1.0 + len(one))) for one in paths)
        load = Range("P", min(0.0, float(arrays["force"].min())), max(0.0, float(arrays["force"].max())), "N")
        return history_dataset(paths, load, layout, {"problem": {"body": body}, "relaxes": relaxes})
    except (KeyError, TypeError, ValueError, IndexError, UsageError) as error:
        raise FileFormatError(f"{path} does not hold histories.", why=str(error)) from error
